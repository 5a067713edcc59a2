"""Full-order orbits: held against spectral solutions, and modal models with ever more modes."""

import numpy as np
import pytest

import nanorom
from nanorom.continuation import explore
from nanorom.errors import SceneError
from nanorom.verification.campaign import TAIL
from nanorom.verification.compare import VERIFIED
from nanorom.verification.driven import DrivenFilm
from nanorom.verification.newton import SOLVED
from nanorom.verification.orbit import full_orbit
from nanorom.verification.problem import pose
from nanorom.verification.symmetry import Classes, images
from tests.verification.conftest import DENSITY, NU, RADIUS, THICKNESS, YOUNG, drum
from tests.verification.radial_orbits import Drum

SPECTRAL = 5e-6  # of an amplitude; the film's mesh is made for 1e-5
ROUND_OFF = 1e-9
TWO_MESHES = 1e-5
TAILS = 1e-6  # of the largest amplitude: as a verification solves for it
TENSION = 0.3


@pytest.mark.parametrize("model", ["membrane", "plate"])
def test_orbit_of_a_drum_is_that_of_a_spectral_method_in_the_radius(model):
    scene = drum(
        [1],
        model=model,
        tension=(TENSION, TENSION),
        quality=50.0,
        drive=nanorom.Drive(1.0),
        sweep=nanorom.Sweep("0.8 f1", "1.2 f1"),
    )
    reduced = nanorom.reduce(scene)
    first, pressure = 2 * np.pi * reduced.frequency[0], 1500.0
    diagram = explore(reduced.system(), omega=(0.9 * first, 1.2 * first), direct=pressure)
    orbit = diagram.branches[0].orbit(-1)
    found = nanorom.full_orbit(scene, orbit, direct=pressure)
    other = scene.with_(degree=6, mesh_size=0.3 * RADIUS)
    finer = nanorom.full_orbit(other, orbit, direct=pressure)
    stretch = YOUNG * THICKNESS
    bending = 0 if model == "membrane" else (THICKNESS / RADIUS) ** 2 / (12 * (1 - NU**2))
    time = RADIUS * np.sqrt(DENSITY * THICKNESS / stretch)
    exact = Drum(TENSION / stretch, bending, NU, 50.0).orbit(
        orbit.omega * time, pressure * RADIUS / stretch, orbit.coefficients / RADIUS
    )
    assert found.residual <= SOLVED
    assert found.amplitude[0] == pytest.approx(RADIUS * exact[0], rel=SPECTRAL)
    f02 = found.outside_amplitude[found.outside_label.index("f02")]
    assert f02 == pytest.approx(RADIUS * exact[1], rel=10 * SPECTRAL)
    assert finer.problem.equations.size != found.problem.equations.size
    assert finer.amplitude[0] == pytest.approx(found.amplitude[0], rel=TWO_MESHES)
    modal = nanorom.continuation.orbits.orbit.orbit_amplitudes(orbit.coefficients[None])[0]
    assert abs(modal[0] / found.amplitude[0] - 1) > 100 * SPECTRAL  # there is something to find


def test_pressure_drives_a_quarter_of_the_drum_alone(doubled):
    drive = nanorom.Drive(1.0)
    film = doubled.film
    shape = doubled.orbit.coefficients.copy()
    labels = doubled.model.label
    shape[:, [labels.index(m) for m in labels if m[-1] == "s" or m[1] in "13"]] = 0.0
    orbit = nanorom.continuation.orbits.orbit.PeriodicOrbit(shape, doubled.orbit.omega, 2)
    problem = pose(DrivenFilm(film, drive, 1.0, 0.0), orbit)
    assert problem.equations.classes.deflections == ((0, 0),)
    assert pose(doubled.driven, doubled.orbit).equations.classes.count == 4


