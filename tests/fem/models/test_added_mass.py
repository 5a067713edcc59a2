"""Masses on the film against closed forms, perturbation theory and independent solutions."""

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar
from scipy.special import jv, jvp, yv, yvp

from nanorom.errors import SceneError
from nanorom.fem.reduce import reduce_scene
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Disc, Rectangle
from nanorom.scene.mass import AddedMass
from nanorom.scene.material import Material
from nanorom.scene.scene import Accuracy, Modes, Scene
from nanorom.scene.support import Support

TOLERANCE = 1e-6
POINT = 1e-5  # asked for where cells shrink to a point: a third of the time
SIDES = 10e-6, 7e-6
THICKNESS, DENSITY = 100e-9, 2700.0


def plate(masses=(), **changes):
    """A simply supported rectangle without tension."""
    parts = {
        "geometry": Rectangle(length=SIDES[0], width=SIDES[1]),
        "plate": Plate(thickness=THICKNESS, model="plate"),
        "material": Material(youngs_modulus="70 GPa", poisson_ratio=0.3, density=DENSITY),
        "support": Support("simply_supported"),
        "modes": Modes(count=4),
        "masses": masses,
        "accuracy": Accuracy(tolerance=TOLERANCE),
    }
    return Scene(**parts | changes)


def point_mass_on_plate(share, place, count):
    """Squared frequencies (count,) of a simply supported plate with a point mass, in its own units.

    With K w = omega^2 (M + m delta) w the receptance of the plate's exact modes at the mass is
    1 = m omega^2 sum_n phi_n^2/(omega_n^2 - omega^2); terms beyond those summed follow statically.
    share: of the plate's mass; place: in sides; frequencies by D/(rho h) = 1 and sides of 1, b/a.
    """
    a, b = 1.0, SIDES[1] / SIDES[0]
    m, n = np.meshgrid(np.arange(1, 1200), np.arange(1, 1200), indexing="ij")
    keep = (m / a) ** 2 + (n / b) ** 2 < 1200**2
    m, n = m[keep], n[keep]
    values = np.pi**4 * ((m / a) ** 2 + (n / b) ** 2) ** 2
    squares = 4 * (np.sin(np.pi * m * place[0]) * np.sin(np.pi * n * place[1])) ** 2
    order = np.argsort(values)
    values, squares = values[order], squares[order]
    first, rest = slice(0, 400), slice(400, None)
    beyond = a * b / (4 * np.pi**3 * 1200**2)  # an integral: squares are 1 on average
    static = (squares[rest] / values[rest]).sum() + beyond
    second = (squares[rest] / values[rest] ** 2).sum()

    def equation(x):
        near = (squares[first] / (values[first] - x)).sum()
        return 1 - share * x * (near + static + x * second)

    poles = values[squares > 1e-12]
    found, low = [], 0.0
    for high in poles[: count + 2]:
        if high - low < 1e-9 * high:
            continue
        span = high - low
        found.append(brentq(equation, low + 1e-12 * span, high - 1e-12 * span, xtol=1e-12))
        low = high
    return np.array(found[:count])


def unit(scene):
    """Frequency in Hz of omega = 1 in the units of `point_mass_on_plate`."""
    rigidity = 70e9 * THICKNESS**3 / (12 * (1 - 0.3**2))
    return np.sqrt(rigidity / (DENSITY * THICKNESS)) / SIDES[0] ** 2 / (2 * np.pi)


FILM = DENSITY * THICKNESS * SIDES[0] * SIDES[1]


@pytest.mark.parametrize("share", [0.1, 1.0])
def test_point_mass_on_a_plate_meets_the_equation_of_its_receptance(share):
    place = np.array([0.31, 0.62])
    position = (place - 0.5) * SIDES
    accuracy = Accuracy(tolerance=POINT)
    scene = plate([AddedMass(value=share * FILM, position=position)], accuracy=accuracy)
    model = reduce_scene(scene)
    exact = np.sqrt(point_mass_on_plate(share, place, 4)) * unit(scene)
    assert model.frequency == pytest.approx(exact, rel=POINT)
    told = model.diagnostics["error_frequencies"]
    assert (np.abs(model.frequency / exact - 1) < 5 * np.asarray(told)).all()


def drum(masses=(), **changes):
    """A drum of radius 5 um under 0.1 N/m."""
    parts = {
        "geometry": Disc(radius=5e-6),
        "plate": Plate(thickness=THICKNESS, model="membrane"),
        "material": Material(youngs_modulus="70 GPa", poisson_ratio=0.3, density=DENSITY),
        "tension": Tension.isotropic(0.1),
        "modes": Modes(count=1),
        "masses": masses,
        "accuracy": Accuracy(tolerance=TOLERANCE),
    }
    return Scene(**parts | changes)


DRUM = DENSITY * THICKNESS * np.pi * 5e-6**2
VELOCITY = np.sqrt(0.1 / (DENSITY * THICKNESS))


def heavy_centre(share, rim):
    """k R of a drum whose mass has a share more, spread over its centre out to rim R.

    J0(k n r) within, J0(k r) and Y0(k r) beyond: value and slope agree at the rim.
    """
    n = np.sqrt(1 + share / rim**2)

    def characteristic(k):
        a, c = jv(0, k), yv(0, k)
        outer = [c * jv(m, k * rim) - a * yv(m, k * rim) for m in (0, 1)]
        return jv(0, n * k * rim) * outer[1] - n * jv(1, n * k * rim) * outer[0]

    return brentq(characteristic, 0.5, 2.404, xtol=1e-14)


