"""Multiple shooting with Taylor series in time: a discretisation independent of harmonic balance.

The period is cut into segments; each is crossed by one Taylor step (`flow`) of the equations of
motion together with their variational equation, all segments at once. It confirms orbits,
multipliers and special points, and corrects orbits by Newton's method.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import block_diag, eye, kron
from scipy.sparse.linalg import splu

from nanorom.continuation.orbits.flow import TaylorStepper
from nanorom.continuation.orbits.harmonics import differentiate, fourier_matrix
from nanorom.continuation.orbits.orbit import Orbit
from nanorom.continuation.orbits.pairs import Index
from nanorom.continuation.orbits.parts import independent_parts
from nanorom.continuation.orbits.product import product_eigenvalues
from nanorom.continuation.scaled import ScaledSystem
from nanorom.errors import ContinuationError
from nanorom.types import Array

SMALL = 1e-14  # last terms of a segment, relative to the orbit
MOST_SEGMENTS = 7000
STEP_ANGLE = 1.5  # of the fastest mode within a segment
CONVERGED = 1e-12  # of an orbit: the last change of Newton's method
REST = 1e-9  # size of an orbit at rest


@dataclass(frozen=True, eq=False)
class Shot:
    """What shooting says about an orbit: the largest gap between segments, and for each independent
    part of the variational equation its modes and maps (M, 2 Lp, 2 Lp) over the segments.
    """

    defect: float
    parts: list[tuple[Index, Array]]

    @property
    def monodromy(self) -> Array:
        """The matrix (2L, 2L) of the state (q, q') over the period."""
        size = sum(len(modes) for modes, _ in self.parts)
        result = np.zeros((2 * size, 2 * size))
        for modes, maps in self.parts:
            place = np.append(modes, size + modes)
            product = maps[0]
            for step in maps[1:]:
                product = step @ product
            result[np.ix_(place, place)] = product
        return result

    @property
    def multipliers(self) -> Array:
        return np.concatenate([product_eigenvalues(maps) for _, maps in self.parts])


class Shooting:
    """Multiple shooting for the periodic orbits of one system."""

    def __init__(self, system: ScaledSystem) -> None:
        self.system = system
        self.stepper = TaylorStepper(system)
        self._steppers: dict[bytes, TaylorStepper] = {}

    def check(self, orbit: Orbit) -> Shot:
        """Defect and monodromy matrices along an orbit given by its Fourier coefficients.

        Modes whose coefficients are all zero are at rest, where the equations keep them.
        """
        moving = np.flatnonzero(orbit.coefficients.any(axis=0))
        stepper = self._of_moving(moving)
        states = np.append(moving, self.system.size + moving)
        for nodes, phases, duration in self._segments(orbit):
            starts, same = nodes[:, states], np.ones(len(nodes))
            flow = stepper.flow(starts, orbit.omega * same, phases, duration * same)
            if flow.error < SMALL:
                break
        defects = flow.ends - np.roll(starts, -1, axis=0)
        parts = independent_parts(self.system, moving)
        found = [(part.modes, flow.maps(part)) for part in parts]
        return Shot(float(np.abs(defects).max(initial=0.0)), found)

    def _of_moving(self, moving: Index) -> TaylorStepper:
        if len(moving) == self.system.size:
            return self.stepper
        key = moving.tobytes()
        if key not in self._steppers:
            self._steppers[key] = TaylorStepper(self.system.restrict(moving))
        return self._steppers[key]

    def correct(
        self, orbit: Orbit, tolerance: float = CONVERGED, iterations: int = 10
    ) -> tuple[Array, Shot]:
        """Newton's method at fixed frequency: the state (2L,) at phase 0 and what shooting says of
        the orbit.
        """
        nodes, phases, duration = self._nodes(orbit)
        for _ in range(iterations):
            gaps, maps, _ = self._gaps(nodes, phases, duration, orbit.omega)
            change = _cyclic_solve(maps, gaps)
            nodes = nodes + change
            if np.abs(change).max() < tolerance * max(np.abs(nodes).max(), REST):
                gaps, maps, _ = self._gaps(nodes, phases, duration, orbit.omega)
                every = np.arange(self.system.size)
                return nodes[0], Shot(float(np.abs(gaps).max()), [(every, maps)])
        raise ContinuationError("shooting does not converge to a periodic orbit")

    def _nodes(self, orbit: Orbit) -> tuple[Array, Array, float]:
        """States at the starts of the segments (M, 2L), drive phases (M,) and the duration of a
        segment, at which the Taylor series converge.
        """
        for nodes, phases, duration in self._segments(orbit):
            omega, durations = np.full(len(nodes), orbit.omega), np.full(len(nodes), duration)
            if self.stepper.step(nodes, omega, phases, durations, variation=False)[2] < SMALL:
                break
        return nodes, phases, duration

    def _segments(self, orbit: Orbit) -> Iterator[tuple[Array, Array, float]]:
        """As `_nodes`, for more and more segments: once at least, however many that takes."""
        period = 2 * np.pi / orbit.rate
        harmonics = (len(orbit.coefficients) - 1) // 2
        # local frequency at the largest excursion: hardening makes it higher than the linear ones
        fastest = self.stepper.fastest + float(np.abs(orbit.coefficients).sum(axis=0).max())
        count = min(max(8, int(np.ceil(period * fastest / STEP_ANGLE))), MOST_SEGMENTS - 1)
        while count < MOST_SEGMENTS:
            angles = 2 * np.pi / count * np.arange(count)
            table = fourier_matrix(angles, harmonics)
            speed = orbit.rate * (table @ differentiate(orbit.coefficients))
            nodes = np.concatenate([table @ orbit.coefficients, speed], axis=1)
            yield nodes, orbit.period_multiple * angles, period / count
            count = int(1.4 * count) + 1

    def _gaps(
        self, nodes: Array, phases: Array, duration: float, omega: float
    ) -> tuple[Array, Array, float]:
        count = len(nodes)
        ends, maps, error = self.stepper.step(
            nodes, np.full(count, omega), phases, np.full(count, duration)
        )
        assert maps is not None
        return ends - np.roll(nodes, -1, axis=0), maps, error


def _cyclic_solve(maps: Array, gaps: Array) -> Array:
    """Changes d_m of the nodes with maps_m d_m - d_(m+1) = -gaps_m, cyclic."""
    count, size = gaps.shape
    # not condensed to one segment: the product of all maps may be beyond round-off
    matrix = block_diag(list(maps), format="csc") - kron(
        eye(count, format="csc").tocsc()[:, np.arange(count) - 1], eye(size), format="csc"
    )
    try:
        return np.asarray(splu(matrix).solve(-gaps.ravel()).reshape(count, size))
    except RuntimeError:  # SciPy's word for a singular matrix
        raise ContinuationError("shooting does not converge: its matrix is singular") from None
