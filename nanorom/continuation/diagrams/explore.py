"""The whole bifurcation diagram of one drive level by one call."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from nanorom.continuation.branches.path import TURNED
from nanorom.continuation.branches.series import Series
from nanorom.continuation.branches.start import (
    first_orbit,
    follow_closed,
)
from nanorom.continuation.branches.trace import Tracer
from nanorom.continuation.diagrams.apart import Apart
from nanorom.continuation.diagrams.course import Course
from nanorom.continuation.diagrams.diagram import Diagram
from nanorom.continuation.diagrams.record import UNFINISHED, Node, Record
from nanorom.continuation.diagrams.subharmonics import linear_response, stretches
from nanorom.continuation.diagrams.window import Window
from nanorom.continuation.orbits.coordinates import with_symmetries
from nanorom.continuation.orbits.harmonics import (
    forced_support,
)
from nanorom.continuation.orbits.orbit import Orbit, PeriodicOrbit
from nanorom.continuation.points.directions import breaking, crossing
from nanorom.continuation.points.switching import Bifurcation, Crossing, Start
from nanorom.continuation.settings import Settings, check_range
from nanorom.continuation.system import ModalSystem
from nanorom.continuation.threads import one_thread
from nanorom.errors import ContinuationError
from nanorom.types import Array

SAME_FREQUENCY = 1e-6  # of a bifurcation found on two branches
SAME_END = 1e-9  # of the high end of the range, where a step ends that leaves it
LONG = 4  # periods of the drive: of cascades, whose branches are many and soon unstable
HOPELESS = 1e6  # multiplier beyond which such a branch is not followed


@one_thread()
def explore(
    system: ModalSystem,
    omega: tuple[float, float],
    direct: float = 0.0,
    parametric: float = 0.0,
    *,
    depth: int = 1,
    tolerance: float = 5e-10,
    harmonics: int = 650,
    steps: int = 2000,
    reach: float = 2.0,
    seeds: Sequence[PeriodicOrbit] = (),
    folds: Sequence[PeriodicOrbit] = (),
    known: Diagram | None = None,
    watch: Callable[[Course], None] | None = None,
) -> Diagram:
    """All branches of periodic orbits that are connected to the response from rest, with their
    special points.

    Parameters
    ----------
    system : ModalSystem
    omega : (low, high)
        Drive frequencies of the base branch, rad per unit of time of the system.
    direct, parametric : float
        Drive levels that multiply the patterns J and P of the system.
    depth : int
        Generations of branches followed at period doublings and branch points.
    tolerance : float
        Size of the last harmonics kept, relative to the orbit.
    harmonics : int
        Most harmonics of the drive frequency.
    steps : int
        Most steps on one branch; all branches together have twice as many.
    reach : float
        A branch that bifurcates is followed to omega[0] / reach and omega[1] * reach.
    seeds : sequence of PeriodicOrbit
        Orbits, say of another level's diagram, that may lie near a branch which is not connected to
        the others (an isola): where an orbit is found there, its branch is followed, too.
    folds : sequence of PeriodicOrbit
        As seeds, orbits near folds of such branches.
    known : Diagram
        The diagram of this level, if it was explored before: only what the seeds lead to is added.
    watch : callable
        Told after every step what the diagram has come to.

    Raises
    ------
    ContinuationError
        for an invalid range or level, or if no orbit is found at the start of the range.
    """
    low, high = check_range(omega)
    settings = Settings(
        tolerance=tolerance, depth=depth, steps=steps, harmonics=harmonics, reach=reach
    )
    scaled = with_symmetries(system.scaled(direct, parametric))
    record = Record(scaled, (low, high), settings, watch)
    return _Explorer(record, (direct, parametric)).diagram(known, seeds, folds)


class _Explorer:
    """Follows the base branch, then what leaves it, then what seeds lead to."""

    def __init__(self, record: Record, levels: tuple[float, float]) -> None:
        self.record, self.levels = record, levels
        self.scaled, self.settings = record.scaled, record.settings
        self.apart = Apart(record)

    def diagram(
        self, known: Diagram | None, seeds: Sequence[PeriodicOrbit], folds: Sequence[PeriodicOrbit]
    ) -> Diagram:
        """All that leads from rest, or all that was known before, and what seeds lead to."""
        try:
            if known is None:
                window = self.apart.window = self._base()
                self._bifurcating()
                self._from_outside(window)
                self._subharmonic()
            else:
                self.record.begin_with(known)
            return self._with_isolas(seeds, folds)
        except np.linalg.LinAlgError as error:
            raise ContinuationError(
                f"numbers that are no longer finite, or a singular matrix ({error}); "
                "allowed: a weaker drive, or a range farther from such motion"
            ) from None

    def _from_outside(self, window: Window) -> None:
        """Branches that come into the range from where the response, unstable at its ends, became
        so.
        """
        start, stop = self.record.range
        for low, high in list(window.outside()):
            omega = low * self.scaled.frequency, high * self.scaled.frequency
            outer = _Explorer(Record(self.scaled, omega, self.settings), self.levels)
            outer._base()
            outer._bifurcating()
            for branch in outer.record.branches:
                orbits = [self.record.scaled_orbit(branch.orbit(i)) for i in range(len(branch))]
                inside = [
                    o for o in orbits if self.record.range[0] < o.omega < self.record.range[1]
                ]
                if branch.parent is not None and inside:
                    self.apart.follow(inside[len(inside) // 2], alone=True)
            self._bifurcating()

    def _subharmonic(self) -> None:
        """Branches of one to five periods of the drive that nothing leads to."""
        try:
            doublings = self.settings.depth > 0
            given = self.scaled, self.record.range, self._response, doublings
            for stretch in stretches(*given):
                if self.record.spent:
                    why = (
                        f"orbits of {stretch.order} period(s): not looked for, as said of branches"
                    )
                    self.record.leave("start", stretch.omega, why)
                    continue
                # all of them: stable and unstable orbits need not be on one branch
                met = [self.apart.follow(start, alone=True) for start in stretch.starts]
                if not any(met) and not self.record.has_motion(stretch.order, stretch.omega):
                    why = f"orbits of {stretch.order} period(s) may be near; none was found"
                    self.record.leave("start", stretch.omega, why)
                self._bifurcating()
        except ContinuationError as error:
            why = f"apart from others, orbits were not looked for everywhere: {error}"
            self.record.leave("start", self.record.range[0], why)

    def _response(self, omega: float) -> Array:
        """The response beside which others are looked for: linear, where none is known."""
        known = self.record.response(omega)
        return linear_response(self.scaled, omega) if known is None else known

    def _with_isolas(
        self, seeds: Sequence[PeriodicOrbit], folds: Sequence[PeriodicOrbit]
    ) -> Diagram:
        # of short periods first: they may lead to the others
        for seed in sorted([*folds, *seeds], key=lambda seed: seed.period_multiple):
            self.apart.follow(self.record.scaled_orbit(seed), at_fold=seed in folds)
            self._bifurcating()
        return self.record.diagram(*self.levels)

    def _bifurcating(self) -> None:
        """Every branch that starts at a special point found so far."""
        while self.scaled.nonlinear:  # otherwise it goes straight up, at one frequency
            node = next(
                (
                    node
                    for node in self.record.nodes
                    if not node.switched and node.generation < self.settings.depth
                ),
                None,
            )
            if node is None:
                return
            node.switched = True
            if self.record.spent:
                why = f"{node.kind.name}: not followed, for the diagram has taken its most steps"
                self.record.leave("branch", node.orbit.omega, why)
            else:
                self._switch(node)

    def _base(self) -> Window:
        """The branch of the response from rest at the low end; if it turns back, also the one from
        the high end, and the pieces that lie between where it leaves the range and comes back.
        Returns what is at the ends of the range.
        """
        low, high = self.record.range
        tracer = Tracer(self.scaled, forced_support(self.scaled), 1, self.settings)
        window = Window(self.record, tracer)
        for edge, outward in ((low, -1.0), (high, 1.0)):
            try:
                orbit = first_orbit(tracer, edge, outward)
                if not window.begin(orbit):
                    continue
                steps = self._steps(tracer, orbit, -outward)
            except ContinuationError as error:
                if edge == high and not self.record.branches:
                    raise
                self.record.leave("start", edge, error)
                continue
            self.record.add(tracer, steps, None, 0)
            window.meet(self.record.end(tracer, steps))
        window.add_pieces()
        window.tell()
        return window

    def _steps(self, tracer: Tracer, orbit: Orbit, direction: float) -> list[Series]:
        steps = list(tracer.follow(orbit, direction, self.record.range))
        if not steps:
            raise ContinuationError(
                "the harmonics of the first orbit do not converge; raise `harmonics`, "
                "or start the range farther from a resonance"
            )
        return steps

    def _switch(self, node: Node) -> None:
        if node.reached and node.kind.period_factor > 1:
            return
        found: list[tuple[Bifurcation, Start]] = []
        failed: ContinuationError | None = None
        for bifurcation in self._bifurcations(node):
            rates = self.record.rates(bifurcation.tracer.period_multiple, True)
            try:
                starts = bifurcation.starts(rates)
            except ContinuationError as error:
                failed = error
                continue
            found += [
                (bifurcation, start)
                for start in starts
                if not any(start.is_image(other, self.scaled) for _, other in found)
            ]
        if not found and failed is not None:
            self.record.leave("branch", node.orbit.omega, f"{node.kind.name}: {failed}")
        if len(found) == 1 and node.reached:
            return
        for bifurcation, start in found:
            certain = len(found) == 1 and start.before is not None and not self.record.known
            if certain or self.record.is_new(start.orbit):
                rates = self.record.rates(bifurcation.tracer.period_multiple, True)
                self._follow(node, bifurcation, start, rates)

    def _bifurcations(self, node: Node) -> list[Bifurcation]:
        """The branches that may leave a special point."""
        support, orbit, kind = node.path.tracer.support, node.orbit, node.kind
        given = self.scaled, support, orbit, kind
        directions, size = breaking(*given, node.multiplicity)
        passing = node.path.passing(orbit) if kind.period_factor == 1 else None
        if passing is not None and node.multiplicity == 1:
            harmonics = (len(orbit.coefficients) - 1) // 2
            tangent = node.path.tracer.tangent(*passing, harmonics)
            direction, rate, rest = crossing(self.scaled, support, orbit, tangent)
            if rest < size:
                p = orbit.period_multiple
                stops = [
                    other.orbit
                    for other in self.record.nodes
                    if other is not node and other.orbit.period_multiple == p
                ]
                return [Crossing(*given, direction, self.settings, rate, stops)]
        for turn in self.record.generators:
            if directions and np.abs(directions[0] @ turn.T).max() > TURNED:
                directions = directions[:1]  # the others are that one turned
        return [Bifurcation(*given, direction, self.settings) for direction in directions]

    def _follow(
        self, node: Node, bifurcation: Bifurcation, start: Start, rates: tuple[float, float]
    ) -> None:
        """One branch of a bifurcation, to its end."""
        tracer = bifurcation.tracer
        ended: Orbit | None = None
        if start.before is None:
            steps = follow_closed(tracer, start.orbit, start.direction, rates)
        else:
            steps = list(start.before)
            for series in tracer.follow(start.orbit, start.direction, rates):
                if not steps:
                    bifurcation.begin(series)
                end = bifurcation.end(series)
                if end is not None:
                    series.length = end
                steps.append(series)
                if end is not None:
                    ended = tracer.orbit(series, end)
                    self._mark_end(ended)
                    tracer.ending = "bifurcation"
                    break
                if self._is_hopeless(tracer, series):
                    tracer.ending = "unstable"
                    break
        if not steps:
            why = UNFINISHED.get(tracer.ending, "it leads nowhere")
            self.record.leave("branch", node.orbit.omega, f"{node.kind.name}: {why}")
            return
        self.record.add(tracer, steps, node, node.generation + 1, bifurcation)
        if ended is not None:  # on a branch that may not be known yet
            self.apart.follow(bifurcation.symmetric(ended), bifurcation.shorter)

    def _is_hopeless(self, tracer: Tracer, series: Series) -> bool:
        """Whether orbits of a long period have become so unstable that nothing is near them."""
        if tracer.period_multiple < LONG:
            return False
        orbit = tracer.orbit(series, series.length)
        given = orbit.coefficients[None], np.array([orbit.rate])
        multipliers = self.record.floquet.multipliers(*given, orbit.period_multiple, tracer.support)
        return bool(np.abs(multipliers).max() > HOPELESS)

    def _mark_end(self, end: Orbit) -> None:
        """The pitchfork at which a branch ends needs no branch of its own."""
        for node in self.record.nodes:
            p = node.orbit.period_multiple
            if (
                abs(node.orbit.omega - end.omega) > SAME_FREQUENCY * end.omega
                or end.period_multiple % p
            ):
                continue
            node.reached = True
