"""Bifurcations of codimension two on curves of special points, in one table.

On a curve one multiplier, or a pair, is critical throughout. Where a further one becomes so the two
meet; where the angle of a pair is a small part of a turn the resonance is strong; where a period
doubling turns from sub- to supercritical it is generalised. Resonances 1:1 and 1:2 are located on
curves of folds and doublings: those of pairs end there. A further kind is a row of `ROWS`.
Source: Kuznetsov 2004, Elements of Applied Bifurcation Theory, doi:10.1007/978-1-4757-3978-7,
chapter 9 (maps), equation 9.30 for the coefficient of a period doubling.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

import attrs
import numpy as np

from nanorom.continuation.curves.conditioned import multipliers_of
from nanorom.continuation.curves.curve import Point
from nanorom.continuation.orbits.bifurcations import DOUBLING, FOLD, TORUS, Kind
from nanorom.continuation.orbits.conditions import REAL
from nanorom.continuation.orbits.orbit import PeriodicOrbit
from nanorom.continuation.scaled import ScaledSystem
from nanorom.continuation.tori.return_map import ReturnMap
from nanorom.types import Array, Numbers

MET = 1e-3  # distance of a multiplier from where it is to be at a point that is told
DOUBLE = 0.05  # the same of two that meet: each is known to a root of the errors of both
SMALL, LEAST = 5e-3, 0.1  # of the size of a state, no less than so many units: steps of differences
ROUNDING = 1e-12  # of a state: what the map is known to, and more
SPREAD = (-2.0, -1.0, 0.0, 1.0, 2.0)  # such steps, and weights of values there in
SECOND = np.array([-1.0, 16.0, -30.0, 16.0, -1.0]) / 12  # second and
THIRD = np.array([-1.0, 2.0, 0.0, -2.0, 1.0]) / 2  # third derivatives


@attrs.frozen(eq=False)
class Orbit:
    """A point of a curve with what its kinds are told by: the equations, periods of the drive,
    multipliers (2L,), and those of them that are not critical anyway.
    """

    system: ScaledSystem
    point: Point
    multiple: int
    multipliers: Numbers
    rest: Numbers

    @property
    def angle(self) -> float:
        """Of the critical pair, in rad."""
        return 2 * np.pi * self.point.more[0]


Test = Callable[[Orbit], float]
Check = Callable[[Orbit], bool]


@attrs.frozen
class Row:
    """code, name; of the curves on which it is looked for; a function that changes its sign there;
    whether a place where it does is one.
    """

    code: str
    name: str
    kind: Kind
    test: Test
    holds: Check


def orbit_at(system: ScaledSystem, point: Point, multiple: int, kind: Kind) -> Orbit:
    """A point of a curve of one kind."""
    values = multipliers_of(system, point, multiple)
    if kind.condition.conjugate:
        turn = np.exp(2j * np.pi * point.more[0])
        critical = [np.abs(values - turn).argmin(), np.abs(values - turn.conj()).argmin()]
    else:
        critical = [int(kind.condition.distances(values).argmin())]
    return Orbit(system, point, multiple, values, np.delete(values, np.unique(critical)))


def _damped(factors: Numbers) -> float:
    """Their real product, of which large ones do not hide a zero."""
    return float(np.prod(factors / (1 + np.abs(factors))).real)


def _crosses(kind: Kind) -> Test:
    return lambda orbit: kind.condition.crossing(orbit.multipliers)


def _near(kind: Kind) -> Check:
    return lambda orbit: bool(len(orbit.rest)) and kind.distance(orbit.rest) < MET


def _twice(target: float) -> tuple[Test, Check]:
    """The slope of the characteristic polynomial at a root of it, and whether two are near."""

    def slope(orbit: Orbit) -> float:
        factors = orbit.multipliers - target
        factors = factors / (1 + np.abs(factors))
        return float(sum(np.prod(np.delete(factors, i)) for i in range(len(factors))).real)

    def near(orbit: Orbit) -> bool:
        return bool(np.sort(np.abs(orbit.multipliers - target))[1] < DOUBLE)

    return slope, near


def _pair(orbit: Orbit) -> float:
    """prod (mu_i mu_j - 1) of those that are not critical: zero of a pair on the circle."""
    products = np.array([a * b for a, b in combinations(orbit.rest, 2)])
    return _damped(products - 1) if len(products) else 1.0


def _pair_near(orbit: Orbit) -> bool:
    """Whether it is a pair, not two real ones with the product one."""
    complex_ones = orbit.rest[orbit.rest.imag > REAL]
    return bool(np.abs(np.abs(complex_ones) - 1).min(initial=np.inf) < MET)


def _at_angle(turns: float) -> Test:
    return lambda orbit: float(np.cos(orbit.angle) - np.cos(2 * np.pi * turns))


def _always(orbit: Orbit) -> bool:
    return True


def doubling_coefficient(orbit: Orbit) -> float:
    """c of x -> -x + c x^3 on the centre manifold of a period doubling, states of size one:
    positive where doubled orbits are stable and around the orbit that has lost its stability.

    c = <p, C(q, q, q)> / 6 + <p, B(q, h)> / 2, (I - A) h = B(q, q), derivatives A, B, C of the map
    of states over a period.
    """
    omega = orbit.point.rate * orbit.multiple
    motion = PeriodicOrbit(orbit.point.full, omega, orbit.multiple)
    x = np.concatenate([motion(0.0), motion.velocity(0.0)])
    map_ = ReturnMap(lambda _: (orbit.system, omega), orbit.multiple)
    _, slopes = map_.with_tangent(x[None], 0.0)
    values, vectors = np.linalg.eig(slopes[0])
    others, adjoints = np.linalg.eig(slopes[0].T)
    q = vectors[:, np.abs(values + 1).argmin()].real
    p = adjoints[:, np.abs(others + 1).argmin()].real
    size = float(np.abs(x).max())
    step = SMALL * max(size, LEAST)
    q = q / np.abs(q).max()
    p = p / (p @ q)

    def along(*directions: Array) -> Array:
        """Images (k, 5, 2L) of states on both sides of the orbit's in k directions."""
        states = x + step * np.multiply.outer(SPREAD, np.stack(directions))
        images = map_(states.reshape(-1, len(x)), 0.0)
        return images.reshape(len(SPREAD), -1, len(x)).transpose(1, 0, 2)

    (images,) = along(q)
    third = THIRD @ images / step**3
    h = np.linalg.solve(np.eye(len(x)) - slopes[0], SECOND @ images / step**2)
    scale = float(np.abs(h).max()) or 1.0
    over, beyond = along(q + h / scale, q - h / scale)
    mixed = scale * (SECOND @ (over - beyond)) / step**2 / 4
    found = float(p @ third / 6 + p @ mixed / 2)
    noise = ROUNDING * max(size, step) / step**3  # all that there is of a linear system
    return found if abs(found) > noise else noise


