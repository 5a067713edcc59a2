"""Special points made precise, and confirmed by shooting; what is not confirmed is not reported.

The branch is expanded anew at the point with more harmonics; the critical quantity is then brought
to zero along that expansion. Two sizes of basis must agree on the frequency.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nanorom.continuation.branches.path import Path
from nanorom.continuation.branches.series import Series
from nanorom.continuation.branches.trace import Tracer
from nanorom.continuation.orbits.bifurcations import CONFIRMED, Kind
from nanorom.continuation.orbits.floquet import FloquetSolver
from nanorom.continuation.orbits.orbit import Orbit, same_orbit
from nanorom.continuation.orbits.shooting import Shooting
from nanorom.continuation.points.detection import Detected
from nanorom.errors import ContinuationError
from nanorom.types import Array

DEFECT = 1e-10  # of the orbit: harmonics are added until shooting finds no larger one
LEFT_OUT = 1e-12  # of the orbit: coefficients that a first expansion at a point does without
HOPELESS = 1e-2  # distance of the critical multiplier that no better expansion would mend
SAME = 1e-9  # of a frequency
TOGETHER = 1e-8  # of multipliers, and of frequencies, that several of them are critical at
ASIDE = 0.5  # of the window
DIVERGED = 1e-6  # last terms of a series, relative to the orbit
ORDER = 12  # of a series about a point that is known well: half the work of one for a step
FIRST_SECANT, LAST_SECANT, SECANTS = 1e-3, 1e-7, 8  # of the window: changes; most of them
LITTLE = 1e-2  # of the first change: one that tells no slope
MUCH_CLOSER = 1e-2  # than damping alone: multipliers that are critical together
ROUND_OFF = 1e-6  # of a frequency: what it may make of a fold at Q = 1e9
SHADOW = 1e-2  # of the width of a resonance: no branch point is so close to a fold
WITHIN_TONGUE = 0.1  # of the damping: the first step of a search at the end of a tongue
IN_TONGUE = 1e-3  # of the damping: where the last change ends in a tongue
PAIRED = 1e-4  # distance of the second multiplier from a fold's where round-off may cross the two
ROUNDS = 6  # of expansions at a point, each nearer to it
Solvers = tuple[FloquetSolver, FloquetSolver]  # that lead near a zero, and that tell where it is
WINDOW = 0.2  # of the step in which the point was found


@dataclass(frozen=True, eq=False)
class Polished:
    """A confirmed special point: the orbit and its multipliers (2L,) over the whole period."""

    kind: Kind
    orbit: Orbit
    multipliers: Array
    multiplicity: int = 1

    def is_same(self, other: Polished) -> bool:
        """Whether two places on a path led to one point."""
        least = SAME if self.multiplicity == 1 else TOGETHER
        near = abs(self.orbit.omega - other.orbit.omega) < least * self.orbit.omega
        return self.kind is other.kind and near and same_orbit(self.orbit, other.orbit)


def without_shadows(found: list[Polished], path: Path) -> list[Polished]:
    """The points without such branch points as round-off makes of a fold at small damping.

    At a fold of a motion that is hardly damped two multipliers meet near 1, and both of them cross
    it in the noise.
    """
    folds = [point.orbit.omega for point in found if point.kind.turns]
    near = SHADOW * path.tracer.accuracy.loss

    def shadow(point: Polished) -> bool:
        kind = point.kind
        if not kind.condition.by_slope or kind.distance(point.multipliers, 2) > PAIRED:
            return False
        omega = point.orbit.omega
        return any(abs(omega - fold) < max(near, ROUND_OFF) * omega for fold in folds)

    return [point for point in found if not shadow(point)]


def polish(
    path: Path, detected: Detected, precise: FloquetSolver, shooting: Shooting
) -> Polished | None:
    """The point to about 1e-10 in frequency, or None if it does not stand up to shooting.

    The multipliers by which the path was searched lead there, but where they are very large.
    """
    found = _polished(path, detected, (path.floquet, precise), shooting)
    return found or _polished(path, detected, (precise, precise), shooting)


def _polished(
    path: Path, detected: Detected, solvers: Solvers, shooting: Shooting
) -> Polished | None:
    tracer = path.tracer
    series = path.steps[detected.place.step]
    a, window = detected.place.a, WINDOW * (series.length - series.start)
    shift = 0.0
    # along a family of turned orbits a multiplier is 1 throughout
    always = len(path.generators) if detected.kind.at_ends else 0
    expected = detected.multiplicity + always
    for turn in range(ROUNDS):
        try:
            nearby = _expand_again(tracer, series, a - shift, 0.0 if turn else LEFT_OUT)
            series, a = nearby, _zero(detected, nearby, solvers, path, window, shift)
        except ContinuationError:
            # at a branch point the Jacobian may be singular: expand beside it
            if shift or detected.kind.turns:
                return None
            shift = ASIDE * window
            continue
        orbit = tracer.orbit(series, a)
        shot = shooting.check(orbit)
        distance = detected.kind.apart(shot.multipliers, expected)
        scale = max(1.0, float(np.abs(orbit.coefficients).max()))
        last = series.balance.basis.harmonics == tracer.ladder[-1]
        # where multipliers change fast, or meet, less than the defect allowed makes them differ
        if (shot.defect < DEFECT * scale and not CONFIRMED < distance < HOPELESS) or last:
            break
    if shot.defect > CONFIRMED * scale or distance > CONFIRMED:
        return None
    multiplicity = detected.multiplicity
    together = min(TOGETHER, MUCH_CLOSER * tracer.accuracy.loss)
    while detected.kind.distance(shot.multipliers, multiplicity + always + 1) < together:
        multiplicity += 1
    return Polished(detected.kind, orbit, shot.multipliers, multiplicity)


def _expand_again(tracer: Tracer, series: Series, a: float, left_out: float) -> Series:
    """The expansion of the branch at a, on the next larger number of harmonics; without what is
    left out as too small, relative to the orbit.
    """
    balance = series.balance
    position = tracer.ladder.index(balance.basis.harmonics)
    harmonics = tracer.ladder[min(position + 1, len(tracer.ladder) - 1)]
    x, rate = series.at(a)
    x, border = tracer.transfer(balance, tracer.balance(harmonics), x, series.tangent(a))
    larger, x, border = tracer.reduced(tracer.balance(harmonics), x, rate, border, left_out)
    x, rate, factors = larger.correct(x, rate, border, tracer.accuracy.solved)
    if tracer.accuracy.sharp:
        factors = larger.factorise(x, rate, border)
    packed, rates = tracer.expansion(harmonics).expand(larger, x, rate, factors, ORDER)
    return Series.from_terms(larger, packed, rates, DIVERGED)


def _zero(
    detected: Detected,
    series: Series,
    solvers: Solvers,
    path: Path,
    window: float,
    around: float,
) -> float:
    """Where the critical quantity vanishes, close to a = around (0 for a fold)."""
    if detected.kind.turns:
        roots = series.folds(-window, window)
        if not roots:
            raise ContinuationError("no fold in the neighbourhood")
        return min(roots, key=abs)

    tracer = path.tracer
    test = detected.kind.condition.critical(path.symmetric, detected.multiplicity)
    near, precise = solvers

    def critical(points: list[float], by: FloquetSolver = near) -> list[float]:
        if max(abs(a) for a in points) > series.length:
            raise ContinuationError("the series does not reach the point")
        orbits = [tracer.orbit(series, a) for a in points]
        eigenvalues = path.monodromy(orbits, by)[1]
        slopes = [series.rate_slope(a) for a in points]
        return [test(e, slope) for e, slope in zip(eigenvalues, slopes)]

    # smaller than a tongue as narrow as the damping
    step = min(FIRST_SECANT * window, WITHIN_TONGUE * tracer.accuracy.loss)
    a, (here, there) = around, critical([around, around + step])
    slope = (there - here) / step
    for _ in range(SECANTS):
        change = -here / slope if slope else np.inf
        if abs(a + change - around) > window:
            raise ContinuationError("no zero in the neighbourhood")
        if abs(change) < min(
            LAST_SECANT * window, IN_TONGUE * tracer.accuracy.loss
        ):  # the secant's next change is its square, but for what its multipliers are off by
            a += change
            return a - critical([a], precise)[0] / slope
        before, a = here, a + change
        here = critical([a])[0]
        if abs(change) > LITTLE * step:  # of a smaller one, the multipliers' errors are a part
            slope = (here - before) / change
    return a
