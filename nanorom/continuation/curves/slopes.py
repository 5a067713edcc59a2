"""Derivatives of special points by the arrays of their system, by the implicit function theorem.

A special point solves the balance and its criticality (`points.critical`), F(z, level) = 0 with
z = (x, rate, ...); with an array that is added `level` times, dz/dlevel = -F_z^-1 F_level. F_z is
the same for all arrays and factorised once.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import reduce

import attrs
import numpy as np
from scipy.linalg import lu_factor, lu_solve

from nanorom.continuation.arrays import square
from nanorom.continuation.curves.critical_curve import CriticalCurve
from nanorom.continuation.curves.curve import Point
from nanorom.continuation.diagrams.diagram import SpecialPoint
from nanorom.continuation.orbits.bifurcations import KINDS
from nanorom.continuation.orbits.coordinates import with_symmetries
from nanorom.continuation.orbits.orbit import orbit_amplitudes
from nanorom.continuation.points.critical import CriticalBalance
from nanorom.continuation.scaled import ScaledSystem
from nanorom.continuation.system import LEVELS, TENSORS, ModalSystem
from nanorom.continuation.threads import one_thread
from nanorom.errors import ContinuationError
from nanorom.types import Array

TOLERANCE = 1e-11  # of the orbit: the last harmonics of the point that is derived
STEP = 1e-5  # of the orbit: difference of its maximum, of which the square remains
DEGENERATE = 1e-3  # relative error of a derivative by round-off: beyond, there is none
TINY = 1e-300
SAME = 1e-6  # of the frequency: as far as the point is corrected


@attrs.frozen(eq=False)
class PointSlope:
    """What a special point moves by with an array, per unit of that.

    omega: rad per unit of time; amplitude (L,): of max |q_r| over a period, in units of q.
    """

    omega: float
    amplitude: Array


@one_thread()
def point_slopes(
    system: ModalSystem,
    point: SpecialPoint,
    direct: float,
    parametric: float,
    changes: Sequence[Mapping[str, object]],
) -> list[PointSlope]:
    """Derivatives of a special point of `explore` by changes of the arrays.

    Parameters
    ----------
    system : ModalSystem
    point : SpecialPoint found at the levels `direct` and `parametric`
    direct, parametric : levels of the point, in units of the patterns
    changes : for each derivative, arrays by name that are added: mass, damping, stiffness,
        quadratic, cubic, cubic_damping; direct and parametric, forces as they act (the level times
        the pattern)

    Raises
    ------
    ContinuationError
        for an unknown array, or a point that is degenerate: a cusp, or one that another one meets.
    """
    if not changes:
        return []
    unit = with_symmetries(system.scaled(direct, parametric))
    scaled = [_change(system, unit, direct, parametric, arrays) for arrays in changes]
    kind, multiple = KINDS[point.type], point.period_multiple
    curve = CriticalCurve(
        origin=unit,
        change=reduce(lambda one, two: one.pattern(two), scaled, unit.times(0.0)),
        kind=kind,
        multiple=multiple,
        limits=((0.0, np.inf), (-1.0, 1.0)),
        tolerance=TOLERANCE,
    )
    rate = point.omega / unit.frequency / multiple
    more = kind.condition.second_frequency(point.multipliers)
    place = curve.place(Point(unit.inner(point.coefficients), rate, 0.0, more))
    balance, support, z = place.balance, place.support, place.z
    assert isinstance(balance, CriticalBalance)
    n = balance.basis.size
    if abs(z[n] - rate) > SAME * rate:
        raise ContinuationError(f"{point.type}: it is none of this system at these levels")
    _, jacobian = balance.system(z)
    at_level = np.delete(jacobian, n + 1, axis=1)
    factors = lu_factor(at_level)
    if not np.linalg.cond(at_level, 1) * np.finfo(float).eps < DEGENERATE:
        raise ContinuationError(f"{point.type}: degenerate, it has no derivatives")
    found = []
    for change in scaled:
        own = CriticalBalance(unit, change, support, kind, multiple, balance.basis.harmonics)
        own.border = balance.border
        moved = -lu_solve(factors, own.system(z)[1][:, n + 1])
        found.append(_in_units(unit, balance, z, moved, multiple))
    return found


def _change(
    system: ModalSystem,
    unit: ScaledSystem,
    direct: float,
    parametric: float,
    arrays: Mapping[str, object],
) -> ScaledSystem:
    """What arrays add to the scaled equations; those of the mass as what does the same to the rest:
    (M + dM)^-1 F = M^-1 (F - dM M^-1 F) to first order.
    """
    own = {name: array for name, array in arrays.items() if name != "mass"}
    change = system.change(own, unit)
    if "mass" not in arrays:
        return change
    if system.states is not None:
        raise ContinuationError("mass: no derivatives by it beside states of first order")
    share = -square(arrays["mass"], system.size, "mass") @ np.linalg.inv(system.mass)
    levels = {"direct": direct, "parametric": parametric}
    known = system.arrays()
    by_mass: dict[str, object] = {
        name: levels.get(name, 1.0) * np.tensordot(share, known[name], axes=1)
        for name in (*TENSORS, *LEVELS)
    }
    return change.plus(system.change(by_mass, unit), 1.0)


def _in_units(
    unit: ScaledSystem, balance: CriticalBalance, z: Array, moved: Array, multiple: int
) -> PointSlope:
    basis, n = balance.basis, balance.basis.size
    orbit, slope = (unit.given(basis.expand(basis.unpack(x[:n]), unit.size)) for x in (z, moved))
    # the maximum does not feel to first order where it is: differences of it have no other error
    step = STEP * np.abs(orbit).max() / max(float(np.abs(slope).max()), TINY)
    high, low = orbit_amplitudes(np.array([orbit + step * slope, orbit - step * slope]))
    omega = multiple * unit.frequency * float(moved[n])
    return PointSlope(omega, (high - low) / (2 * step))
