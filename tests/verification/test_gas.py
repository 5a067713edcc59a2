"""Orbits of films over a gap, whose gas answers each harmonic by Reynolds' equation there."""

import numpy as np
import pytest

import nanorom
from nanorom.continuation import FirstOrder, ModalSystem, explore
from nanorom.continuation.orbits.orbit import PeriodicOrbit
from nanorom.verification.assemble import assemble
from nanorom.verification.driven import DrivenFilm
from nanorom.verification.problem import pose
from tests.verification.test_drives import terms

SIDE, THICKNESS, DENSITY, TENSION = 20e-6, 50e-9, 3100.0, 10.0
PRESSURE, GAP = 1e4, 300e-9
SMALL = 1e-3  # Pa
CLOSED = 1e-6  # of an amplitude
QUALITY = 50.0
POISSON = 0.03514425  # mean of w with -lap w = 1 in the unit square (torsion constant 0.140577 / 4)
STRONG = 1e4  # Pa
MANY = 3e-3  # of an amplitude: what modes beyond the eleventh change
TONES = [
    nanorom.Harmonic(1, direct=1.0),
    nanorom.Harmonic(2, direct=0.7, phase=0.5),
    nanorom.Harmonic(4, direct=0.6, phase=-1.0),
]


def gas(edge="open"):
    return nanorom.Gas(pressure=PRESSURE, gap=GAP, edge=edge)


def square(gas, drive, modes=(1,)):
    return nanorom.Scene(
        geometry=nanorom.Rectangle(SIDE, SIDE),
        plate=nanorom.Plate(THICKNESS, "membrane"),
        material=nanorom.Material(250e9, 0.23, DENSITY),
        tension=nanorom.Tension(TENSION, TENSION),
        support=nanorom.Support("clamped"),
        modes=nanorom.Modes(select=modes),
        damping=nanorom.Damping(QUALITY),
        gas=gas,
        drive=drive,
        sweep=nanorom.Sweep("0.5 f1", "1.2 f1"),
    )


def test_open_gap_answers_each_harmonic_as_in_closed_form():
    """Modes of a square membrane are shapes of the Laplacian: p = i s phi/(2 pi^2 + i s) of f11."""
    scene = square(gas(), nanorom.Drive(SMALL, harmonics=TONES))
    film = assemble(scene, 2)
    wave = 2 * (np.pi / SIDE) ** 2
    area = DENSITY * THICKNESS
    omega = 0.6 * np.sqrt(wave * TENSION / area)
    orbit = PeriodicOrbit(np.zeros((7, 1)), omega)
    found = terms(nanorom.full_orbit(scene, orbit, film=film).modal.coefficients[:, 0])
    first = film.natural[0] / film.units.time
    drag = nanorom.reduce(scene).losses["gas"][0]  # of the side without a gap
    expected = np.zeros(5, complex)
    for each in TONES:
        turn = each.harmonic * omega
        sigma = 1j * scene.gas.squeeze_number(turn, SIDE)
        stiffness = wave * TENSION + PRESSURE / GAP * sigma / (2 * np.pi**2 + sigma)
        damping = area * first * (1 / QUALITY + drag)
        force = SMALL * 16 / np.pi**2 * each.direct * np.exp(1j * each.phase)
        expected[each.harmonic] = force / (stiffness - area * turn**2 + 1j * turn * damping)
    assert found[:5] == pytest.approx(expected, abs=CLOSED * np.abs(expected).max())


def test_gas_that_cannot_flow_out_answers_a_constant_force_by_its_volume():
    """-T lap w = F - P/g mean(w): w is that of a pressure alone, 0.0351443 a^2 F/T in the mean."""
    still = [nanorom.Harmonic(0, direct=1.0)]
    found = []
    for below in (gas("sealed"), None):
        scene = square(below, nanorom.Drive(SMALL, harmonics=still))
        orbit = nanorom.full_orbit(scene, PeriodicOrbit(np.zeros((3, 1)), 1e6))
        found.append(orbit.modal.coefficients[0, 0])
    softer = POISSON * SIDE**2 / TENSION * PRESSURE / GAP
    assert found[0] / found[1] == pytest.approx(1 / (1 + softer), rel=CLOSED)


def test_derivative_by_the_rate_is_that_of_the_residual():
    drive = nanorom.Drive(1.0)
    scene = square(gas("sealed"), drive, [1, 2, 3])
    orbit = PeriodicOrbit(1e-8 * np.random.default_rng(5).standard_normal((7, 3)), 1e7)
    problem = pose(DrivenFilm(assemble(scene, 2), drive, 1.0, 0.0), orbit)
    equations = problem.equations
    x, rate, step = problem.start, problem.rate, 1e-4 * problem.rate
    ahead, behind = (equations.residual(x, rate + s)[0] for s in (step, -step))
    slope = equations.by_rate(x, rate)
    assert np.abs((ahead - behind) / (2 * step) - slope).max() < 1e-6 * np.abs(slope).max()


def test_strong_motion_is_that_of_many_modes_each_with_a_pressure_of_its_own():
    """s' = -mu/S (s + q) with p = q + s: the shapes of a square membrane are those of its gas."""
    drive = nanorom.Drive(STRONG)
    scene = square(None, drive, [1, 5, 6, 11])
    model = nanorom.reduce(scene)
    below, first = gas(), 2 * np.pi * model.frequency[0]
    slow = below.squeeze_number(1.0, 1.0)
    waves = model.stiffness.diagonal() / model.mass * DENSITY * THICKNESS / TENSION
    area = model.mass / (DENSITY * THICKNESS) * PRESSURE / GAP
    states = FirstOrder(np.diag(waves / slow), -np.diag(waves / slow), None, -np.diag(area))
    wet = scene.with_(gas=below)
    film = assemble(wet, 4)
    system = ModalSystem(
        mass=model.mass,
        damping=model.mass * film.rates[film.inside] / film.units.time,
        stiffness=model.stiffness + np.diag(area),
        cubic=model.cubic,
        direct=model.drive["pressure"],
        states=states,
    )
    diagram = explore(system, omega=(first, 1.1 * first), direct=STRONG)
    orbit = diagram.branches[0].orbit(-1)
    modal = PeriodicOrbit(orbit.coefficients[:, : model.size], orbit.omega)
    found, dry = (
        nanorom.full_orbit(of, modal, film=made) for of, made in ((wet, film), (scene, None))
    )
    wrong = np.abs(found.modal.coefficients - modal.coefficients).max()
    print(wrong / found.amplitude[0], found.amplitude[0], dry.amplitude[0], found.evaluations)
    assert wrong < MANY * found.amplitude[0] < 0.1 * abs(dry.amplitude[0] - found.amplitude[0])
