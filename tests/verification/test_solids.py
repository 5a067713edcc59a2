"""Orbits and manifolds of all of a solid: its forces, its loads, and those of the beam it is."""

from pathlib import Path

import attrs
import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import nanorom
from nanorom.continuation import explore
from nanorom.fem.output.solid import SolidWork, drawn
from nanorom.scene.patterns.pattern import VirtualWork
from nanorom.verification.assemble import assemble
from nanorom.verification.newton import SOLVED
from nanorom.verification.whole import ONLY

LENGTH, WIDTH, THICKNESS = 1e-3, 24e-6, 1e-5  # of a published clamped beam, MORFE and SSMTool
QUALITY = 200.0
AMPLITUDE = 0.25756 * THICKNESS
PUBLISHED = 1.018217 - 1.0  # its hardening at that amplitude, of order three
SHARE = 3e-3  # of it: a solid is stiffer across than a beam, and its mesh than a fine one
DRAWN = 2e-3  # of a force at a point: drawn shapes are linear between points
ROUND_OFF = 1e-12
RELAXED = 1e-9  # of the largest entry: two factorisations
MESHES = Path(__file__).parents[2] / "meshes"
ORBITS = 2e-4  # of an amplitude: what a manifold's first order in the level leaves out


def solid_beam(**sections):
    ends = {"left": "clamped", "right": "clamped", "bottom": "free", "top": "free"}
    given = {
        "geometry": nanorom.Rectangle(LENGTH, WIDTH),
        "plate": nanorom.Plate(THICKNESS, "solid"),
        "material": nanorom.Material(160e9, 0.22, 2320),
        "tension": nanorom.Tension(0.0, 0.0),
        "support": nanorom.Support(ends),
        "modes": nanorom.Modes(1),
        "damping": nanorom.Damping(QUALITY),
        "accuracy": nanorom.Accuracy(degree=4, mesh_size=1.6e-4),
    }
    return nanorom.Scene(**(given | sections))


@pytest.fixture(scope="module")
def film():
    drive = nanorom.Drive(1.0, direct_pattern="pressure")
    scene = solid_beam(drive=drive, sweep=nanorom.Sweep("0.9 f1", "1.1 f1"))
    return assemble(scene, 3)


def test_forces_of_a_solid_together_are_those_one_by_one(film):
    system = film.discrete.system
    u, v = np.random.default_rng(1).standard_normal((2, system.size, 2)) / 100
    whole = system.quadratic(u, u) + system.cubic(u, u, u)
    assert np.abs(system.force(u) - whole).max() < ROUND_OFF * np.abs(whole).max()
    slope = 2 * system.quadratic(u, v) + 3 * system.cubic(u, u, v)
    assert np.abs(system.along(u, v) - slope).max() < ROUND_OFF * np.abs(slope).max()


def _on_modes(film: nanorom.verification.solid.SolidFilm) -> VirtualWork:
    modes, length, scene = film.modes, film.units.deflection, film.scene
    return SolidWork(modes, drawn(modes, length), length, scene.material.density, THICKNESS, [0])


def test_forces_on_all_of_a_solid_do_the_work_that_they_do_on_its_modes(film):
    modal, whole = _on_modes(film), film.work
    places, weights = np.array([[1e-4, 2e-6], [-3.1e-4, -5e-6]]), np.array([1.0, -0.4])
    spot = nanorom.Drive(
        1.0, direct_pattern="spot", position=["-0.2 mm", "2 um"], radius="50 um"
    ).pattern
    shapes = film.modes.shapes
    for expected, found, within in (
        (modal.uniform(2.0), whole.uniform(2.0), ROUND_OFF),
        (modal.inertia(3.0), whole.inertia(3.0), ROUND_OFF),
        (modal.areal(spot), whole.areal(spot), ROUND_OFF),
        (modal.points(places, weights, ""), whole.points(places, weights, ""), DRAWN),
    ):
        assert found[ONLY] @ shapes == pytest.approx(expected, abs=within * np.abs(expected).max())
    pulled = -shapes.T @ (whole.stretch(0.5)(ONLY) @ shapes)
    expected = modal.stretch(0.5)
    assert np.abs(pulled - expected).max() < ROUND_OFF * np.abs(expected).max()


@pytest.fixture(scope="module")
def reduced(film):
    return {order: nanorom.manifold(film.scene, [1], order) for order in (3, 7)}


def hardening(reduced):
    """Of the frequency where the middle moves by AMPLITUDE."""
    shapes = reduced.model.shapes
    middle = shapes.values[:, np.hypot(*shapes.points[:, :2].T).argmin()]
    q = AMPLITUDE
    for _ in range(6):
        motion = reduced.motions([q])[0]
        q *= AMPLITUDE / (np.abs(motion.q @ middle).max() * reduced.equations.amplitude)
    return reduced.backbone([q])[0][0] / (2 * np.pi * reduced.model.frequency[0]) - 1


def test_a_clamped_beam_of_solid_elements_stiffens_as_published(reduced):
    third, seventh = (hardening(reduced[order]) for order in (3, 7))
    assert third == pytest.approx(PUBLISHED, rel=SHARE)
    assert seventh == pytest.approx(0.01770, rel=SHARE)  # of the beam's model with all its modes


def test_driven_motions_on_a_solid_s_manifold_are_the_solid_s_own(film, reduced):
    whole, model = reduced[7], nanorom.reduce(film.scene)
    first = 2 * np.pi * model.frequency[0]
    level = AMPLITUDE * model.stiffness[0, 0] / (QUALITY * abs(model.drive["pressure"][0]))
    modal = explore(model.system("pressure", "tension"), (0.97 * first, 1.03 * first), level)
    branch = modal.branches[0]
    start = branch.orbit(int(np.argmax(branch.amplitude[:, 0])) - 3)
    known = nanorom.full_orbit(film.scene, start, level, film=film)
    assert known.residual <= SOLVED
    response = whole.response((0.97 * first, 1.03 * first), direct=level, largest_step=0.003)
    rising = slice(0, int(np.argmax(response.amplitude[:, 0])))
    own = CubicSpline(response.omega[rising], response.amplitude[rising, 0])(known.omega)
    assert own == pytest.approx(known.amplitude[0], rel=ORBITS)


def test_a_modulated_stress_that_relaxes_in_a_file_s_solid_pulls_alike():
    sizes = {"rise": 0.006, "thickness": 0.01, "width": 0.05, "size": 0.1}
    arch = solid_beam(
        geometry=nanorom.MeshFile(MESHES / "arch.geo", scale=640e-6, parameters=sizes),
        plate=nanorom.Plate(6.4e-6, "solid"),
        support=nanorom.Support({"ends": "clamped"}),
        accuracy=nanorom.Accuracy(degree=2, mesh_size=60e-6),
    )
    film = assemble(arch, 2)
    shapes = film.modes.shapes
    modal = attrs.evolve(_on_modes(film), thickness=6.4e-6, along=[]).stretch(0.5)
    whole = -shapes.T @ (film.work.stretch(0.5)(ONLY) @ shapes)
    assert np.abs(whole - modal).max() < RELAXED * np.abs(modal).max()
