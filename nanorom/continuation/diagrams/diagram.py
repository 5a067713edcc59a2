"""What `explore` returns: branches and special points in the user's units."""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.continuation.arrays import brief
from nanorom.continuation.orbits.orbit import PeriodicOrbit
from nanorom.types import Array


@attrs.define(eq=False)
class SpecialPoint:
    """A bifurcation of periodic orbits.

    type: code of a row of `orbits.bifurcations`, LP, PD, NS or BP; omega in the user's unit;
    amplitude (L,) = max |q_r| over a period; multipliers (2L,); state (2L,) = (q, dq/dt) at forcing
    phase 0; branch: index of the branch it lies on; coefficients (2H + 1, L) of the orbit, as of a
    `Branch`; multiplicity: how many multipliers (pairs of an NS) are critical at once.
    """

    type: str
    omega: float
    amplitude: Array
    multipliers: Array
    state: Array
    branch: int
    period_multiple: int
    coefficients: Array = attrs.field(repr=False)
    multiplicity: int = 1

    @property
    def frequency(self) -> float:
        """omega / (2 pi): the drive frequency, in Hz where omega is in rad/s."""
        return self.omega / (2 * np.pi)

    @property
    def orbit(self) -> PeriodicOrbit:
        """The periodic orbit at the bifurcation."""
        return PeriodicOrbit(self.coefficients, self.omega, self.period_multiple)

    def of_modes(self, count: int) -> SpecialPoint:
        """The same without what follows the first L = ``count`` coordinates: temperatures, say."""
        size = len(self.amplitude)
        return attrs.evolve(
            self,
            amplitude=self.amplitude[:count],
            state=np.concatenate([self.state[:count], self.state[size : size + count]]),
            coefficients=self.coefficients[:, :count],
        )


@brief
@attrs.define(eq=False)
class Branch:
    """A branch of periodic orbits of period period_multiple * 2 pi / omega, in the system's units.

    omega (n,); amplitude (n, L) = max |q_r| over a period; stable (n,); multipliers (n, 2L),
    largest modulus first; coefficients: Fourier coefficients (2H + 1, L) of each point in theta =
    omega t / period_multiple, ordered 1, cos, sin, cos 2, ...; parent: index of the branch it
    bifurcates from, or None; origin: index of the special point it starts at, or None; ending: why
    it stops ("range", "bifurcation", "closed", "steps", "harmonics", "lost", "unstable"). wave: of
    a system with pairs of equal frequency, whether a pair moves along a line ("standing") or not
    ("travelling"); family: the branch is one of many, turned into each other by a symmetry.
    """

    omega: Array
    amplitude: Array
    stable: Array
    multipliers: Array
    period_multiple: int
    parent: int | None
    origin: int | None
    coefficients: list[Array] = attrs.field(repr=False)
    ending: str = ""
    wave: str = ""
    family: bool = False

    @property
    def frequency(self) -> Array:
        """omega / (2 pi) (n,): the drive frequencies, in Hz where omega is in rad/s."""
        return np.asarray(self.omega) / (2 * np.pi)

    def orbit(self, index: int) -> PeriodicOrbit:
        """The periodic orbit of one point of the branch."""
        return PeriodicOrbit(
            self.coefficients[index], float(self.omega[index]), self.period_multiple
        )

    def of_modes(self, count: int) -> Branch:
        """The same without what follows the first L = ``count`` coordinates."""
        return attrs.evolve(
            self,
            amplitude=self.amplitude[:, :count],
            coefficients=[orbit[:, :count] for orbit in self.coefficients],
        )

    def __len__(self) -> int:
        return len(self.omega)


@attrs.frozen
class Unexplored:
    """What was not followed or not looked for.

    kind: "branch" (one that was not started), "ending" (one that was not followed to its end),
    "start" (no orbit found), "window" (an end of the range at which there are several orbits),
    "point" (a bifurcation that was not confirmed), "isola" (not all were looked for); omega: where,
    in the unit of the user; why: a
    sentence.
    """

    kind: str
    omega: float
    why: str


@attrs.define(eq=False, repr=False)
class Diagram:
    """All branches and special points of one drive level, and what is known to be missing.

    direct, parametric: the level, in units of the system's patterns.
    """

    branches: list[Branch]
    special_points: list[SpecialPoint]
    direct: float = 0.0
    parametric: float = 0.0
    unexplored: list[Unexplored] = attrs.Factory(list)

    def points(self, kind: str | None = None, branch: int | None = None) -> list[SpecialPoint]:
        """Special points of one type and/or one branch."""
        return [
            point
            for point in self.special_points
            if (kind is None or point.type == kind) and (branch is None or point.branch == branch)
        ]

    def of_modes(self, count: int) -> Diagram:
        """The same without states of first order, which follow the L = ``count`` modes."""
        return attrs.evolve(
            self,
            branches=[branch.of_modes(count) for branch in self.branches],
            special_points=[point.of_modes(count) for point in self.special_points],
        )

    def __repr__(self) -> str:
        return str(self)

    def __str__(self) -> str:
        lines = [f"{len(self.branches)} branches, {len(self.special_points)} special points"]
        for number, branch in enumerate(self.branches):
            if branch.family:
                lines.append(f"branch {number}: {branch.wave} waves, one of a family")
        for point in self.special_points:
            amplitude = np.array2string(point.amplitude, precision=4, max_line_width=60)
            lines.append(
                f"{point.type}  omega = {point.omega:.10g}  branch {point.branch}  "
                f"amplitude {amplitude}"
            )
        lines += [f"unexplored, omega = {u.omega:.6g}: {u.why}" for u in self.unexplored]
        return "\n".join(lines)
