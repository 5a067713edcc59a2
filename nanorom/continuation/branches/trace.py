"""Following one branch of periodic orbits step by step, with harmonics adapted on the way."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from nanorom.continuation.branches.accuracy import Accuracy
from nanorom.continuation.branches.march import March, StepControl
from nanorom.continuation.branches.series import Series, SeriesExpansion
from nanorom.continuation.orbits.balance import (
    MANY_UNKNOWNS,
    HarmonicBalance,
    NewtonFailure,
)
from nanorom.continuation.orbits.harmonics import HARMONIC_LADDER, LONG_LADDER, Support, basis_for
from nanorom.continuation.orbits.orbit import Orbit
from nanorom.continuation.scaled import ScaledSystem
from nanorom.continuation.settings import Settings
from nanorom.errors import ContinuationError
from nanorom.types import Array

LARGEST_STEP = 10.0  # times orbit and frequency (of a linear system the series never ends)
LEAST_PART = 1 / 64  # of a step, at whose end the next one cannot begin
FIRST_CORRECTIONS = 15  # of an orbit that is not near a known one
FEW_MISSING = 2.0  # unknowns by those of an orbit that was not found
REDUCTIONS = 3  # choices of the coefficients that such an orbit may do without
LEAST_MORE, MOST_MORE = 1.1, 1.6  # factors on the number of harmonics, where it must rise
SLOWEST_DECAY = 1e-3  # of the log of the harmonics, each: below, it tells nothing
SPARE = 30.0  # factor between the sizes of last harmonics that call for more and for fewer
LARGEST_DRIFT = 0.25  # of the rate within a step
PER_OCTAVE = 16  # lengths of steps
SHORTER, SHORTENINGS = 0.7, 12  # factor on a step whose end is not good, how often at most
REST = 1e-6  # size below which an orbit is at rest
ROUND_OFF = 1e-16  # of the largest harmonic
MOST_UNKNOWNS = 1000  # of orbits of more than the usual harmonics: beyond, shooting costs less
TINY = 1e-30  # of an orbit at rest
WORK_SPACES = 2  # a step may want more harmonics, and the next one fewer again
UNRESOLVED = 2.0  # times the tolerance: size of the last harmonics at which shooting takes over


class Tracer:
    """Branches of one system inside one invariant support."""

    def __init__(
        self, system: ScaledSystem, support: Support, period_multiple: int, settings: Settings
    ) -> None:
        self.system, self.support, self.period_multiple = system, support, period_multiple
        self.settings = settings
        self.ending = "open"
        self.accuracy = Accuracy.of(system, support, settings)
        self._balances: dict[int, HarmonicBalance] = {}
        self._expansions: dict[int, SeriesExpansion] = {}  # the last one used is the last
        moving = int(support.table.any(axis=1).sum())
        most = max(MOST_UNKNOWNS // max(2 * moving, 1), HARMONIC_LADDER[-1])
        most = min(most, settings.harmonics * period_multiple)
        least = max(2, system.tones) * period_multiple
        self.ladder = [h for h in (*HARMONIC_LADDER, *LONG_LADDER) if least <= h <= most]
        if not self.ladder:
            raise ContinuationError(
                f"harmonics: orbits of {period_multiple} periods of this drive need {least}; "
                f"allowed {most}"
            )

    def balance(self, harmonics: int) -> HarmonicBalance:
        if harmonics not in self._balances:
            basis = basis_for(self.support, harmonics, self.period_multiple)
            self._balances[harmonics] = HarmonicBalance(self.system, basis)
        return self._balances[harmonics]

    def expansion(self, harmonics: int) -> SeriesExpansion:
        """Work space for series; of many modes it is large, so that the last ones alone stay."""
        found = self._expansions.pop(harmonics, None)
        self._expansions[harmonics] = found or SeriesExpansion(self.balance(harmonics))
        if len(self._expansions) > WORK_SPACES:
            del self._expansions[next(iter(self._expansions))]
        return self._expansions[harmonics]

    def orbit(self, series: Series, a: float) -> Orbit:
        x, rate = series.at(a)
        return Orbit(series.balance.basis.expand(x, self.system.size), rate, self.period_multiple)

    def spectrum(self, balance: HarmonicBalance, x: Array) -> Array:
        """Largest coefficient of each harmonic 0 ... H."""
        basis = balance.basis
        sizes = np.zeros(basis.harmonics + 1)
        np.maximum.at(sizes, basis.number, np.abs(x).max(axis=1, initial=0.0))
        return sizes

    def tail(self, balance: HarmonicBalance, x: Array, harmonics: int | None = None) -> float:
        """Size of the last harmonics (those about `harmonics` and above, if given) relative to the
        largest: of two harmonics of the drive, for of a long period those between may be small.
        """
        sizes = self.spectrum(balance, x)
        last = balance.basis.harmonics if harmonics is None else harmonics
        first = max(last + 1 - 2 * self.period_multiple, 0)
        return float(sizes[first:].max() / max(sizes.max(), TINY))

    def adapt(self, balance: HarmonicBalance, x: Array) -> int:
        """The number of harmonics this orbit deserves."""
        tolerance = self.settings.tolerance
        harmonics = balance.basis.harmonics
        position = self.ladder.index(harmonics)
        tail = self.tail(balance, x)
        if tail > tolerance:
            decay = np.log(max(tail, ROUND_OFF)) / harmonics
            wanted = harmonics * LEAST_MORE
            if decay <= -SLOWEST_DECAY:
                wanted = min(np.log(tolerance) / decay, harmonics * MOST_MORE)
            higher = [h for h in self.ladder[position + 1 :] if h >= wanted] or self.ladder[-1:]
            return max(higher[0], harmonics)
        while position > 0 and self.tail(balance, x, self.ladder[position - 1]) < tolerance / SPARE:
            position -= 1
        return self.ladder[position]

    def solve(
        self, orbit: Orbit, border: Callable[[HarmonicBalance], Array]
    ) -> tuple[Orbit, HarmonicBalance]:
        """Newton's method from an approximate orbit, with as many harmonics as it turns out to
        need.
        """
        harmonics = self._first_harmonics(orbit)
        for _ in range(len(self.ladder)):
            balance = self.balance(harmonics)
            x = balance.basis.compress(orbit.coefficients)
            x, rate = self._solved(balance, x, orbit.rate, border(balance))
            orbit = Orbit(balance.basis.expand(x, self.system.size), rate, self.period_multiple)
            wanted = self.adapt(balance, x)
            if wanted <= harmonics:
                return orbit, balance
            harmonics = wanted
        raise ContinuationError("the harmonics of the orbit do not converge; raise `harmonics`")

    def _solved(
        self, whole: HarmonicBalance, x: Array, rate: float, border: Array
    ) -> tuple[Array, float]:
        """Newton's method for the coefficients that count, as many as turn out to."""
        last, most = self.accuracy.solved, FIRST_CORRECTIONS
        for _ in range(REDUCTIONS):
            balance, start, edge = self.reduced(whole, x, rate, border, self.left_out)
            if balance is whole:
                break
            try:
                found, rate_found, _ = balance.correct(start, rate, edge, last, most)
            except NewtonFailure:  # with the few that are missing it may do better
                if whole.basis.size > FEW_MISSING * balance.basis.size:
                    raise
                break
            x, rate = self.transfer(balance, whole, found, edge)[0], rate_found
            if self._missing(balance, found, rate, balance.residual(found, rate)) < self.negligible:
                return x, rate
        return whole.correct(x, rate, border, last, most)[:2]

    def follow(
        self, orbit: Orbit, direction: Array | float, rate_range: tuple[float, float]
    ) -> Iterator[Series]:
        """Steps of the branch through a converged orbit until it leaves the range of rates;
        `ending` says why it stopped.

        `direction`: +-1 for rising or falling rate, or a direction (2H + 1, L) in which the orbit
        moves first.
        """
        balance = self.balance(self._first_harmonics(orbit))
        x, border = (
            balance.basis.compress(orbit.coefficients),
            self._first_border(balance, direction),
        )
        self.ending = "open"
        try:
            first = self._expanded(balance, x, orbit.rate, border)
        except NewtonFailure:  # the ending says all of it
            self.ending = "lost"
            return
        if first is None:
            return
        march = March(
            partial(self._advance, rate_range),
            _leave(first, rate_range),
            StepControl(1.0, LEAST_PART, 1.0, self.settings.steps - 1),
        )
        last = march.start[0]
        for (here, _), (last, _) in march:  # noqa: B007
            yield here
            if self._told(here):
                march.ending = "work"
                break
        if march.ending != "end":
            self.ending = march.ending
        yield last

    def _told(self, series: Series) -> bool:
        """Tell of a step; whether there is to be no further one."""
        settings = self.settings
        if settings.step is not None:
            settings.step(series.rate(series.length), self.period_multiple)
        if settings.budget is None:
            return False
        settings.budget.step(series.balance.basis.size)
        return settings.budget.spent

    def _advance(
        self, rate_range: tuple[float, float], here: tuple[Series, bool], part: float
    ) -> tuple[tuple[Series, bool], bool] | None:
        """The step after another one, which is cut to a part of its length; None where the branch
        ends.
        """
        series, inside = here
        if not inside:
            self.ending = "range"
            return None
        a = part * series.length
        following = self._expanded(series.balance, *series.at(a), series.tangent(a))
        if following is None:
            return None
        series.length = a
        return _leave(following, rate_range), True

    def _expanded(
        self, balance: HarmonicBalance, x: Array, rate: float, border: Array
    ) -> Series | None:
        """The series about a corrected point, on as many harmonics as it deserves; None if those
        allowed do not suffice.
        """
        known = balance.basis.harmonics
        whole = self.balance(known)
        x, border = self.transfer(balance, whole, x, border)
        balance, x, border = self.reduced(whole, x, rate, border, self.left_out)
        while True:
            x, rate, factors = balance.correct(x, rate, border, self.accuracy.corrected)
            wanted = self.adapt(balance, x)
            if wanted == balance.basis.harmonics:
                break
            larger = self.balance(wanted)
            x, border = self.transfer(balance, larger, x, border)
            balance, x, border = self.reduced(larger, x, rate, border, self.left_out)
            if wanted < known:  # fewer than before: enough, no need to look again
                x, rate, factors = balance.correct(x, rate, border, self.accuracy.corrected)
                break
        unresolved = self.tail(balance, x) > UNRESOLVED * self.settings.tolerance
        if balance.basis.harmonics == self.ladder[-1] and unresolved:
            self.ending = "harmonics"
            return None
        if self.accuracy.sharp:
            factors = balance.factorise(x, rate, border)
        expansion = self.expansion(balance.basis.harmonics)
        packed, rates = expansion.expand(balance, x, rate, factors)
        series = Series.from_terms(balance, packed, rates, self.accuracy.series)
        series.length = self._length(series, rates)
        return series

    def _missing(self, balance: HarmonicBalance, x: Array, rate: float, residual: Array) -> float:
        """Size of the coefficients that are no unknowns, relative to the largest."""
        if balance is self.balance(balance.basis.harmonics):
            return 0.0
        sizes = balance.expected(x, rate, residual)
        missing = sizes[~balance.basis.taken].max(initial=0.0)
        return float(missing / max(sizes.max(initial=0.0), TINY))

    @property
    def negligible(self) -> float:
        """Size of coefficients, relative to the largest, that a step may do without to its end:
        their force, too, is to be small beside that of the damping.
        """
        return min(self.settings.tolerance, self.accuracy.residual)

    @property
    def left_out(self) -> float:
        """Size of those that it does without from its start: they may grow on the way."""
        return self.negligible / SPARE

    def _first_harmonics(self, orbit: Orbit) -> int:
        """How many an orbit is given with at first."""
        known = (len(orbit.coefficients) - 1) // 2
        return next((h for h in self.ladder if h >= known), self.ladder[-1])

    def _first_border(self, balance: HarmonicBalance, direction: Array | float) -> Array:
        border = np.zeros(balance.basis.size + 1)
        if np.ndim(direction) == 0:
            border[-1] = float(direction)
        else:
            border[:-1] = balance.basis.pack(balance.basis.compress(np.asarray(direction)))
        return border / np.linalg.norm(border)

    def tangent(self, series: Series, a: float, harmonics: int) -> Array:
        """The tangent (n + 1,) of the branch at a place of a step, on a number of harmonics."""
        given = series.at(a)[0], series.tangent(a)
        return self.transfer(series.balance, self.balance(harmonics), *given)[1]

    def reduced(
        self, balance: HarmonicBalance, x: Array, rate: float, border: Array, left_out: float
    ) -> tuple[HarmonicBalance, Array, Array]:
        """The equations, a point and its border without the coefficients that are, or would be,
        smaller than a part of the largest; all of them where they are few.
        """
        if balance.basis.size < MANY_UNKNOWNS or not left_out:
            return balance, x, border
        taken = balance.basis.in_bands(
            balance.expected(x, rate, balance.residual(x, rate)), left_out
        )
        less = balance.only(taken)
        return less, *self.transfer(balance, less, x, border)

    def transfer(
        self, balance: HarmonicBalance, other: HarmonicBalance, x: Array, border: Array
    ) -> tuple[Array, Array]:
        """The same point and border on the basis of other equations."""
        old, new = balance.basis, other.basis
        if old is new:
            return x, border
        size = self.system.size
        moved = new.unpack(new.pack(new.compress(old.expand(x, size))))
        direction = new.pack(new.compress(old.expand(old.unpack(border[:-1]), size)))
        border = np.append(direction, border[-1])
        return moved, border / np.linalg.norm(border)

    def _length(self, series: Series, rates: Array) -> float:
        """Length of the step: the series converges, the harmonics suffice, the residual at its end
        is small.
        """
        balance = series.balance
        start, rate = series.at(0.0)
        scale = max(float(np.abs(start).max(initial=0.0)), REST)
        # a straight (linear) branch has an infinite radius; multipliers still want points on the
        # way, and along free orbits of one frequency the rate stays
        length = min(series.length, LARGEST_STEP * max(scale, rate))
        if abs(rates[1]) * length > LARGEST_DRIFT * rate:
            length = LARGEST_DRIFT * rate / abs(rates[1])
        # on a coarse grid, so that round-off (other units, say) does not move the points
        length = float(2.0 ** (np.floor(PER_OCTAVE * np.log2(length)) / PER_OCTAVE))
        for _ in range(SHORTENINGS):
            x, rate = series.at(length)
            residual = balance.residual(x, rate)
            error = float(np.abs(balance.basis.pack(residual)).max(initial=0.0))
            tolerance = self.settings.tolerance
            good_tail = self.tail(balance, x) < SPARE * tolerance
            missing = self._missing(balance, x, rate, residual)
            good_tail &= missing < self.negligible
            if (
                rate > 0
                and error < self.accuracy.residual * scale * max(1.0, rate**2)
                and good_tail
            ):
                return length
            length *= SHORTER
        return length


def _leave(series: Series, rate_range: tuple[float, float]) -> tuple[Series, bool]:
    """The step, cut where it leaves the range of rates, and whether it ends inside."""
    first = series.length
    inside = True
    for limit, sign in zip(rate_range, (-1.0, 1.0)):
        for root in series.crossings(limit):
            if sign * series.rate_slope(root) > 0 and root < first:
                first, inside = root, False
    end_rate = series.rate(series.length)
    series.length = first
    return series, inside and rate_range[0] <= end_rate <= rate_range[1]
