"""The whole bifurcation diagram of one drive level by one call."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nanorom.errors import ContinuationError

from .diagram import Branch, Diagram, SpecialPoint
from .floquet import FloquetSolver, sort_multipliers
from .harmonics import forced_support
from .path import Path, Place, orbit_amplitudes, orbit_state
from .polish import Polished, polish
from .series import Series
from .shooting import Shooting
from .special import Detector
from .switching import Bifurcation, first_orbit
from .system import Array, ModalSystem, ScaledSystem
from .trace import Orbit, Settings, Tracer

SAME_POINT = 1e-6


@dataclass(eq=False)
class _Node:
    """A special point waiting for its branch to be followed."""

    point: SpecialPoint
    orbit: Orbit
    path: Path
    generation: int
    switched: bool = False


def explore(
    system: ModalSystem,
    omega: tuple[float, float],
    direct: float = 0.0,
    parametric: float = 0.0,
    *,
    depth: int = 1,
    tolerance: float = 1e-9,
    harmonics: int = 150,
    steps: int = 2000,
    reach: float = 2.0,
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
    return _Explorer(
        system, system.scaled(direct, parametric), (low, high), settings, (direct, parametric)
    ).run()


def check_range(omega: tuple[float, float]) -> tuple[float, float]:
    """The range as two floats; raises ContinuationError unless positive, finite and rising."""
    try:
        low, high = (float(value) for value in omega)
    except (TypeError, ValueError):
        raise ContinuationError("omega: give the range as (low, high)") from None
    if not (np.isfinite(low) and np.isfinite(high) and 0 < low < high):
        raise ContinuationError(
            f"omega: range ({low:g}, {high:g}) must be positive, finite and rising"
        )
    return low, high


class _Explorer:
    def __init__(
        self,
        system: ModalSystem,
        scaled: ScaledSystem,
        omega: tuple[float, float],
        settings: Settings,
        levels: tuple[float, float],
    ) -> None:
        self.system, self.scaled, self.settings, self.levels = system, scaled, settings, levels
        self.range = (omega[0] / scaled.frequency, omega[1] / scaled.frequency)
        self.floquet = FloquetSolver(scaled, truncation=1e-9)
        self.precise = FloquetSolver(scaled)
        self.shooting = Shooting(scaled)
        self.branches: list[Branch] = []
        self.points: list[SpecialPoint] = []
        self.waiting: list[_Node] = []

    def run(self) -> Diagram:
        self._base()
        while True:
            node = next(
                (n for n in self.waiting if not n.switched and n.generation < self.settings.depth),
                None,
            )
            if node is None:
                return Diagram(self.branches, self.points, *self.levels)
            node.switched = True
            self._switch(node)

    def _base(self) -> None:
        """The branch of the response from rest at the low end; if it turns back, also the one from
        the high end.
        """
        low, high = self.range
        tracer = Tracer(self.scaled, forced_support(self.scaled), 1, self.settings)
        steps = list(tracer.follow(first_orbit(tracer, low), 1.0, self.range))
        self._register(tracer, steps, None, 0)
        end = tracer.orbit(steps[-1], steps[-1].length)
        other = first_orbit(tracer, high)
        if abs(end.rate - high) > 1e-9 * high or not _same_orbit(end, other):
            self._register(tracer, list(tracer.follow(other, -1.0, self.range)), None, 0)

    def _switch(self, node: _Node) -> None:
        try:
            bifurcation = Bifurcation(
                self.scaled, node.path.tracer.support, node.orbit, node.point.type, self.settings
            )
            orbit, direction = bifurcation.start()
        except ContinuationError:
            return
        p = bifurcation.tracer.period_multiple
        rates = (self.range[0] / self.settings.reach / p, self.range[1] * self.settings.reach / p)
        steps: list[Series] = []
        for series in bifurcation.tracer.follow(orbit, direction, rates):
            if not steps:
                bifurcation.begin(series)
            end = bifurcation.end(series)
            if end is not None:
                series.length = end
            steps.append(series)
            if end is not None:
                self._mark_end(bifurcation, bifurcation.tracer.orbit(series, end))
                bifurcation.tracer.ending = "bifurcation"
                break
        self._register(bifurcation.tracer, steps, node, node.generation + 1, bifurcation)

    def _mark_end(self, bifurcation: Bifurcation, end: Orbit) -> None:
        """The point at which a branch ends needs no branch of its own."""
        for node in self.waiting:
            p = node.orbit.period_multiple
            if (
                abs(node.orbit.omega - end.omega) > SAME_POINT * end.omega
                or end.period_multiple % p
            ):
                continue
            node.switched = True

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
        detector = Detector(path)
        index = len(self.branches)
        found = [polish(path, d, self.precise, self.shooting) for d in detector.find()]
        parent = None if origin is None else origin.point.branch
        start = None if origin is None else self.points.index(origin.point)
        self.branches.append(
            self._branch(path, detector.places, detector.eigenvalues, parent, start)
        )
        extent = bifurcation.extent(steps) if bifurcation else 0.0
        for polished in found:
            if polished is None:
                continue
            if bifurcation and polished.type in ("LP", "BP"):
                if bifurcation.is_end(polished.orbit, extent):
                    continue
            point = self._special_point(polished, index)
            self.points.append(point)
            if point.type in ("PD", "BP"):
                self.waiting.append(_Node(point, polished.orbit, path, generation))

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


def _same_orbit(first: Orbit, second: Orbit) -> bool:
    rows = min(len(first.coefficients), len(second.coefficients))
    gap = np.abs(first.coefficients[:rows] - second.coefficients[:rows]).max(initial=0.0)
    return bool(gap < SAME_POINT * max(np.abs(second.coefficients).max(initial=0.0), 1e-9))