ROWS = (
    Row("R1", "1:1 resonance", FOLD, *_twice(1.0)),
    Row("LPPD", "fold and period doubling", FOLD, _crosses(DOUBLING), _near(DOUBLING)),
    Row("LPNS", "fold and Neimark-Sacker", FOLD, _pair, _pair_near),
    Row("R2", "1:2 resonance", DOUBLING, *_twice(-1.0)),
    Row("LPPD", "fold and period doubling", DOUBLING, _crosses(FOLD), _near(FOLD)),
    Row("PDNS", "period doubling and Neimark-Sacker", DOUBLING, _pair, _pair_near),
    Row("GPD", "generalised period doubling", DOUBLING, doubling_coefficient, _always),
    Row("R3", "1:3 resonance", TORUS, _at_angle(1 / 3), _always),
    Row("R4", "1:4 resonance", TORUS, _at_angle(1 / 4), _always),
    Row("LPNS", "fold and Neimark-Sacker", TORUS, _crosses(FOLD), _near(FOLD)),
    Row("PDNS", "period doubling and Neimark-Sacker", TORUS, _crosses(DOUBLING), _near(DOUBLING)),
    Row("NSNS", "two Neimark-Sacker at once", TORUS, _pair, _pair_near),
)
NAMES = {row.code: row.name for row in ROWS}


def rows_of(kind: Kind) -> tuple[Row, ...]:
    """Those that are looked for on curves of one kind."""
    return tuple(row for row in ROWS if row.kind is kind)
