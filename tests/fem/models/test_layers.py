"""Films of layers against a Ritz solution with displacements of its own, and closed forms."""

import attrs
import numpy as np
import pytest
from scipy.linalg import eigh

from nanorom.errors import SceneError
from nanorom.fem.reduce import reduce_scene
from nanorom.scene.layers import Layer, Stack
from nanorom.scene.scene import Scene
from tests.fem.clamped import ClampedRectangle, lowest

TOLERANCE = 1e-6
NITRIDE = Layer("100 nm", "250 GPa", 0.23, "3100 kg/m^3", stress="50 MPa")
GOLD = Layer("60 nm", "78 GPa", 0.42, "19300 kg/m^3", stress="-20 MPa")
LENGTH, WIDTH = 10.0, 7.0  # um

BILAYER = """
[geometry]
shape = "rectangle"
length = "10 um"
width = "7 um"
[[layer]]
thickness = "100 nm"
youngs_modulus = "250 GPa"
poisson_ratio = 0.23
density = "3100 kg/m^3"
stress = "50 MPa"
[[layer]]
thickness = "60 nm"
youngs_modulus = "78 GPa"
poisson_ratio = 0.42
density = "19300 kg/m^3"
stress = "-20 MPa"
[modes]
count = 4
"""


def laws(layers):
    """A, B, D (3, 3) about the bottom in N/m um^k, by Gauss points through each layer."""
    found, low = np.zeros((3, 3, 3)), 0.0
    points, weights = np.polynomial.legendre.leggauss(4)
    for layer in layers:
        e, nu, h = layer.youngs_modulus * 1e-6, layer.poisson_ratio, layer.thickness * 1e6
        law = np.linalg.inv([[1 / e, -nu / e, 0], [-nu / e, 1 / e, 0], [0, 0, 2 * (1 + nu) / e]])
        z = low + h * (points + 1) / 2
        for power in range(3):
            found[power] += (weights * h / 2 @ z**power) * law
        low += h
    return found


def coupled(layers, count):
    """Frequencies (count,) in Hz of the clamped stack: u, v and w by Ritz, coupled by B.

    Strain sym grad u - z grad grad w about the bottom.
    """
    film, in_plane = (ClampedRectangle(LENGTH, WIDTH, 16, power) for power in (2, 1))
    a, b, d = laws(layers)
    # (xx, yy, 2 xy) by derivatives of the field: u, v, w
    strain = [
        {0: [(1, 0)], 2: [(0, 1)]},
        {1: [(0, 1)], 2: [(1, 0)]},
    ]
    n = film.mass().shape[0]
    curvature = [((2, 0), 1.0), ((0, 2), 1.0), ((1, 1), 2.0)]
    whole = np.zeros((3 * n, 3 * n))
    for f in range(2):
        for g in range(2):
            block = sum(
                a[i, j] * in_plane.product(strain[f][i][0], strain[g][j][0])
                for i in strain[f]
                for j in strain[g]
            )
            whole[f * n : (f + 1) * n, g * n : (g + 1) * n] = block
        mixed = -sum(
            b[i, j] * factor * in_plane.product(strain[f][i][0], order, film)
            for i in strain[f]
            for j, (order, factor) in enumerate(curvature)
        )
        whole[f * n : (f + 1) * n, 2 * n :] = mixed
        whole[2 * n :, f * n : (f + 1) * n] = mixed.T
    stress = sum(layer.stress * layer.thickness for layer in layers)
    whole[2 * n :, 2 * n :] = film.bending(d) + film.tension(stress, stress)
    plane, coupling = whole[: 2 * n, : 2 * n], whole[: 2 * n, 2 * n :]
    scale = 1 / np.sqrt(np.diag(plane))
    values, vectors = eigh(plane * np.outer(scale, scale))
    kept = values > 1e-13 * values[-1]
    half = (vectors[:, kept] / np.sqrt(values[kept])).T @ (scale[:, None] * coupling)
    stiffness = whole[2 * n :, 2 * n :] - half.T @ half
    mass = sum(layer.density * layer.thickness for layer in layers)
    squares, _ = lowest(stiffness, film.mass(), count)
    return np.sqrt(squares / mass) * 1e6 / (2 * np.pi)


