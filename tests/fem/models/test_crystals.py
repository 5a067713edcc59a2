"""Films that are stiffer along some directions, or bend as no plate does."""

import numpy as np
import pytest

from nanorom.errors import SceneError
from nanorom.fem.reduce import reduce_scene
from nanorom.scene import elasticity
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Disc, Rectangle
from nanorom.scene.material import Material
from nanorom.scene.scene import Accuracy, Modes, Reduction, Scene
from nanorom.scene.support import Support
from tests.fem.clamped import ClampedRectangle, lowest

TOLERANCE = 1e-6
ROUGH = Accuracy(tolerance=1e-4)
LENGTH, WIDTH, THICKNESS, DENSITY = 10e-6, 6e-6, 200e-9, 4600.0
CRYSTAL = {  # black phosphorus, about
    "youngs_modulus": 160e9,
    "poisson_ratio": 0.4,
    "youngs_modulus_2": 44e9,
    "shear_modulus": 30e9,
    "density": DENSITY,
}
SILICON = (165.7e9, 63.9e9, 79.6e9)  # c11, c12, c44 (Hopcroft et al. 2010)


def rectangle(material, **changes):
    parts = {
        "geometry": Rectangle(length=LENGTH, width=WIDTH),
        "plate": Plate(thickness=THICKNESS, model="plate"),
        "material": material,
        "support": Support("simply_supported"),
        "modes": Modes(count=6),
        "accuracy": Accuracy(tolerance=TOLERANCE),
    }
    return Scene(**parts | changes)


def supported(law, tension, count):
    """Frequencies (count,) in Hz of a simply supported rectangle of a law (3, 3) in N m."""
    m, n = np.meshgrid(np.arange(1, 12), np.arange(1, 12))
    x, y = m * np.pi / LENGTH, n * np.pi / WIDTH
    square = law[0][0] * x**4 + 2 * (law[0][1] + 2 * law[2][2]) * x**2 * y**2 + law[1][1] * y**4
    square = square + tension * (x**2 + y**2)
    return np.sort(np.sqrt(square / (DENSITY * THICKNESS)).ravel())[:count] / (2 * np.pi)


def hooke(e, f, nu, g):
    """Plane stress of moduli along x and y, by inverting the compliance."""
    return np.linalg.inv([[1 / e, -nu / e, 0], [-nu / e, 1 / f, 0], [0, 0, 1 / g]])


@pytest.mark.parametrize("tension", [0.0, 2.0])
def test_orthotropic_rectangle_has_the_closed_form(tension):
    scene = rectangle(Material(**CRYSTAL), tension=Tension.isotropic(tension))
    law = hooke(160e9, 44e9, 0.4, 30e9) * THICKNESS**3 / 12
    exact = supported(law, tension, 6)
    assert reduce_scene(scene).frequency == pytest.approx(exact, rel=TOLERANCE)


def test_quarter_turn_exchanges_the_axes():
    scene = rectangle(Material(**CRYSTAL | {"orientation": "90 deg"}))
    law = hooke(44e9, 160e9, 0.4 * 44 / 160, 30e9) * THICKNESS**3 / 12
    assert reduce_scene(scene).frequency == pytest.approx(supported(law, 0.0, 6), rel=TOLERANCE)


def test_turned_crystal_meets_an_independent_ritz_solution():
    """30 degrees off the sides: bending and twisting are coupled, and no mirror is left."""
    material = Material(**CRYSTAL | {"orientation": "30 deg"})
    scene = rectangle(material, support=Support("clamped"), tension=Tension(1.0, 3.0))
    turn, compliance = np.deg2rad(30), np.linalg.inv(hooke(160e9, 44e9, 0.4, 30e9))
    c, s = np.cos(turn), np.sin(turn)
    # stress along the crystal of one along x and y; strain is work-conjugate
    stress = [[c * c, s * s, 2 * c * s], [s * s, c * c, -2 * c * s], [-c * s, c * s, c * c - s * s]]
    law = np.linalg.inv(np.transpose(stress) @ compliance @ stress) * THICKNESS**3 / 12
    film = ClampedRectangle(LENGTH * 1e6, WIDTH * 1e6)  # in um: D/T in um^2
    stiffness = film.bending(law * 1e12) + film.tension(1.0, 3.0)
    values, _ = lowest(stiffness, film.mass(), 6)
    exact = np.sqrt(values / (DENSITY * THICKNESS)) * 1e6 / (2 * np.pi)
    assert reduce_scene(scene).frequency == pytest.approx(exact, rel=TOLERANCE)


def drum(material, model="membrane", **changes):
    parts = {
        "geometry": Disc(radius=3e-6),
        "plate": Plate(thickness=1e-9, model=model),
        "material": material,
        "tension": Tension.isotropic(0.05),
        "modes": Modes(count=3),
        "accuracy": Accuracy(tolerance=TOLERANCE),
    }
    return Scene(**parts | changes)


