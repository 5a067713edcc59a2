"""The parts against independent evaluations: residual, series, multipliers, shooting."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial.polynomial import polyval
from scipy.integrate import solve_ivp
from scipy.special import gamma

from nanorom.continuation.branches.rational import (
    denominator,
    multiplied,
    reach,
    real_roots,
)
from nanorom.continuation.branches.series import Series, SeriesExpansion
from nanorom.continuation.branches.trace import Tracer
from nanorom.continuation.orbits.balance import HarmonicBalance
from nanorom.continuation.orbits.floquet import FloquetSolver
from nanorom.continuation.orbits.harmonics import (
    basis_for,
    differentiate,
    forced_support,
    fourier_matrix,
    full_support,
)
from nanorom.continuation.orbits.orbit import Orbit
from nanorom.continuation.orbits.shooting import Shooting
from nanorom.continuation.settings import Settings
from nanorom.continuation.system import ModalSystem

ROUND_OFF = 1e-12
INTEGRATION = 1e-10
PAIRS = 1e-7  # of products of multipliers, the smallest 1e-15 of the largest


@pytest.fixture
def system():
    """Everything at once: quadratic and cubic force without potential, drives, nonlinear damping,
    full matrices.
    """
    random = np.random.default_rng(0)
    size = 3
    return ModalSystem(
        damping=0.1 * np.eye(size) + 0.01 * random.standard_normal((size, size)),
        stiffness=np.diag([1.0, 4.0, 9.0]) + 0.1 * random.standard_normal((size, size)),
        quadratic=0.3 * random.standard_normal((size,) * 3),
        cubic=random.standard_normal((size,) * 4),
        direct=[1.0, 0.5, 0.2],
        parametric=random.standard_normal((size, size)),
        cubic_damping=random.standard_normal((size,) * 4),
    )


def _force(system: ModalSystem, q, v):
    """Force (n, L) from the definition, with Kelvin-Voigt term D q_l d(q_j q_k)/dt."""
    return (
        v @ system.damping.T
        + q @ system.stiffness.T
        + np.einsum("rjk,nj,nk->nr", system.quadratic, q, q)
        + np.einsum("rjkl,nj,nk,nl->nr", system.cubic, q, q, q)
        + np.einsum("rjkl,nl,nj,nk->nr", system.cubic_damping, q, v, q)
        + np.einsum("rjkl,nl,nj,nk->nr", system.cubic_damping, q, q, v)
    )


def test_harmonic_balance_is_exact_for_the_polynomial_force(system) -> None:
    scaled = system.scaled(0.1, 0.2)
    unit, rate = scaled.amplitude, 0.7
    basis = basis_for(full_support(scaled, 2), 5, 2)
    x = 0.2 * np.random.default_rng(1).standard_normal(basis.shape)
    residual = HarmonicBalance(scaled, basis).residual(x, rate)
    angles = 2 * np.pi / 400 * np.arange(400)
    table = fourier_matrix(angles, 5)
    physical = rate * scaled.frequency
    q, v = unit * table @ x, unit * physical * table @ differentiate(x)
    a = unit * physical**2 * table @ differentiate(differentiate(x))
    drive = np.cos(2 * angles)[:, None] * (0.1 * system.direct + 0.2 * q @ system.parametric.T)
    total = a + _force(system, q, v) - drive
    projected = 2 / 400 * table.T @ total
    projected[0] /= 2
    np.testing.assert_allclose(
        residual * unit * scaled.frequency**2, projected, atol=1e3 * ROUND_OFF
    )


def test_jacobian_is_the_derivative_of_the_residual(system) -> None:
    scaled = system.scaled(0.1, 0.2)
    balance = HarmonicBalance(scaled, basis_for(full_support(scaled, 2), 4, 2))
    random = np.random.default_rng(2)
    x, direction = 0.1 * random.standard_normal((2,) + balance.basis.shape)
    h = 1e-4

    def along(t: float):
        return balance.basis.pack(balance.residual(x + t * direction, 0.7))

    # a cubic: this difference formula is exact
    numerical = (8 * (along(h) - along(-h)) - (along(2 * h) - along(-2 * h))) / (12 * h)
    exact = balance.basis.pack(direction) @ balance.jacobian_t(x, 0.7)
    np.testing.assert_allclose(exact, numerical, atol=1e-9)


def _orbit(scaled, support, multiple):
    tracer = Tracer(scaled, support, multiple, Settings(tolerance=1e-13))

    def fixed_rate(balance):
        return np.append(np.zeros(balance.basis.size), 1.0)

    start = Orbit(np.zeros((8 * multiple + 1, scaled.size)), 0.7, multiple)
    return tracer, *tracer.solve(start, fixed_rate)


def test_series_solves_the_equations_to_the_truncation_error(system) -> None:
    scaled = system.scaled(0.1, 0.2)
    tracer, orbit, balance = _orbit(scaled, full_support(scaled, 1), 1)
    x = balance.basis.compress(orbit.coefficients)
    border = np.append(np.zeros(balance.basis.size), 1.0)
    errors = []
    packed, rates = SeriesExpansion(balance, 8).expand(
        balance, x, orbit.rate, balance.factorise(x, orbit.rate, border)
    )
    for a in (0.01, 0.02):
        weights = a ** np.arange(9)
        errors.append(
            np.abs(balance.residual(balance.basis.unpack(weights @ packed), weights @ rates)).max()
        )
    assert 8 < np.log2(errors[1] / errors[0]) < 10  # order 9


@pytest.mark.parametrize("symmetric", [False, True])
def test_monodromy_agrees_with_time_integration_and_with_shooting(system, symmetric) -> None:
    if symmetric:
        system = ModalSystem(
            damping=np.diag(np.diag(system.damping)),
            stiffness=[1.0, 4.0, 9.0],
            cubic=system.cubic,
            direct=[1, 2, 3],
        )
    scaled = system.scaled(0.1, 0.0 if symmetric else 0.2)
    support = forced_support(scaled)
    assert support.symmetric == symmetric
    tracer, orbit, _ = _orbit(scaled, support, 1)
    size, period = scaled.size, 2 * np.pi / orbit.rate
    harmonics = (len(orbit.coefficients) - 1) // 2

    def right_side(t, y):
        table = fourier_matrix(np.array(orbit.rate * t), harmonics)
        q, v = table @ orbit.coefficients, orbit.rate * (table @ differentiate(orbit.coefficients))
        z = y.reshape(2 * size, 2 * size)
        tangent = scaled.stiffness + 2 * scaled.quadratic @ q + 3 * scaled.cubic @ q @ q
        tangent = tangent - scaled.parametric[..., 1] * np.cos(orbit.rate * t)
        tangent = tangent + 2 * np.einsum("rkjl,l,k->rj", scaled.loss, q, v)
        damping = scaled.damping + scaled.loss @ q @ q
        return np.concatenate([z[size:], -tangent @ z[:size] - damping @ z[size:]]).ravel()

    start = np.eye(2 * size).ravel()
    expected = solve_ivp(right_side, (0, period), start, method="DOP853", rtol=1e-12, atol=1e-14).y[
        :, -1
    ]
    expected = expected.reshape(2 * size, 2 * size)
    found = FloquetSolver(scaled).monodromy(
        orbit.coefficients[None], np.array([orbit.rate]), 1, support
    )[0][0]
    if symmetric:
        found = found @ found
    np.testing.assert_allclose(found, expected, atol=INTEGRATION)
    shot = Shooting(scaled).check(orbit)
    assert shot.defect < ROUND_OFF
    np.testing.assert_allclose(shot.monodromy, expected, atol=INTEGRATION)


@pytest.mark.parametrize("rate", [0.31, 0.1])
def test_multipliers_of_strongly_unstable_orbits_are_right_to_the_smallest(rate) -> None:
    """With damping c for all modes the motion is symplectic but for a factor: multipliers come in
    pairs with product exp(-c T), whatever the sizes. A matrix of 1e15 would hide all but one.
    """
    damping = 0.02
    scaled = ModalSystem(
        damping=[damping, damping],
        stiffness=[1.0, 5.0],
        direct=[1.0, 0.0],
        parametric=[[3.0, 0.5], [0.5, 9.0]],
    ).scaled(0.0, 1.0)
    expected = np.exp(-damping * 2 * np.pi / rate)
    rest = np.zeros((1, 3, 2))
    found = FloquetSolver(scaled).multipliers(rest, np.array([rate]), 1, full_support(scaled, 1))[0]
    shot = Shooting(scaled).check(Orbit(rest[0], rate, 1)).multipliers
    largest = np.abs(found).max()
    assert largest > 1e3 if rate > 0.2 else largest > 1e12
    for values in (found, shot):
        values = values[np.argsort(-np.abs(values))]
        np.testing.assert_allclose(values * values[::-1], expected, rtol=PAIRS)


def test_undriven_modes_cost_nothing() -> None:
    """A mode coupled only through even powers of itself stays at rest, and symmetric systems have
    odd harmonics.
    """
    cubic = np.zeros((2, 2, 2, 2))
    cubic[0, 0, 0, 0] = cubic[1, 1, 1, 1] = 1.0
    for r, j, k, l in [
        (0, 0, 1, 1),
        (0, 1, 0, 1),
        (0, 1, 1, 0),
        (1, 1, 0, 0),
        (1, 0, 1, 0),
        (1, 0, 0, 1),
    ]:
        cubic[r, j, k, l] = 0.5
    scaled = ModalSystem(
        damping=[0.01] * 2, stiffness=[1.0, 7.0], cubic=cubic, direct=[1.0, 0.0]
    ).scaled(0.1)
    assert forced_support(scaled).table.tolist() == [[False, True], [False, False]]


def test_quotient_of_a_resonance_is_right_beyond_the_radius_of_convergence() -> None:
    """Two resonances a hundredth from the real axis, one before and one behind the start."""
    poles = np.array([0.05 + 0.01j, -0.08 + 0.01j])
    weights = np.random.default_rng(4).standard_normal((100, 2)) @ np.array([[1, 2j], [1j, 1]])

    def exact(a: float) -> np.ndarray:
        return np.cos(a) + (weights / (poles - a)).real @ np.ones(2)

    order = np.arange(25)
    parts = weights[:, :, None] / poles[:, None] ** (order + 1)
    terms = parts.real.sum(axis=1).T
    terms += (np.where(order % 2, 0.0, (-1.0) ** (order // 2)) / gamma(order + 1))[:, None]
    below = denominator(terms)
    above = multiplied(below, terms)
    size, radius = np.abs(terms[0]).max(), np.abs(poles).min()
    plain = reach(terms, np.ones(1), 1e-10 * size)
    length = reach(above, below, 1e-10 * size)
    assert plain < 0.5 * radius < 1.4 * radius < length
    for a in (-0.9 * length, 0.5 * length, length):
        quotient = polyval(a, above) / polyval(a, below)
        assert np.abs(quotient - exact(a)).max() < 1e-9 * size


def test_noise_makes_no_pole_on_the_real_axis() -> None:
    order = np.arange(25)[:, None]
    terms = 0.5**order * np.random.default_rng(5).standard_normal((25, 100))
    inverse = np.roots(denominator(terms))
    near = np.abs(inverse.imag) < 1e-3 * np.abs(inverse)
    assert not near[np.abs(inverse) > 0.5].any()


def test_roots_of_a_polynomial_within_a_step() -> None:
    roots = [-1.0, 0.25, 0.25 + 1e-6, 2.0, 3.5]
    found = real_roots(np.poly(roots)[::-1], 2.0)
    np.testing.assert_allclose(found, roots[1:4], rtol=1e-6)
    assert real_roots(np.poly([-1.0, 3.0, 0.5 + 0.2j, 0.5 - 0.2j])[::-1].real, 2.0) == []


def test_step_the_other_way_round_is_the_same_step(system) -> None:
    scaled = system.scaled(0.1, 0.2)
    _, orbit, balance = _orbit(scaled, full_support(scaled, 1), 1)
    x = balance.basis.compress(orbit.coefficients)
    border = np.append(np.zeros(balance.basis.size), 1.0)
    terms = SeriesExpansion(balance).expand(
        balance, x, orbit.rate, balance.factorise(x, orbit.rate, border)
    )
    step = Series.from_terms(balance, *terms, 1e-9)
    back = step.reversed()
    assert (back.start, back.length) == (-step.length, 0.0)
    for a in (0.0, 0.3 * step.length, step.length):
        (here, rate), (there, other) = step.at(a), back.at(-a)
        np.testing.assert_allclose(here, there, atol=ROUND_OFF)
        assert rate == pytest.approx(other, rel=ROUND_OFF)
        assert step.rate_slope(a) == pytest.approx(-back.rate_slope(-a), rel=ROUND_OFF)
    middle = step.rate(0.4 * step.length)
    assert step.crossings(middle) == pytest.approx([0.4 * step.length])
    assert back.crossings(middle) == pytest.approx([-0.4 * step.length])


def test_a_motion_too_fast_for_all_segments_is_no_orbit_rather_than_a_crash() -> None:
    """1e6 times the amplitude at which a Duffing oscillator's cubic force equals its linear one."""
    scaled = ModalSystem(
        damping=[0.01], stiffness=[1.0], cubic=np.ones((1, 1, 1, 1)), direct=[1.0]
    ).scaled(0.1, 0.0)
    coefficients = np.array([[0.0], [1e6], [0.0]])
    assert not Shooting(scaled).check(Orbit(coefficients, 1.0, 1)).defect < 1.0
