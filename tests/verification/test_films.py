"""The discretised film's force on its modes is that of the reduction's tensors, on every film."""

import numpy as np
import pytest

import nanorom
from nanorom.continuation.drive import CARRIER
from nanorom.continuation.orbits.orbit import PeriodicOrbit
from nanorom.errors import SceneError
from nanorom.verification.assemble import assemble
from nanorom.verification.driven import DrivenFilm
from nanorom.verification.problem import pose
from tests.verification.conftest import drum

ROUND_OFF = 1e-7  # of the largest force; linear stretching is a difference of large numbers
PARTS = [
    nanorom.DiscRegion(radius=0.8e-6, thickness=14e-9, youngs_modulus=300e9),
    nanorom.RingRegion(inner_radius=0.8e-6, radius=2e-6, density=4000.0, poisson_ratio=0.3),
]
DRIVE = {"drive": nanorom.Drive(1.0), "sweep": nanorom.Sweep("0.9 f1", "1.1 f1")}


def problem_of(scene, size):
    """A problem about an orbit of all the model's modes, of a size in m."""
    film = assemble(scene, more=2)
    rng = np.random.default_rng(11)
    orbit = PeriodicOrbit(size * rng.standard_normal((5, len(film.inside))), 1e8)
    return pose(DrivenFilm(film, scene.drive, 1.0, 1.0), orbit)


def modal_and_film_forces(problem):
    """Nonlinear forces (L, samples) by the film, and by the modal equations."""
    model, equations = problem.model, problem.equations
    viscous = equations.viscous(problem.rate)
    samples = problem.start @ equations.synthesis
    forces = equations.film.force(equations.classes, equations.parts(samples), viscous)[0]
    stiff = [d.stiffness @ w for d, w in zip(equations.dynamics, equations.parts(samples))]
    film = model.project(np.concatenate(forces) + np.concatenate(stiff), momenta=False)
    system, q = model.scaled, model.project(samples, momenta=True)
    frequency, amplitude = system.frequency, system.amplitude
    q = q / amplitude
    expected = system.stiffness @ q
    expected = expected + np.einsum("rjk,jt,kt->rt", system.quadratic, q, q)
    expected += np.einsum("rjkl,jt,kt,lt->rt", system.cubic, q, q, q, optimize=True)
    return film, expected * frequency**2 * amplitude


@pytest.mark.parametrize(
    ("model", "sections"),
    [
        ("membrane", {"load": nanorom.Load(pressure=2000.0)}),
        ("plate", {"load": nanorom.Load(pressure=5000.0)}),
        ("membrane", {"reduction": nanorom.Reduction(in_plane="fixed")}),
        ("membrane", {"regions": PARTS}),
        ("plate", {"regions": PARTS, "load": nanorom.Load(pressure=5000.0)}),
    ],
)
def test_film_s_force_is_that_of_the_tensors(model, sections):
    problem = problem_of(drum(4, model=model, **sections, **DRIVE), 3e-9)
    film, expected = modal_and_film_forces(problem)
    assert np.abs(film - expected).max() < ROUND_OFF * np.abs(expected).max()


@pytest.mark.parametrize("pattern", ["tension", "paper"])
def test_modulation_of_the_film_is_the_model_s_on_its_modes(pattern):
    drive = nanorom.Drive(1.0, 1.0, parametric_pattern=pattern)
    scene = drum(4, drive=drive, sweep=DRIVE["sweep"])
    model = nanorom.reduce(scene)
    driven = DrivenFilm(assemble(scene, more=2), drive, 1.0, 1.0)
    _, expected = model.patterns("pressure", pattern)
    scale, unit = driven.film.scale[:4], driven.film.units.deflection**2
    unit *= driven.film.scales.tension * driven.film.plate.mirrors.copies
    found = driven.system.parametric_drive[:4, :4, CARRIER] * unit / np.outer(scale, scale)
    assert found == pytest.approx(expected, abs=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize(
    "aim",
    [
        {"direct_pattern": "acceleration"},
        {
            "direct_pattern": "magnetomotive",
            "field": 0.3,
            "wire": [[-0.8e-6, 0.1e-6], [0.5e-6, 0.7e-6]],
        },
    ],
    ids=lambda aim: aim["direct_pattern"],
)
def test_force_on_the_film_is_the_model_s_on_its_modes(aim):
    drive = nanorom.Drive(1.0, **aim)
    scene = drum(4, drive=drive, sweep=DRIVE["sweep"])
    model = nanorom.reduce(scene)
    driven = DrivenFilm(assemble(scene, more=2), drive, 1.0, 0.0)
    expected = model.drive[aim["direct_pattern"]]
    film = driven.film
    unit = film.units.force * film.units.deflection * film.plate.mirrors.copies
    found = driven.system.direct_drive[:4, CARRIER] * unit / film.scale[:4]
    assert found == pytest.approx(expected, abs=1e-6 * np.abs(expected).max())


def test_film_without_damping_is_refused():
    scene = drum(2)
    with pytest.raises(SceneError, match="damping"):
        assemble(scene.with_(damping=None))


@pytest.mark.parametrize("model", ["membrane", "plate"])
def test_viscous_material_damps_the_film_as_it_damps_the_model(model):
    scene = drum(3, model=model, **DRIVE)
    scene = scene.with_(damping=nanorom.Damping(150.0, material_time=3e-11))
    problem = problem_of(scene, 3e-9)
    damping = [
        d.modes[:, :k].T @ d.damping(d.modes[:, :k])
        for d, k in zip(problem.equations.dynamics, problem.model.named)
    ]
    found = np.zeros((problem.model.size,) * 2)
    for first, block in zip(problem.model.offsets, damping):
        found[first : first + len(block), first : first + len(block)] = block
    expected = problem.model.scaled.damping * problem.model.scaled.frequency
    assert np.abs(found - expected).max() < ROUND_OFF * np.abs(expected).max()
