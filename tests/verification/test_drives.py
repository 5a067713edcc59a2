"""The film's orbits under several harmonics of one drive, by independent solutions."""

import numpy as np
import pytest

import nanorom
from nanorom.continuation import explore
from nanorom.continuation.orbits.orbit import PeriodicOrbit
from nanorom.rom.patterns import driven
from nanorom.verification.assemble import assemble
from tests.verification.conftest import drum
from tests.verification.test_beams import beam

SMALL = 1e-3  # Pa: 1e-8 of what bends the film by its thickness
SAME = 2e-6  # of an amplitude: frequencies of the model and the film, each to 1e-6 and better
CONVERGED = 5e-4  # of an amplitude, of the model with f03; .0079 are those of f01 alone
SWEEP = nanorom.Sweep("0.8 f1", "1.2 f1")
SEVERAL = [
    nanorom.Harmonic(0, direct=0.4),
    nanorom.Harmonic(1, direct=1.0, phase=0.3),
    nanorom.Harmonic(5, direct=-0.7, phase="100 deg"),
]
PUMPED = [nanorom.Harmonic(1, direct=1.0), nanorom.Harmonic(2, parametric=1.0, phase=0.8)]
QUALITY, SHARE, PUMP = 180.0, 0.8, 0.9998  # f/Q; of the threshold of parametric resonance; of f1


def at_rest(film, omega, harmonics=3):
    return PeriodicOrbit(np.zeros((2 * harmonics + 1, len(film.inside))), omega)


def terms(coefficients):
    """Complex amplitudes (H + 1,) by harmonic of real coefficients (2H + 1,)."""
    return np.append(coefficients[0], coefficients[1::2] - 1j * coefficients[2::2])


@pytest.mark.parametrize("scene", [drum(1), beam("clamped").with_(modes=1)], ids=["drum", "beam"])
def test_weak_harmonics_superpose(scene):
    drive = nanorom.Drive(SMALL, harmonics=SEVERAL)
    film = assemble(scene.with_(drive=drive, sweep=SWEEP, damping=nanorom.Damping(QUALITY)), 2)
    model = nanorom.reduce(film.scene)
    first = 2 * np.pi * model.frequency[0]
    omega = 0.93 * first
    found = nanorom.full_orbit(film.scene, at_rest(film, omega), film=film)
    expected = np.zeros(6, complex)
    for each in SEVERAL:
        turn = each.harmonic * omega
        force = SMALL * model.drive["pressure"][0] / model.mass[0]
        answer = force / (first**2 - turn**2 + 1j * turn * first / QUALITY)
        expected[each.harmonic] = each.direct * np.exp(1j * each.phase) * answer
    amplitudes = terms(found.modal.coefficients[:, 0])
    assert amplitudes == pytest.approx(expected, abs=SAME * np.abs(expected).max())
    assert found.modal.harmonics == 5  # the orbit that it started from had three


def test_pump_at_twice_the_frequency_amplifies_by_its_phase():
    """Against the harmonics of one mode, q'' + c q' + (1 + p cos(2 t + phase)) q = f cos t."""
    drive = nanorom.Drive(SMALL, 1.0, harmonics=PUMPED)
    scene = drum(1, tension=(0.3, 0.3), quality=QUALITY, drive=drive, sweep=SWEEP)
    model = nanorom.reduce(scene)
    first = 2 * np.pi * model.frequency[0]
    omega = PUMP * first
    mass, stretch = model.mass[0], model.parametric["tension"][0, 0]
    level = SHARE * 2 * model.stiffness[0, 0] / (QUALITY * abs(stretch))
    found = nanorom.full_orbit(scene, at_rest(assemble(scene, 2), omega), SMALL, level)
    numbers = np.array([-3, -1, 1, 3])
    matrix = np.diag(first**2 - (numbers * omega) ** 2 + 1j * numbers * omega * first / QUALITY)
    pump = -0.5 * level * stretch / mass * np.exp(0.8j * np.ones(3))
    matrix = matrix + np.diag(pump, -1) + np.diag(pump.conj(), 1)
    force = SMALL * model.drive["pressure"][0] / mass
    answer = np.linalg.solve(matrix, 0.5 * force * np.array([0, 1, 1, 0]))
    amplitudes = terms(found.modal.coefficients[:, 0])
    assert amplitudes[1] == pytest.approx(2 * answer[2], rel=SAME)


def test_models_of_more_modes_go_to_the_film_s_orbit_under_two_tones():
    tones = [nanorom.Harmonic(1, direct=1.0), nanorom.Harmonic(2, direct=0.6, phase=1.0)]
    drive = nanorom.Drive(1500.0, harmonics=tones)
    whole = drum(8, tension=(0.3, 0.3), quality=50.0, drive=drive, sweep=SWEEP)
    errors = []
    for numbers in ([1], [1, 6], [1, 6, 15]):
        scene = whole.with_(modes=nanorom.Modes(select=numbers))
        model = nanorom.reduce(scene)
        first = 2 * np.pi * model.frequency[0]
        system = driven(model, drive)
        diagram = explore(system, omega=(0.9 * first, 1.1 * first), direct=1500.0)
        orbit = diagram.branches[0].orbit(-1)
        film = nanorom.full_orbit(scene, orbit)
        wrong = np.abs(orbit.coefficients - film.modal.coefficients).max(axis=0)
        errors.append(wrong[0] / film.amplitude[0])
    assert errors == sorted(errors, reverse=True) and errors[2] < CONVERGED
