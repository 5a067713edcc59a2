"""Every listed special point is found at default settings, and every reported one stands up to time
integration.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nanorom.continuation import Diagram, ModalSystem, explore
from tests.continuation.systems import REFERENCE, from_monomials

FREQUENCY_TOLERANCE = 1e-8
MULTIPLIER_TOLERANCE = 1e-6
CONFIRMATION = 1e-7
CLOSURE = 1e-8


def _levels(key: str) -> tuple[float, float]:
    case = key.split()[1]
    direct = float(case.split("_b")[1].split("_")[0])
    return direct, float(case.split("_g")[1]) if "_g" in case else 0.0


@pytest.fixture(scope="module")
def diagrams() -> dict[str, tuple[ModalSystem, Diagram]]:
    result = {}
    for key, omega in REFERENCE["ranges"].items():
        system = from_monomials(key.split()[0])
        direct, parametric = _levels(key)
        result[key] = system, explore(system, tuple(omega), direct=direct, parametric=parametric)
    return result


@pytest.mark.parametrize(
    "point",
    REFERENCE["points"],
    ids=lambda p: f"{p['system']}-{p['case']}-{p['type']}-{p['W']:.4f}",
)
def test_listed_point_is_found(point, diagrams) -> None:
    diagram = diagrams[f"{point['system']} {point['case']}"][1]
    found = [
        p for p in diagram.points(point["type"]) if abs(p.omega - point["W"]) < FREQUENCY_TOLERANCE
    ]
    assert len(found) == 1
    expected = np.array([complex(*m) for m in point["multipliers"]])
    gaps = np.abs(found[0].multipliers[:, None] - expected).min(axis=0)
    assert gaps.max() < MULTIPLIER_TOLERANCE
    assert found[0].period_multiple == point["period_multiple"]
    # the largest excursion of the reference is sampled, not maximised
    np.testing.assert_allclose(found[0].amplitude, point["maxq"], rtol=1e-3)


@pytest.mark.parametrize("key", REFERENCE["ranges"])
def test_reported_points_are_real(key, diagrams) -> None:
    system, diagram = diagrams[key]
    direct, parametric = _levels(key)
    for point in diagram.special_points:
        end, monodromy = _integrate(
            system, point.omega, direct, parametric, point.state, point.period_multiple
        )
        assert np.abs(end - point.state).max() < CLOSURE
        multipliers = np.linalg.eigvals(monodromy)
        target = -1.0 if point.type == "PD" else 1.0
        assert np.abs(multipliers - target).min() < CONFIRMATION


def _integrate(
    system: ModalSystem,
    omega: float,
    direct: float,
    parametric: float,
    state: np.ndarray,
    multiple: int,
):
    """End state and monodromy matrix by DOP853, from the definition of the equations (unit
    mass).
    """
    size = system.size

    def right_side(t: float, y: np.ndarray) -> np.ndarray:
        q, v, z = y[:size], y[size : 2 * size], y[2 * size :].reshape(2 * size, 2 * size)
        drive = np.cos(omega * t)
        square = system.cubic @ q @ q
        force = (
            system.stiffness @ q
            + square @ q
            - (direct * system.direct + parametric * system.parametric @ q) * drive
        )
        tangent = system.stiffness + 3 * square - parametric * system.parametric * drive
        acceleration = -force - system.damping @ v
        return np.concatenate(
            [
                v,
                acceleration,
                z[size:].ravel(),
                (-tangent @ z[:size] - system.damping @ z[size:]).ravel(),
            ]
        )

    start = np.concatenate([state, np.eye(2 * size).ravel()])
    end = solve_ivp(
        right_side,
        (0, 2 * np.pi * multiple / omega),
        start,
        method="DOP853",
        rtol=1e-12,
        atol=1e-14,
    ).y[:, -1]
    return end[: 2 * size], end[2 * size :].reshape(2 * size, 2 * size)
