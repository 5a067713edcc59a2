"""The whole bifurcation diagram of one drive level by one call."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from nanorom.continuation.branches.path import Path, Place
from nanorom.continuation.branches.series import Series
from nanorom.continuation.branches.shooting_branch import Takeover
from nanorom.continuation.branches.start import first_orbit, fixed_rate, follow_closed
from nanorom.continuation.branches.trace import Tracer
from nanorom.continuation.diagrams.diagram import Branch, Diagram, SpecialPoint
from nanorom.continuation.diagrams.isolas import is_near
from nanorom.continuation.orbits.floquet import FloquetSolver, sort_multipliers
from nanorom.continuation.orbits.harmonics import forced_support, full_support
from nanorom.continuation.orbits.orbit import (
    Orbit,
    PeriodicOrbit,
    orbit_amplitudes,
    orbit_state,
    same_orbit,
)
from nanorom.continuation.orbits.shooting import Shooting
from nanorom.continuation.points.confirmation import Polished, polish
from nanorom.continuation.points.detection import Detector
from nanorom.continuation.points.switching import Bifurcation, Start
from nanorom.continuation.settings import Settings, check_range
from nanorom.continuation.system import ModalSystem, ScaledSystem, without_round_off
from nanorom.continuation.threads import one_thread
from nanorom.errors import ContinuationError
from nanorom.types import Array

SAME_FREQUENCY = 1e-6


@dataclass(eq=False)
class _Node:
    """A special point waiting for its branch to be followed."""

    point: SpecialPoint
    orbit: Orbit
    path: Path
    generation: int
    switched: bool = False
    reached: bool = False  # by a branch that starts elsewhere


@one_thread()
def explore(
    system: ModalSystem,
    omega: tuple[float, float],
    direct: float = 0.0,
    parametric: float = 0.0,
    *,
    depth: int = 1,
    tolerance: float = 5e-10,
    harmonics: int = 150,
    steps: int = 2000,
    reach: float = 2.0,
    seeds: Sequence[PeriodicOrbit] = (),
    known: Diagram | None = None,
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
        Most steps on one branch.
    reach : float
        A branch that bifurcates is followed to omega[0] / reach and omega[1] * reach.
    seeds : sequence of PeriodicOrbit
        Orbits, say of another level's diagram, that may lie near a branch which is not connected to
        the others (an isola): where an orbit is found there, its branch is followed, too.
    known : Diagram
        The diagram of this level, if it was explored before: only what the seeds lead to is added.

    Returns
    -------
    Diagram

    Raises
    ------
    ContinuationError
        for an invalid range or level, or if no orbit is found at the start of the range.
    """
    low, high = check_range(omega)
    settings = Settings(
        tolerance=tolerance, depth=depth, steps=steps, harmonics=harmonics, reach=reach
    )
    scaled = system.scaled(direct, parametric)
    explorer = _Explorer(scaled, (low, high), settings, (direct, parametric))
    return explorer.run(seeds) if known is None else explorer.extend(known, seeds)


