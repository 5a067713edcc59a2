"""Orbits of all of a shell: a thin flat one's are those of the plate, an arc's turn soft."""

import numpy as np
import pytest

import nanorom
from nanorom.continuation.drive import CARRIER
from nanorom.continuation.orbits.orbit import PeriodicOrbit
from nanorom.verification.assemble import assemble
from nanorom.verification.driven import DrivenFilm
from nanorom.verification.newton import SOLVED
from tests.fem.tensors.test_outside import arc

THIN = 2e-3  # what shear does to a plate of h/a = .014
PUBLISHED = 0.99145, 0.99396  # folds by f1; SSMTool, order 7, a mesh of flat triangles
MESH = 7e-4  # of a frequency: its mesh, not taken apart
SETTLED = 3e-4  # of a frequency: orders five and seven
SAME = 3e-5  # of an amplitude: the damping of what lies beyond depends on the highest mode named
FORCE = 10.0  # N, at a quarter of the length


def linear(film, level, share, harmonics=7):
    """The linear response (2H + 1, L) in m of a film's own modes, driven at a share of f1."""
    system = DrivenFilm(film, film.scene.drive, level, 0.0).system
    omega = share * np.sqrt(film.values[0])
    pushed, rates = system.direct_drive[film.inside, CARRIER], film.rates[film.inside]
    answer = pushed / (film.values[film.inside] - omega**2 + 1j * omega * rates)
    coefficients = np.zeros((2 * harmonics + 1, len(film.inside)))
    coefficients[1:3] = np.array([answer.real, -answer.imag]) * film.scale[film.inside]
    return PeriodicOrbit(coefficients, omega / film.units.time, 1)


def plate(model):
    return nanorom.Scene(
        geometry=nanorom.Rectangle(1.0, 0.7),
        plate=nanorom.Plate(0.01, model),
        material=nanorom.Material(70e9, 0.33, 2700),
        tension=nanorom.Tension(0.0, 0.0),
        support=nanorom.Support("clamped"),
        modes=nanorom.Modes(1),
        damping=nanorom.Damping(100.0),
        drive=nanorom.Drive(1.0),
        sweep=nanorom.Sweep("0.9 f1", "1.2 f1"),
        accuracy=nanorom.Accuracy(degree=6, mesh_size=0.5),
    )


def test_stretching_of_a_thin_flat_shell_is_that_of_the_plate():
    pressure, share = 30000.0, []
    for model in ("shell", "plate"):
        film = assemble(plate(model), 3)
        start = linear(film, pressure, 0.8)
        found = nanorom.full_orbit(film.scene, start, direct=pressure, film=film)
        assert found.residual <= SOLVED
        share.append(found.amplitude[0] / np.abs(start.coefficients[1:3, 0]).max())
    assert share[1] < 0.8  # not a linear motion
    assert share[0] == pytest.approx(share[1], rel=THIN)


def driven_arc(directory, modes):
    return arc(directory, "shell").with_(
        modes=modes,
        degree=5,
        damping=nanorom.Damping(250.0),
        drive=nanorom.Drive(FORCE, direct_pattern="point", position=["-0.5 m", "0 m"]),
        sweep=nanorom.Sweep("0.98 f1", "1.01 f1"),
    )


def test_orbit_of_an_arc_does_not_depend_on_the_modes_that_lead_to_it(tmp_path):
    found = []
    for modes in (3, 8):
        film = assemble(driven_arc(tmp_path, modes), 0)
        start = linear(film, FORCE, 0.99)
        found.append(nanorom.full_orbit(film.scene, start, direct=FORCE, film=film))
    few, more = found
    assert max(few.residual, more.residual) <= SOLVED
    assert more.amplitude[:3] == pytest.approx(few.amplitude, rel=SAME, abs=1e-9)
    # an orbit that follows the modes beyond linear motion: softer, so larger below resonance
    assert few.amplitude[0] > 1.01 * np.abs(linear(film, FORCE, 0.99).coefficients[1:3, 0]).max()


def test_a_shallow_arc_softens_on_the_manifold_of_one_mode_as_published(tmp_path):
    scene, folds = driven_arc(tmp_path, 2), []
    for order in (5, 7):
        reduced = nanorom.manifold(scene, [1], order)
        first = 2 * np.pi * reduced.model.frequency[0]
        found = reduced.response((0.96 * first, 1.02 * first), direct=FORCE)
        folds.append(sorted(point.omega / first for point in found.points("LP")))
    assert folds[1] == pytest.approx(PUBLISHED, abs=MESH)
    assert folds[0] == pytest.approx(folds[1], abs=SETTLED)
