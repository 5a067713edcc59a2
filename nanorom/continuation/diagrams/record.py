"""What has been found at one drive level: traced branches become branches of a diagram, with their
special points; what could not be followed is noted.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import attrs
import numpy as np

from nanorom.continuation.arrays import without_round_off
from nanorom.continuation.branches.accuracy import truncation
from nanorom.continuation.branches.path import Path, Place
from nanorom.continuation.branches.series import Series
from nanorom.continuation.branches.shooting_branch import Takeover
from nanorom.continuation.branches.trace import Tracer
from nanorom.continuation.budget import Budget
from nanorom.continuation.diagrams.course import Course
from nanorom.continuation.diagrams.diagram import Branch, Diagram, SpecialPoint, Unexplored
from nanorom.continuation.diagrams.isolas import is_near
from nanorom.continuation.diagrams.reach import within_reach
from nanorom.continuation.orbits.bifurcations import Kind
from nanorom.continuation.orbits.coordinates import generators, wave
from nanorom.continuation.orbits.floquet import FloquetSolver, sort_multipliers
from nanorom.continuation.orbits.orbit import (
    Orbit,
    PeriodicOrbit,
    orbit_amplitudes,
    orbit_state,
)
from nanorom.continuation.orbits.shooting import Shooting
from nanorom.continuation.points.confirmation import Polished, polish, without_shadows
from nanorom.continuation.points.detection import Detector
from nanorom.continuation.points.switching import Bifurcation
from nanorom.continuation.scaled import ScaledSystem
from nanorom.continuation.settings import Settings
from nanorom.types import Array

BUDGET = 2  # most steps of all branches together, by those of one
INNER = (0.25, 0.5, 0.75)  # places on a branch whose orbits tell it from others
LAST_PART = 0.9  # of the last step, where shooting takes the direction from
UNFINISHED = {  # endings of branches that go on
    "lost": "the branch goes on, but could not be followed",
    "harmonics": "the branch goes on, but asks for more harmonics than allowed",
    "unstable": "the branch goes on, of a long period and more unstable than is of use",
    "steps": "the branch goes on after the most steps allowed",
    "work": "the branch goes on; so many harmonics at so many steps are more work than a level may "
    "take; is the drive that strong?",
}


@attrs.define(eq=False)
class Node:
    """A special point that a branch may leave."""

    point: SpecialPoint
    kind: Kind
    multiplicity: int
    orbit: Orbit
    path: Path
    generation: int
    switched: bool = False
    reached: bool = False  # by a branch that starts elsewhere


class Record:
    """Branches and special points of one level, in the units of the model, as they are found."""

    def __init__(
        self,
        scaled: ScaledSystem,
        omega: tuple[float, float],
        settings: Settings,
        watch: Callable[[Course], None] | None = None,
    ) -> None:
        self.budget = Budget(scaled.size)
        self.scaled, self.settings = scaled, replace(settings, budget=self.budget)
        if watch is not None:
            self._tell(watch)
        low, high = without_round_off(np.array(omega) / scaled.frequency).tolist()
        self.range = within_reach(scaled, (low, high))
        self.floquet = FloquetSolver(scaled, truncation(scaled))  # confirmation has a finer one
        self.precise = FloquetSolver(scaled)
        self.shooting = Shooting(scaled)
        self.paths: list[Path] = []
        self.branches: list[Branch] = []
        self.points: list[SpecialPoint] = []
        self.nodes: list[Node] = []
        self.unexplored: list[Unexplored] = []
        self.generators = generators(scaled)
        self.steps = 0  # of all branches
        self.known: list[Branch] = []  # followed before: their paths are not at hand
        if self.range[0] > low:
            self.leave("window", self.range[0], "not followed below, where all follows the drive")

    def _tell(self, watch: Callable[[Course], None]) -> None:
        """Tell after every step what the diagram has come to."""

        def step(rate: float, period_multiple: int) -> None:
            omega = rate * period_multiple * self.scaled.frequency
            watch(Course(len(self.branches), len(self.points), omega))

        self.settings = replace(self.settings, step=step)

    def begin_with(self, diagram: Diagram) -> None:
        """Go on from what was found before."""
        self.known = list(diagram.branches)
        self.branches, self.points = list(diagram.branches), list(diagram.special_points)
        self.unexplored = list(diagram.unexplored)

    @property
    def spent(self) -> bool:
        """Whether the steps of all branches, or their work, are as many as they may be."""
        return self.budget.spent or self.steps >= BUDGET * self.settings.steps

    def diagram(self, direct: float, parametric: float) -> Diagram:
        return Diagram(self.branches, self.points, direct, parametric, self.unexplored)

    def leave(self, kind: str, omega: float, why: object) -> None:
        """Note what is not explored, at a frequency of the scaled system."""
        noted = Unexplored(kind, omega * self.scaled.frequency, str(why))
        if noted not in self.unexplored:
            self.unexplored.append(noted)

    def rates(self, period_multiple: int, bifurcated: bool) -> tuple[float, float]:
        """How far a branch is followed: those that bifurcate may leave the range."""
        low, high = self.range
        reach = self.settings.reach if bifurcated else 1.0
        return low / reach / period_multiple, high * reach / period_multiple

    def is_new(self, orbit: Orbit) -> bool:
        """Whether an orbit lies on no branch found so far."""
        given = self.given(orbit)
        return not any(path.contains(orbit) for path in self.paths) and not any(
            is_near(branch, given) for branch in self.known
        )

    def is_known(self, tracer: Tracer, steps: list[Series]) -> bool:
        """Whether steps are those of a branch followed before, or part of one, or it is part of
        them: one passes through most of three points of the other, for at one of them another
        branch may pass closely, or be at a fold.
        """
        path = Path(tracer, self.floquet, steps)
        path.turned_by(self.generators)
        places = [path.place(part * path.offsets[-1]) for part in INNER]
        orbits = [path.orbit(place) for place in places]
        if any(_passes(other, orbits) for other in self.paths):
            return True
        for branch in (*self.known, *self.branches):
            inner = [branch.orbit(int(len(branch) * part)) for part in INNER]
            if _passes(path, [self.scaled_orbit(orbit) for orbit in inner]):
                return True
        return False

    def response(self, omega: float) -> Array | None:
        """Coefficients (2H + 1, L) of the smallest known orbit of the drive's period at a
        frequency.
        """
        found = [
            path.tracer.orbit(step, root).coefficients
            for path in self.paths
            if path.tracer.period_multiple == 1
            for step in path.steps
            for root in step.crossings(omega)
        ]
        if not found:
            return None
        return found[int(np.argmin([np.linalg.norm(orbit) for orbit in found]))]

    def has_motion(self, periods: int, omega: float) -> bool:
        """Whether a branch of so many periods of the drive has orbits on both sides of a frequency
        of the scaled system.
        """
        found = [branch.omega for branch in self.branches if branch.period_multiple == periods]
        place = omega * self.scaled.frequency
        return any(frequencies.min() <= place <= frequencies.max() for frequencies in found)

    def given(self, orbit: Orbit) -> PeriodicOrbit:
        """An orbit in the units of the model."""
        coefficients = self.scaled.given(orbit.coefficients)
        return PeriodicOrbit(
            coefficients, orbit.omega * self.scaled.frequency, orbit.period_multiple
        )

    def scaled_orbit(self, orbit: PeriodicOrbit) -> Orbit:
        rate = orbit.omega / self.scaled.frequency / orbit.period_multiple
        return Orbit(self.scaled.inner(orbit.coefficients), rate, orbit.period_multiple)

    def end(self, tracer: Tracer, steps: list[Series]) -> Orbit:
        """Where the branch traced last ends, be it by shooting."""
        if tracer.ending != "harmonics":
            return tracer.orbit(steps[-1], steps[-1].length)
        return self.scaled_orbit(self.branches[-1].orbit(-1))

    def add(
        self,
        tracer: Tracer,
        steps: list[Series],
        origin: Node | None,
        generation: int,
        bifurcation: Bifurcation | None = None,
    ) -> None:
        """Find the special points of a traced branch and add both."""
        self.steps += len(steps)
        path = Path(tracer, self.floquet, steps)
        path.turned_by(self.generators)
        self.paths.append(path)
        detector = Detector(path)
        index = len(self.branches)
        found = self._confirmed(path, detector)
        if path.coarse:
            why = f"branch {index}: its multipliers turn faster than they are sampled"
            self.leave("point", path.orbit(path.place(0.0)).omega, why)
        self.branches.append(self._branch(path, detector.places, detector.eigenvalues, origin))
        extent = bifurcation.extent(steps) if bifurcation else 0.0

        def is_end(orbit: Orbit) -> bool:
            return bifurcation is not None and bifurcation.is_end(orbit, extent)

        taken_over: list[SpecialPoint] = []
        if tracer.ending == "harmonics":
            taken_over = self._take_over(path, index, is_end)
        for polished in found:
            if polished.kind.at_ends and is_end(polished.orbit):
                continue
            point = self._special_point(polished, index)
            self.points.append(point)
            if polished.kind.branches:
                node = Node(
                    point, polished.kind, polished.multiplicity, polished.orbit, path, generation
                )
                self.nodes.append(node)
        self.points += taken_over
        branch = self.branches[index]
        if branch.ending in UNFINISHED:
            end = float(branch.omega[-1]) / self.scaled.frequency
            self.leave("ending", end, f"branch {index}: {UNFINISHED[branch.ending]}")

    def _confirmed(self, path: Path, detector: Detector) -> list[Polished]:
        """The special points of a path that stand up to shooting."""
        found: list[Polished] = []
        for detected in detector.find():
            if self.budget.spent_aside:
                why = (
                    "special points from here on are not confirmed: more work than a level may take"
                )
                self.leave("point", path.orbit(detected.place).omega, why)
                break
            self.budget.point(path.steps[detected.place.step].balance.basis.size)
            polished = polish(path, detected, self.precise, self.shooting)
            if polished is None and detected.multiplicity > 1:
                self.leave(
                    "point",
                    path.orbit(detected.place).omega,
                    f"{detected.multiplicity} multipliers cross the circle together "
                    f"({detected.kind.name}), which shooting does not confirm",
                )
            exact = detector.located(detected) if polished is None else None
            if exact is not None:
                polished = polish(path, exact, self.precise, self.shooting)
            if polished is not None and not any(polished.is_same(other) for other in found):
                found.append(polished)
        return without_shadows(found, path)

    def _take_over(
        self, path: Path, index: int, is_end: Callable[[Orbit], bool]
    ) -> list[SpecialPoint]:
        """Go on by shooting where the harmonics do not suffice; branches do not switch there."""
        tracer, last = path.tracer, path.steps[-1]
        p = tracer.period_multiple
        shooting = Takeover(self.scaled, p)
        before, end = (tracer.orbit(last, part * last.length) for part in (LAST_PART, 1.0))
        rates = self.rates(p, p > 1)
        most = min(self.settings.steps, self.budget.shooting)
        points, special, ending = shooting.follow(before, end, rates, most, is_end)
        branch = self.branches[index]
        branch.ending = ending
        if points:
            orbits = [shooting.orbit(point) for point in points]
            multipliers = sort_multipliers(np.array([point.multipliers for point in points]))
            omega = np.array([point.omega for point in points]) * self.scaled.frequency
            amplitude = np.array([shooting.amplitudes(point) for point in points])
            branch.omega = np.append(branch.omega, omega)
            branch.amplitude = np.vstack([branch.amplitude, amplitude])
            branch.multipliers = np.vstack([branch.multipliers, multipliers])
            branch.stable = np.append(branch.stable, np.abs(multipliers[:, 0]) < 1.0)
            branch.coefficients += [self.scaled.given(orbit.coefficients) for orbit in orbits]
        return [
            self._special_point(Polished(kind, shooting.orbit(point), point.multipliers), index)
            for kind, point in special
        ]

    def _branch(
        self, path: Path, places: list[Place], eigenvalues: Array, origin: Node | None
    ) -> Branch:
        orbits = [path.orbit(place) for place in places]
        coefficients = [self.scaled.given(orbit.coefficients) for orbit in orbits]
        multipliers = sort_multipliers(eigenvalues**2 if path.symmetric else eigenvalues)
        stable = np.abs(multipliers[:, 0]) < 1.0
        if path.generators:  # where the path has zeros instead
            multipliers[:, -len(path.generators) :] = 1.0
            multipliers = sort_multipliers(multipliers)
        return Branch(
            omega=np.array([orbit.omega for orbit in orbits]) * self.scaled.frequency,
            amplitude=_amplitudes(coefficients),
            stable=stable,
            multipliers=multipliers,
            period_multiple=path.tracer.period_multiple,
            parent=None if origin is None else origin.point.branch,
            origin=None if origin is None else self.points.index(origin.point),
            coefficients=coefficients,
            ending=path.tracer.ending,
            wave=wave(self.scaled, orbits[len(orbits) // 2].coefficients),
            family=bool(path.generators),
        )

    def _special_point(self, polished: Polished, index: int) -> SpecialPoint:
        orbit = self.given(polished.orbit)
        rate = polished.orbit.rate * self.scaled.frequency
        return SpecialPoint(
            type=polished.kind.code,
            omega=orbit.omega,
            amplitude=_amplitudes([orbit.coefficients])[0],
            multipliers=sort_multipliers(polished.multipliers),
            state=orbit_state(Orbit(orbit.coefficients, rate, orbit.period_multiple)),
            branch=index,
            period_multiple=orbit.period_multiple,
            coefficients=orbit.coefficients,
            multiplicity=polished.multiplicity,
        )


def _passes(path: Path, orbits: list[Orbit]) -> bool:
    """Whether a path passes through most of some orbits."""
    return sum(path.passing(orbit) is not None for orbit in orbits) > len(orbits) // 2


def _amplitudes(coefficients: Sequence[Array]) -> Array:
    """max |q_r| over a period (n, L) of orbits (2H + 1, L), whose H differ."""
    amplitude = np.empty((len(coefficients), coefficients[0].shape[1]))
    sizes = np.array([len(c) for c in coefficients])
    for size in np.unique(sizes):
        members = np.flatnonzero(sizes == size)
        amplitude[members] = orbit_amplitudes(np.stack([coefficients[i] for i in members]))
    return amplitude
