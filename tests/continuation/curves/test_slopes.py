"""Derivatives of special points: exact scaling laws, and differences of diagrams."""

from __future__ import annotations

import numpy as np
import pytest

from nanorom.continuation import ModalSystem, explore, point_slopes
from nanorom.errors import ContinuationError
from tests.continuation.systems import duffing, from_monomials

EXACT = 1e-8  # relative
DIFFERENCE = 1e-6  # relative, of differences of fourth order
STEP = 1e-3


def p2_points(kind):
    system = from_monomials("p2")
    diagram = explore(system, (1.9, 2.5), direct=0.004, parametric=0.016, depth=0)
    return system, diagram.points(kind)[0], (0.004, 0.016)


def changed(system, change, factor, levels):
    """The system with arrays added, and its direct and parametric forces as patterns at level 1."""
    arrays = {name: getattr(system, name) for name in ("mass", "damping", "stiffness")}
    arrays |= {"quadratic": system.quadratic, "cubic": system.cubic}
    arrays |= {"direct": levels[0] * system.direct, "parametric": levels[1] * system.parametric}
    return ModalSystem(**{n: a + factor * change.get(n, 0.0) for n, a in arrays.items()})


def random_change(system, seed, levels):
    """Noise on every array, and on the forces that act; zeros stay, so that symmetries do."""
    rng = np.random.default_rng(seed)
    acting = {"direct": levels[0], "parametric": levels[1]}
    return {
        name: rng.uniform(-1, 1, array.shape) * acting.get(name, 1.0) * np.abs(array)
        for name in ("mass", "damping", "stiffness", "cubic", "direct", "parametric")
        for array in [getattr(system, name)]
    }


@pytest.mark.parametrize("kind", ["LP", "PD"])
def test_units_of_displacement_leave_frequencies_and_scale_amplitudes(kind) -> None:
    system, point, levels = p2_points(kind)
    change = {
        "cubic": 2 * system.cubic,
        "quadratic": system.quadratic,
        "direct": -levels[0] * system.direct,
    }
    (slope,) = point_slopes(system, point, *levels, [change])
    assert abs(slope.omega) < EXACT * point.omega
    np.testing.assert_allclose(slope.amplitude, -point.amplitude, rtol=EXACT)


@pytest.mark.parametrize("kind", ["LP", "PD"])
def test_units_of_time_and_of_mass_scale_frequencies(kind) -> None:
    system, point, levels = p2_points(kind)
    slower = {"mass": 2 * system.mass, "damping": system.damping}  # t -> t (1 + level)
    heavier = {name: getattr(system, name) for name in ("mass", "damping", "stiffness", "cubic")}
    heavier |= {"quadratic": system.quadratic}
    full = system.arrays()
    heavier |= {"direct": levels[0] * full["direct"], "parametric": levels[1] * full["parametric"]}
    by_time, by_mass = point_slopes(system, point, *levels, [slower, heavier])
    assert by_time.omega == pytest.approx(-point.omega, rel=EXACT)
    assert np.abs(by_time.amplitude).max() < EXACT * point.amplitude.max()
    assert abs(by_mass.omega) < EXACT * point.omega


@pytest.mark.parametrize(("kind", "seed"), [("LP", 7), ("PD", 8)])
def test_derivatives_are_those_of_diagrams_beside(kind, seed) -> None:
    """Of all arrays at once; each alone has its part of it."""
    system, point, levels = p2_points(kind)
    change = random_change(system, seed, levels)
    whole, *parts = point_slopes(
        system, point, *levels, [change, *({name: array} for name, array in change.items())]
    )
    assert sum(part.omega for part in parts) == pytest.approx(whole.omega, rel=EXACT)
    assert min(abs(part.omega) for part in parts) > 0

    def there(factor):
        moved = changed(system, change, factor, levels)
        span = point.omega - 0.03, point.omega + 0.03
        found = explore(moved, span, direct=1.0, parametric=1.0, depth=0).points(kind)
        near = min(found, key=lambda each: abs(each.omega - point.omega))
        return np.append(near.amplitude, near.omega)

    near, far = ((there(s) - there(-s)) / (2 * s) for s in (STEP, 2 * STEP))
    expected = (4 * near - far) / 3
    scale = np.append(np.full(system.size, point.amplitude.max()), point.omega)
    error = np.append(whole.amplitude, whole.omega) - expected
    assert np.abs(error / scale).max() < DIFFERENCE


def test_torus_points_have_derivatives_too() -> None:
    """The system of tori/test_families.py; by a stiffness and by what couples the modes."""
    quadratic = np.zeros((2, 2, 2))
    quadratic[0, 0, 1] = quadratic[0, 1, 0] = 0.5
    quadratic[1, 0, 0] = 1.0
    system = ModalSystem(
        damping=[0.005, 0.01], stiffness=[1.0, 4.0], quadratic=quadratic, direct=[1.0, 0.0]
    )
    levels, span = (0.01, 0.0), (0.98, 0.995)
    change = {"stiffness": np.diag([0.0, 0.1]), "quadratic": quadratic}
    point = explore(system, span, direct=levels[0], depth=0).points("NS")[0]
    (slope,) = point_slopes(system, point, *levels, [change])

    def there(factor):
        moved = changed(system, change, factor, levels)
        found = explore(moved, span, direct=1.0, parametric=1.0, depth=0).points("NS")
        return min((p.omega for p in found), key=lambda omega: abs(omega - point.omega))

    near, far = ((there(s) - there(-s)) / (2 * s) for s in (STEP, 2 * STEP))
    assert slope.omega == pytest.approx((4 * near - far) / 3, rel=DIFFERENCE)


def test_points_of_another_system_and_unknown_arrays_are_refused() -> None:
    system = duffing()
    fold = explore(system, (0.8, 1.5), direct=0.005).points("LP")[0]
    with pytest.raises(ContinuationError, match="springs"):
        point_slopes(system, fold, 0.005, 0.0, [{"springs": 1.0}])
    with pytest.raises(ContinuationError):
        point_slopes(system, fold, 0.05, 0.0, [{"stiffness": 1.0}])
    assert point_slopes(system, fold, 0.005, 0.0, []) == []