class _Explorer:
    def __init__(
        self,
        scaled: ScaledSystem,
        omega: tuple[float, float],
        settings: Settings,
        levels: tuple[float, float],
    ) -> None:
        self.scaled, self.settings, self.levels = scaled, settings, levels
        low, high = without_round_off(np.array(omega) / scaled.frequency).tolist()
        self.range = (low, high)
        self.floquet = FloquetSolver(scaled, truncation=1e-11)
        self.precise = FloquetSolver(scaled)
        self.shooting = Shooting(scaled)
        self.paths: list[Path] = []
        self.branches: list[Branch] = []
        self.points: list[SpecialPoint] = []
        self.waiting: list[_Node] = []
        self.known: list[Branch] = []  # followed before: their paths are not at hand

    def run(self, seeds: Sequence[PeriodicOrbit] = ()) -> Diagram:
        self._base()
        self._bifurcating()
        return self._with_isolas(seeds)

    def extend(self, diagram: Diagram, seeds: Sequence[PeriodicOrbit]) -> Diagram:
        self.known = list(diagram.branches)
        self.branches, self.points = list(diagram.branches), list(diagram.special_points)
        return self._with_isolas(seeds)

    def _with_isolas(self, seeds: Sequence[PeriodicOrbit]) -> Diagram:
        # of short periods first: they may lead to the others
        for seed in sorted(seeds, key=lambda seed: seed.period_multiple):
            self._isolated(seed)
            self._bifurcating()
        return Diagram(self.branches, self.points, *self.levels)

    def _is_new(self, orbit: Orbit) -> bool:
        given = PeriodicOrbit(
            orbit.coefficients * self.scaled.amplitude,
            orbit.omega * self.scaled.frequency,
            orbit.period_multiple,
        )
        return not any(path.contains(orbit) for path in self.paths) and not any(
            is_near(branch, given) for branch in self.known
        )

    def _bifurcating(self) -> None:
        """Every branch that starts at a special point found so far."""
        while self.scaled.nonlinear:  # otherwise it goes straight up, at one frequency
            node = next(
                (n for n in self.waiting if not n.switched and n.generation < self.settings.depth),
                None,
            )
            if node is None:
                return
            node.switched = True
            self._switch(node)

    def _base(self) -> None:
        """The branch of the response from rest at the low end; if it turns back, also the one from
        the high end.
        """
        low, high = self.range
        tracer = Tracer(self.scaled, forced_support(self.scaled), 1, self.settings)
        try:
            steps = self._steps(tracer, first_orbit(tracer, low), 1.0)
        except ContinuationError:
            other = first_orbit(tracer, high)
        else:
            self._register(tracer, steps, None, 0)
            end = self._end(tracer, steps)
            try:
                other = first_orbit(tracer, high)
            except ContinuationError:
                return
            if abs(end.rate - high) < 1e-9 * high and same_orbit(end, other):
                return
        self._register(tracer, self._steps(tracer, other, -1.0), None, 0)

    def _steps(self, tracer: Tracer, orbit: Orbit, direction: float) -> list[Series]:
        steps = list(tracer.follow(orbit, direction, self.range))
        if not steps:
            raise ContinuationError(
                "the harmonics of the first orbit do not converge; raise `harmonics`, "
                "or start the range farther from a resonance"
            )
        return steps

    def _end(self, tracer: Tracer, steps: list[Series]) -> Orbit:
        """Where the branch traced last ends, be it by shooting."""
        if tracer.ending != "harmonics":
            return tracer.orbit(steps[-1], steps[-1].length)
        coefficients, omega = self.branches[-1].coefficients[-1], self.branches[-1].omega[-1]
        return Orbit(coefficients / self.scaled.amplitude, omega / self.scaled.frequency, 1)

    def _isolated(self, seed: PeriodicOrbit) -> None:
        """The branch near an orbit of another level, unless it is there already."""
        p = seed.period_multiple
        rate = seed.omega / self.scaled.frequency / p
        if not self.range[0] < rate * p < self.range[1] and p == 1:
            return
        support = full_support(self.scaled, p)
        if p == 1 and forced_support(self.scaled).holds(seed.coefficients):
            support = forced_support(self.scaled)
        tracer = Tracer(self.scaled, support, p, self.settings)
        try:
            guess = Orbit(seed.coefficients / self.scaled.amplitude, rate, p)
            orbit, _ = tracer.solve(guess, fixed_rate)
        except ContinuationError:
            return
        if _is_shorter(orbit) or not self._is_new(orbit):
            return
        reach = self.settings.reach if p > 1 else 1.0
        rates = (self.range[0] / reach / p, self.range[1] * reach / p)
        steps = follow_closed(tracer, orbit, 1.0, rates)
        if tracer.ending != "closed":  # from end to end
            steps = follow_closed(tracer, orbit, -1.0, rates) or steps
        if not steps:
            return
        if tracer.ending != "closed":
            end = tracer.orbit(steps[-1], steps[-1].length)
            slope = steps[-1].rate_slope(steps[-1].length)
            steps = follow_closed(tracer, end, -1.0 if slope > 0 else 1.0, rates)
        if not steps or self._is_known(tracer, steps):
            return
        self._register(tracer, steps, None, 0 if p == 1 else 1)

    def _is_known(self, tracer: Tracer, steps: list[Series]) -> bool:
        """Whether steps pass through the middle of a branch followed before."""
        path = Path(tracer, self.floquet, steps)
        for branch in self.known:
            middle = branch.orbit(len(branch) // 2)
            rate = middle.omega / self.scaled.frequency / middle.period_multiple
            coefficients = middle.coefficients / self.scaled.amplitude
            if path.contains(Orbit(coefficients, rate, middle.period_multiple)):
                return True
        return False

    def _switch(self, node: _Node) -> None:
        if node.reached and node.point.type == "PD":
            return
        try:
            bifurcation = Bifurcation(
                self.scaled, node.path.tracer.support, node.orbit, node.point.type, self.settings
            )
            p = bifurcation.tracer.period_multiple
            rates = self._rates(p)
            starts = bifurcation.starts(rates)
        except ContinuationError:
            return
        if len(starts) == 1 and node.reached:
            return
        for start in starts:
            certain = len(starts) == 1 and start.before is not None and not self.known
            if certain or self._is_new(start.orbit):
                self._follow(node, bifurcation, start, rates)

    def _rates(self, period_multiple: int) -> tuple[float, float]:
        """How far a branch that bifurcates is followed."""
        low, high = self.range
        reach = self.settings.reach
        return low / reach / period_multiple, high * reach / period_multiple

    def _follow(
        self, node: _Node, bifurcation: Bifurcation, start: Start, rates: tuple[float, float]
    ) -> None:
        """One branch of a bifurcation, to its end."""
        tracer = bifurcation.tracer
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
                    self._mark_end(tracer.orbit(series, end))
                    tracer.ending = "bifurcation"
                    break
        if steps:
            self._register(tracer, steps, node, node.generation + 1, bifurcation)

    def _mark_end(self, end: Orbit) -> None:
        """The pitchfork at which a branch ends needs no branch of its own."""
        for node in self.waiting:
            p = node.orbit.period_multiple
            if (
                abs(node.orbit.omega - end.omega) > SAME_FREQUENCY * end.omega
                or end.period_multiple % p
            ):
                continue
            node.reached = True

    def _register(
        self,
        tracer: Tracer,
        steps: list[Series],
        origin: _Node | None,
        generation: int,
        bifurcation: Bifurcation | None = None,
    ) -> None:
        """Find the special points of a traced branch and add both to the diagram."""
        path = Path(tracer, self.floquet, steps)
        self.paths.append(path)
        detector = Detector(path)
        index = len(self.branches)
        found: list[Polished] = []
        for detected in detector.find():
            polished = polish(path, detected, self.precise, self.shooting)
            exact = detector.located(detected) if polished is None else None
            if exact is not None:
                polished = polish(path, exact, self.precise, self.shooting)
            if polished is not None and not any(polished.is_same(other) for other in found):
                found.append(polished)
        parent = None if origin is None else origin.point.branch
        start = None if origin is None else self.points.index(origin.point)
        self.branches.append(
            self._branch(path, detector.places, detector.eigenvalues, parent, start)
        )
        extent = bifurcation.extent(steps) if bifurcation else 0.0
        taken_over: list[SpecialPoint] = []
        if tracer.ending == "harmonics":
            taken_over = self._take_over(
                path,
                index,
                lambda orbit: bifurcation is not None and bifurcation.is_end(orbit, extent),
            )
        for polished in found:
            if bifurcation and polished.type in ("LP", "BP"):
                if bifurcation.is_end(polished.orbit, extent):
                    continue
            point = self._special_point(polished, index)
            self.points.append(point)
            if point.type in ("PD", "BP"):
                self.waiting.append(_Node(point, polished.orbit, path, generation))
        self.points += taken_over

    def _take_over(
        self, path: Path, index: int, is_end: Callable[[Orbit], bool]
    ) -> list[SpecialPoint]:
        """Go on by shooting where the harmonics do not suffice; branches do not switch there."""
        tracer, last = path.tracer, path.steps[-1]
        p = tracer.period_multiple
        reach = self.settings.reach if p > 1 else 1.0
        rates = (self.range[0] / reach / p, self.range[1] * reach / p)
        shooting = Takeover(self.scaled, p)
        ends = tracer.orbit(last, 0.9 * last.length), tracer.orbit(last, last.length)
        points, special, ending = shooting.follow(*ends, rates, self.settings.steps, is_end)
        branch = self.branches[index]
        branch.ending = ending
        if points:
            orbits = [shooting.orbit(point) for point in points]
            multipliers = sort_multipliers(np.array([point.multipliers for point in points]))
            unit = self.scaled.amplitude
            omega = np.array([point.omega for point in points]) * self.scaled.frequency
            amplitude = np.array([shooting.amplitudes(point) for point in points]) * unit
            branch.omega = np.append(branch.omega, omega)
            branch.amplitude = np.vstack([branch.amplitude, amplitude])
            branch.multipliers = np.vstack([branch.multipliers, multipliers])
            branch.stable = np.append(branch.stable, np.abs(multipliers[:, 0]) < 1.0)
            branch.coefficients += [orbit.coefficients * unit for orbit in orbits]
        return [
            self._special_point(Polished(kind, shooting.orbit(point), point.multipliers), index)
            for kind, point in special
        ]

    def _multipliers(self, path: Path, eigenvalues: Array) -> Array:
        return sort_multipliers(eigenvalues**2 if path.symmetric else eigenvalues)

    def _branch(
        self,
        path: Path,
        places: list[Place],
        eigenvalues: Array,
        parent: int | None,
        origin: int | None,
    ) -> Branch:
        orbits = [path.orbit(place) for place in places]
        amplitude = np.empty((len(orbits), self.scaled.size))
        sizes = np.array([len(orbit.coefficients) for orbit in orbits])
        for size in np.unique(sizes):
            members = np.flatnonzero(sizes == size)
            amplitude[members] = orbit_amplitudes(
                np.stack([orbits[i].coefficients for i in members])
            )
        multipliers = self._multipliers(path, eigenvalues)
        unit = self.scaled.amplitude
        return Branch(
            omega=np.array([orbit.omega for orbit in orbits]) * self.scaled.frequency,
            amplitude=amplitude * unit,
            stable=np.abs(multipliers[:, 0]) < 1.0,
            multipliers=multipliers,
            period_multiple=path.tracer.period_multiple,
            parent=parent,
            origin=origin,
            coefficients=[orbit.coefficients * unit for orbit in orbits],
            ending=path.tracer.ending,
        )

    def _special_point(self, polished: Polished, index: int) -> SpecialPoint:
        unit, orbit = self.scaled.amplitude, polished.orbit
        state = orbit_state(orbit) * unit
        state[self.scaled.size :] *= self.scaled.frequency
        return SpecialPoint(
            type=polished.type,
            omega=orbit.omega * self.scaled.frequency,
            amplitude=orbit_amplitudes(orbit.coefficients[None])[0] * unit,
            multipliers=sort_multipliers(polished.multipliers),
            state=state,
            branch=index,
            period_multiple=orbit.period_multiple,
            coefficients=orbit.coefficients * unit,
        )


def _is_shorter(orbit: Orbit) -> bool:
    """Whether an orbit of period_multiple > 1 has the period of the drive after all."""
    numbers = (np.arange(len(orbit.coefficients)) + 1) // 2
    part = np.abs(orbit.coefficients[numbers % orbit.period_multiple != 0]).max(initial=0.0)
    scale = np.abs(orbit.coefficients).max(initial=0.0)
    return orbit.period_multiple > 1 and bool(part <= 1e-6 * scale)