def test_film_s_force_on_its_modes_is_that_of_the_tensors(doubled):
    problem = pose(doubled.driven, doubled.orbit)
    equations, model = problem.equations, problem.model
    samples = equations.parts(problem.start @ equations.synthesis)
    force = np.concatenate(equations.film.force(equations.classes, samples)[0])
    modal = model.project(force, momenta=False)
    q = model.project(problem.start, momenta=True) @ equations.synthesis
    scaled = model.scaled
    unit = scaled.frequency**2 / scaled.amplitude**2
    expected = unit * np.einsum("rjkl,jt,kt,lt->rt", scaled.cubic, q, q, q, optimize=True)
    assert np.abs(modal - expected).max() < ROUND_OFF * np.abs(expected).max()


def test_tangent_is_the_derivative_of_the_residual(doubled):
    equations = pose(doubled.driven, doubled.orbit).equations
    rng = np.random.default_rng(7)
    x, change = rng.standard_normal((2, equations.size, doubled.orbit.harmonics * 2 + 1)) * 0.1
    _, state = equations.residual(x, 1.1)
    step = 1e-4
    ahead, behind = (equations.residual(x + s * change, 1.1)[0] for s in (step, -step))
    along = equations.along(state, change, 1.1)
    # a cubic force: the difference is wrong by step^2 of its third derivative
    assert np.abs((ahead - behind) / (2 * step) - along).max() < 1e-6 * np.abs(along).max()


def test_modal_orbits_converge_to_the_film_s_with_the_number_of_modes(doubled):
    """Eleven modes miss f22c, which the film has three times as large as they have f41c."""
    film = doubled.film
    found = full_orbit(doubled.scene, doubled.orbit, doubled.direct, doubled.parametric, film=film)
    assert found.residual <= SOLVED
    label = doubled.model.label
    f41c = label.index("f41c")
    f22c = found.outside_amplitude[found.outside_label.index("f22c")]
    assert 0.35 < found.amplitude[f41c] / doubled.amplitude[f41c] < 0.45
    assert f22c > 2.5 * found.amplitude[f41c]


def test_transform_of_classes_multiplies_fields_as_signs_do():
    rng = np.random.default_rng(3)
    classes = Classes.spanned([(0, 1), (1, 0)])
    first, second = rng.standard_normal((2, classes.count, 5))
    product = images(images(first) * images(second)) / classes.count
    for i, strain in enumerate(classes.strains):
        expected = sum(
            first[a] * second[b]
            for a, p in enumerate(classes.deflections)
            for b, q in enumerate(classes.deflections)
            if tuple(x ^ y for x, y in zip(p, q)) == strain
        )
        assert np.allclose(product[i], expected)


def test_orbit_of_another_model_is_refused(doubled):
    with pytest.raises(SceneError, match="11"):
        wrong = nanorom.continuation.orbits.orbit.PeriodicOrbit(np.zeros((3, 4)), 1.0)
        nanorom.full_orbit(doubled.scene, wrong, direct=1.0)


def test_harmonics_below_a_part_in_ten_million_do_not_change_the_film_s_orbit(doubled):
    """A verification leaves them out: half as many unknowns, and fewer modes near resonance."""
    short = doubled.orbit.without_tail(TAIL)
    assert short.harmonics < 0.7 * doubled.orbit.harmonics
    given = {"direct": doubled.direct, "parametric": doubled.parametric, "film": doubled.film}
    one, other = (
        full_orbit(doubled.scene, orbit, tolerance=VERIFIED, **given)
        for orbit in (short, doubled.orbit)
    )
    assert one.amplitude == pytest.approx(other.amplitude, abs=TAILS * other.amplitude.max())
    assert one.outside_amplitude == pytest.approx(
        other.outside_amplitude, abs=TAILS * other.amplitude.max()
    )


def test_tail_of_an_orbit_leaves_what_a_cubic_makes_of_the_drive():
    coefficients = np.zeros((41, 2))
    coefficients[[3, 15, 30]] = [[1.0, 0.0], [1e-3, 0.0], [0.0, 1e-9]]
    orbit = nanorom.continuation.PeriodicOrbit(coefficients, 1.0, 2)
    assert [orbit.without_tail(s).harmonics for s in (1e-10, 1e-7, 1e-2)] == [15, 8, 6]