def test_bilayer_meets_a_ritz_solution_with_coupling():
    """Different Poisson's ratios: u and v take part, at no plane is the film without coupling."""
    model = reduce_scene(Scene.from_toml(BILAYER))
    exact = coupled([NITRIDE, GOLD], 4)
    assert model.frequency == pytest.approx(exact, rel=1e-5)  # what Ritz leaves in the plane


def test_equal_layers_are_one_film():
    thick = Layer("160 nm", "250 GPa", 0.23, "3100 kg/m^3", stress="50 MPa", loss=1e-3)
    parts = [Layer(h, "250 GPa", 0.23, "3100 kg/m^3", "50 MPa", 1e-3) for h in (5e-8, 1e-8, 1e-7)]
    one, several = (Stack.of(layers).film() for layers in ([thick], parts))
    for name in ("youngs_modulus", "poisson_ratio", "density", "bending", "loss"):
        assert getattr(several["material"], name) == pytest.approx(getattr(one["material"], name))
    assert one["material"].bending == pytest.approx(250e9 * 1.6e-7**3 / (12 * (1 - 0.23**2)))
    assert several["tension"].x == pytest.approx(50e6 * 1.6e-7)


def test_bimetal_bends_by_timoshenko_s_stiffness():
    """E I of two bars as one (Timoshenko 1925), by its closed form."""
    a, b = (Layer(h, e, 0.0, 1000.0) for h, e in ((3e-7, 100e9), (1e-7, 200e9)))
    (h1, e1), (h2, e2) = ((x.thickness, x.youngs_modulus) for x in (a, b))
    top = (e1 * h1**2 - e2 * h2**2) ** 2 + 4 * e1 * e2 * h1 * h2 * (h1 + h2) ** 2
    exact = top / (12 * (e1 * h1 + e2 * h2))
    assert Stack.of([a, b]).film()["material"].bending == pytest.approx(exact)


BAD = [
    ('thickness = "60 nm"', 'thickness = "-60 nm"', "layer.thickness", "greater than 0"),
    ('thickness = "60 nm"', "", "layer.thickness", "missing"),
    ("[modes]", "[tension]\nvalue = 1\n[modes]", "tension", "each layer has its own"),
    ("[modes]", "[plate]\nthickness = 1e-8\n[modes]", "plate.thickness", "beside [[layer]]"),
    ("[modes]", '[plate]\nmodel = "shell"\n[modes]', "plate.model", "plate beside [[layer]]"),
    (
        "[modes]",
        '[support]\nedge = { left = "clamped", default = "free" }\n[modes]',
        "layer.poisson_ratio",
        "one for all layers",
    ),
    ("[[layer]]", "[layer]", "not valid TOML", ""),
]


@pytest.mark.parametrize(("old", "new", "key", "told"), BAD)
def test_stacks_that_make_no_sense_are_refused(old, new, key, told):
    with pytest.raises(SceneError) as caught:
        Scene.from_toml(BILAYER.replace(old, new, 1))
    assert str(caught.value).startswith(key) and told in str(caught.value)


def test_stress_bows_a_film_at_edges_that_may_turn_and_at_no_others():
    held = BILAYER.replace("0.42", "0.23")
    assert Scene.from_toml(held).load is None
    text = held.replace("[modes]", '[support]\nedge = "simply_supported"\n[modes]')
    scene = Scene.from_toml(text)
    stack = Stack.of([NITRIDE, attrs.evolve(GOLD, poisson_ratio=0.23)])
    assert scene.load.moment == pytest.approx(stack.moment) and not scene.flat
    with pytest.raises(SceneError, match=r"^load\.moment: found beside \[\[layer\]\]"):
        Scene.from_toml(text + "[load]\nmoment = 1e-9\n")
    symmetric = text.replace('stress = "50 MPa"', "").replace('stress = "-20 MPa"', "")
    assert Scene.from_toml(symmetric).load is None