def test_isotropic_crystal_is_the_isotropic_film():
    plain = {"youngs_modulus": 100e9, "poisson_ratio": 0.25, "density": 3000.0}
    crystal = Material(youngs_modulus_2=100e9, shear_modulus=100e9 / 2.5, orientation=0.4, **plain)
    one, other = (
        reduce_scene(drum(m, model="plate", tension=Tension.isotropic(1e-3), accuracy=ROUGH))
        for m in (Material(**plain), crystal)
    )
    assert other.frequency == pytest.approx(one.frequency, rel=1e-4)
    b = np.einsum("iiii->i", one.cubic)
    assert np.einsum("iiii->i", other.cubic) == pytest.approx(b, rel=1e-3)


def test_round_mode_of_a_membrane_does_not_see_how_its_crystal_is_turned():
    """b of f01: meshed as a quarter with the crystal along x, as a whole with it turned."""
    at = {
        angle: reduce_scene(
            drum(Material(**CRYSTAL | {"orientation": angle}), modes=Modes(count=1))
        )
        for angle in (0.0, 0.5)
    }
    assert at[0.5].cubic[0, 0, 0, 0] == pytest.approx(at[0.0].cubic[0, 0, 0, 0], rel=3 * TOLERANCE)


def test_tensors_of_a_crystal_are_the_same_by_direct_and_by_step():
    """The direct route has the law in arrays, static load cases in their energy."""
    scene = drum(Material(**CRYSTAL | {"orientation": 0.5}), accuracy=Accuracy(tolerance=1e-3))
    direct = reduce_scene(scene)
    step = reduce_scene(scene.with_(reduction=Reduction(method="step")))
    scale = np.abs(direct.cubic).max()
    assert np.abs(step.cubic - direct.cubic).max() < 1e-7 * scale


def test_cubic_crystal_is_given_by_its_three_constants():
    """Silicon (001): E of <100> is 130, of <110> 169 GPa (Hopcroft et al. 2010, table I)."""
    known = Material.of_cubic(*SILICON)
    material = Material(density=2330.0, **known)
    compliance = np.linalg.inv(np.array(material.law) * material.youngs_modulus)
    assert 1 / compliance[0, 0] == pytest.approx(130e9, rel=2e-3)
    turned = Material(density=2330.0, orientation="45 deg", **known)
    compliance = np.linalg.inv(np.array(turned.law) * turned.youngs_modulus)
    assert 1 / compliance[0, 0] == pytest.approx(169e9, rel=2e-3)
    assert elasticity.is_aligned(turned.law) and elasticity.is_square(turned.law)


GRAPHENE = """
[geometry]
shape = "rectangle"
length = "20 nm"
width = "10 nm"
[plate]
thickness = "0.335 nm"
model = "plate"
[material]
stretching = "340 N/m"
bending = "1.5 eV"
poisson_ratio = 0.16
density = "2267 kg/m^3"
[support]
edge = "simply_supported"
[modes]
count = 3
"""


def test_graphene_bends_by_its_own_stiffness_and_stretches_by_its_own():
    scene = Scene.from_toml(GRAPHENE)
    model = reduce_scene(scene)
    bending, mass = 1.5 * 1.602176634e-19, 2267 * 0.335e-9
    m, n = np.array([(1, 1), (2, 1), (3, 1)]).T
    square = (m * np.pi / 20e-9) ** 2 + (n * np.pi / 10e-9) ** 2
    exact = square * np.sqrt(bending / mass) / (2 * np.pi)
    assert model.frequency == pytest.approx(exact, rel=TOLERANCE)
    assert scene.material.youngs_modulus * 0.335e-9 == pytest.approx(340.0)
    assert Scene.from_toml(scene.to_toml()) == scene


BAD = [
    ('stretching = "340 N/m"', 'stretching = "340 Pa"', "material.stretching", "a tension"),
    ('stretching = "340 N/m"', "", "material.youngs_modulus", "missing"),
    ('stretching = "340 N/m"', "stretching = 3\nyoungs_modulus = 1", "material", "stretching"),
    ('stretching = "340 N/m"', "cubic = [1, 2]", "material.cubic", "c11, c12 and c44"),
    ('stretching = "340 N/m"', "cubic = [3, 1, 1]", "material.poisson_ratio", "beside cubic"),
    ('bending = "1.5 eV"', 'bending = "1.5 V"', "material.bending", "a bending stiffness"),
    ('bending = "1.5 eV"', "youngs_modulus_2 = 1e9", "material.shear_modulus", "missing"),
    ('bending = "1.5 eV"', 'orientation = "3 deg"', "material.shear_modulus", "missing"),
    (
        'bending = "1.5 eV"',
        "youngs_modulus_2 = 1e14\nshear_modulus = 1e9",
        "material.poisson_ratio",
        "less than the root",
    ),
    ('model = "plate"', 'model = "shell"', "material.bending", "allowed: plate"),
]


@pytest.mark.parametrize(("old", "new", "key", "told"), BAD)
def test_crystals_that_make_no_sense_are_refused(old, new, key, told):
    with pytest.raises(SceneError) as caught:
        Scene.from_toml(GRAPHENE.replace(old, new))
    assert str(caught.value).startswith(f"{key}: ") and told in str(caught.value)