@pytest.mark.parametrize(("share", "rim"), [(0.3, 0.25), (2.0, 0.1)])
def test_disc_at_the_centre_of_a_membrane_meets_its_characteristic_equation(share, rim):
    model = reduce_scene(drum([AddedMass(value=share * DRUM, radius=rim * 5e-6)]))
    exact = heavy_centre(share, rim) * VELOCITY / 5e-6 / (2 * np.pi)
    assert model.frequency == pytest.approx([exact], rel=TOLERANCE)


def heavy_beside_centre(share, rim, away, near):
    """k R near a value, of a drum whose mass has a share more on a disc of a rim away from it.

    About the disc's centre J_m(k n r) within and c J_m(k r) + d Y_m(k r) beyond, equal in value and
    slope at the rim.  One combination vanishes at points of the drum's edge but not at all inside
    (Betcke and Trefethen 2005, doi:10.1137/S0036144503437336).
    """
    n, m, rng = np.sqrt(1 + share / rim**2), np.arange(16), np.random.default_rng(1)
    radius = np.concatenate([np.ones(60), np.sqrt(rng.random(60))])
    angle = np.pi * np.concatenate([(np.arange(60) + 0.5) / 60, rng.random(60)])
    x, y = radius * np.cos(angle) - away, radius * np.sin(angle)
    beyond = np.hypot(x, y) > rim
    r, theta = np.hypot(x, y)[beyond, None], np.arctan2(y, x)[beyond, None]

    def left(k):
        j, slope = jv(m, k * n * rim), k * n * jvp(m, k * n * rim)
        a, b, da, db = jv(m, k * rim), yv(m, k * rim), k * jvp(m, k * rim), k * yvp(m, k * rim)
        waves = (j * db - slope * b) * jv(m, k * r) + (slope * a - j * da) * yv(m, k * r)
        waves = waves * np.cos(m * theta)
        base = np.linalg.qr(waves / np.linalg.norm(waves, axis=0))[0]
        return np.linalg.svd(base[:60], compute_uv=False)[-1]

    bounds = near - 1e-3, near + 1e-3
    found = minimize_scalar(left, bounds=bounds, method="bounded", options={"xatol": 1e-12})
    assert found.fun < 1e-2 * left(near + 1e-2)
    return found.x


@pytest.mark.parametrize(
    ("share", "rim", "away"), [(0.2, 0.2, 0.35), (0.05, 0.05, 0.6), (0.1, 0.2, 0.79)]
)
def test_disc_beside_the_centre_of_a_membrane_meets_a_collocated_solution(share, rim, away):
    pad = AddedMass(value=share * DRUM, position=(away * 5e-6, 0.0), radius=rim * 5e-6)
    model = reduce_scene(drum([pad], modes=Modes(count=2)))
    unit = VELOCITY / 5e-6 / (2 * np.pi)
    exact = [heavy_beside_centre(share, rim, away, f / unit) * unit for f in model.frequency[:1]]
    assert model.frequency[:1] == pytest.approx(exact, rel=TOLERANCE)
    assert model.diagnostics["error_tensor"] < TOLERANCE


def test_disc_anywhere_on_a_plate_is_where_it_is():
    """The same whether the mesh has a quarter, with a ring for the disc, or cells that it cuts."""
    clamped = {"plate": Plate(thickness=THICKNESS, model="plate"), "modes": Modes(count=1)}
    pad = {"value": 0.2 * DRUM, "radius": 1e-6}
    centred = reduce_scene(drum([AddedMass(**pad)], **clamped))
    moved = reduce_scene(drum([AddedMass(position=(5e-13, 0.0), **pad)], **clamped))
    assert moved.frequency == pytest.approx(centred.frequency, rel=10 * TOLERANCE)


def test_frequency_falls_with_a_small_mass_as_perturbation_theory_has_it():
    """df/dm = -f phi^2/(2 m_r) at the mass."""
    place = np.array([0.31, 0.62])
    position = (place - 0.5) * SIDES
    share, accuracy = 1e-4, Accuracy(tolerance=1e-4)  # both err by next to nothing, see `told`
    bare = reduce_scene(plate(accuracy=accuracy))
    mass = AddedMass(value=share * FILM, position=position)
    model = reduce_scene(plate([mass], accuracy=accuracy))
    assert max(model.diagnostics["error_frequencies"]) < 1e-3 * share
    m, n = np.array([[1, 1], [2, 1], [1, 2], [3, 1]]).T
    phi = np.sin(np.pi * m * place[0]) * np.sin(np.pi * n * place[1])
    slope = -bare.frequency * phi**2 / (2 * bare.mass)
    change = (model.frequency - bare.frequency) / (share * FILM)
    assert change == pytest.approx(slope, rel=1e-2, abs=1e-3 * np.abs(slope).max())


BAD = [
    ({"value": -1e-18}, r"^mass\.value: found -1e-18; allowed: greater than 0"),
    ({"value": "1 nm"}, r"^mass\.value: found '1 nm', of another dimension"),
    (
        {"value": 1e-18, "position": (6e-6, 0), "radius": 1e-7},
        r"^mass\.position: found \(6, 0\) µm",
    ),
    (
        {"value": 1e-18, "position": (4.5e-6, 0), "radius": 1e-6},
        r"^mass\.position: .* with radius 1 µm; allowed: on the disc",
    ),
    ({"value": 1e-18}, r"^mass\.radius: found 0 beside plate\.model = membrane"),
]


@pytest.mark.parametrize(("mass", "told"), BAD)
def test_masses_that_make_no_sense_are_refused(mass, told):
    with pytest.raises(SceneError, match=told):
        drum([AddedMass(**mass)])


def test_masses_survive_the_file():
    masses = [AddedMass("1 fg", ("1 um", "0 um"), "0.5 um"), AddedMass(2e-18, (0, 0), 1e-6)]
    scene = drum(masses)
    assert Scene.from_toml(scene.to_toml()) == scene
    assert "[[mass]]" in scene.to_toml()
