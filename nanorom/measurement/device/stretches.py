"""Stable stretches of branches, at the frequencies of measured rows.

A sweep moves along a stable stretch until its end, mostly a fold, and goes on on another one.
Which one follows is not asked: the rows tell (`rows`).
"""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np
from scipy.interpolate import CubicSpline

from nanorom.continuation import Diagram
from nanorom.continuation.diagrams.diagram import Branch, SpecialPoint
from nanorom.continuation.orbits.bifurcations import FOLD
from nanorom.measurement.device.equations import RowEquations, Terms
from nanorom.types import Array

LEAST_POINTS = 4
SAMPLES = 2000  # of the spline along a stretch, whose values are corrected afterwards
ODD = (1.0, 3.0)  # harmonics of a film that is its own mirror image
ALL = (0.0, 1.0, 2.0, 3.0)
DOUBLED = (0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0)
EVEN_PART = 1e-9  # relative, of harmonics that are there
SAME = 1e-6  # relative, of frequencies: an end of a stretch is this fold


@attrs.frozen(eq=False)
class Stretch:
    """Stable orbits from a lowest to a highest drive frequency.

    omega: (2,) rad/s, its ends; folds: coefficients (h, L) of the orbits that end it, or None where
    it does not end at a fold; open: (2,) whether the range ends there rather than the stretch.
    """

    equations: RowEquations
    omega: Array
    folds: tuple[Array | None, Array | None]
    open: tuple[bool, bool]
    _place: Array
    _states: Array

    @classmethod
    def of(
        cls,
        terms: Terms,
        level: float,
        branch: Branch,
        points: Sequence[SpecialPoint],
        run: slice,
        limits: tuple[float, float],
    ) -> Stretch | None:
        """Of a run of stable points of a branch; None if it is too short to tell."""
        omega = np.array(branch.omega[run])
        if len(omega) < LEAST_POINTS:
            return None
        harmonics = _harmonics(branch.coefficients[run], branch.period_multiple)
        states = np.array(
            [_kept(c, harmonics, branch.period_multiple) for c in branch.coefficients[run]]
        )
        equations = RowEquations(terms, harmonics, level)
        if omega[-1] < omega[0]:
            omega, states = omega[::-1], states[::-1]
        ends: list[Array | None] = [None, None]
        near = list(points)
        for end, sign in ((0, -1), (1, 1)):
            at = omega[0] if end == 0 else omega[-1]
            next_to = abs(omega[1] - omega[0]) if end == 0 else abs(omega[-1] - omega[-2])
            own = [p for p in near if abs(p.omega - at) <= max(next_to, SAME * at)]
            if not own:
                continue
            fold = min(own, key=lambda p: abs(p.omega - at))
            state = _kept(fold.coefficients, harmonics, branch.period_multiple)
            ends[end] = state
            inside = (fold.omega - omega) * sign > SAME * at
            omega, states = omega[inside], states[inside]
            added = np.array([fold.omega]), state[None]
            pairs = (added[0], omega), (added[1], states)
            omega, states = (np.concatenate(p if end == 0 else p[::-1]) for p in pairs)
        rising = np.append(True, omega[1:] > np.maximum.accumulate(omega)[:-1])
        omega, states = omega[rising], states[rising]
        if len(omega) < LEAST_POINTS:
            return None
        opened = [abs(at - limit) < 1e-3 * at for at, limit in zip(omega[[0, -1]], limits)]
        return cls(
            equations,
            omega[[0, -1]],
            (ends[0], ends[1]),
            (ends[0] is None and opened[0], ends[1] is None and opened[1]),
            *_splined(equations, omega, states),
        )

    def at(self, omega: Array) -> tuple[Array, Array]:
        """Orbits (n, h, L) at rates (n,), and the rates: of the nearer end beyond the ends."""
        inside = np.clip(omega, *self.omega)
        n, count = len(omega), self._states.shape[1:]
        flat = self._states.reshape(len(self._place), -1)
        place = np.searchsorted(self._place, inside).clip(1, len(self._place) - 1)
        low, high = self._place[place - 1], self._place[place]
        part = ((inside - low) / np.maximum(high - low, 1e-300))[:, None]
        guess = ((1 - part) * flat[place - 1] + part * flat[place]).reshape(n, *count)
        rate = inside / self.equations.frequency
        beyond = inside != omega
        found = self.equations.corrected(guess / self.equations.unit, rate)
        for end, state in enumerate(self.folds):
            if state is not None:
                at_end = beyond & (inside == self.omega[end])
                found[at_end] = state / self.equations.unit
        return found, rate


def stretches(
    terms: Terms, level: float, diagram: Diagram, limits: tuple[float, float]
) -> list[Stretch]:
    """All stable stretches of a diagram; limits: range in rad/s in which it was explored."""
    found = []
    for number, branch in enumerate(diagram.branches):
        folds = diagram.points(FOLD.code, number)
        stable = np.asarray(branch.stable, dtype=bool)
        edges = np.flatnonzero(np.diff(np.concatenate([[0], stable.astype(int), [0]])))
        for start, stop in zip(edges[::2], edges[1::2]):
            turns = np.sign(np.diff(branch.omega[start:stop]))
            cuts = [start, *(start + 1 + np.flatnonzero(np.diff(turns) != 0)), stop]
            for a, b in zip(cuts, cuts[1:]):
                own = Stretch.of(terms, level, branch, folds, slice(int(a), int(b)), limits)
                if own is not None:
                    found.append(own)
    return found


def _harmonics(coefficients: Sequence[Array], multiple: int) -> tuple[float, ...]:
    if multiple > 1:
        return DOUBLED
    largest = max(float(np.abs(c).max()) for c in coefficients)
    even = max(float(np.abs(_numbered(c, 0)).max()) for c in coefficients)
    second = max(float(np.abs(_numbered(c, 2)).max(initial=0.0)) for c in coefficients)
    return ODD if max(even, second) < EVEN_PART * largest else ALL


def _numbered(coefficients: Array, number: int) -> Array:
    """The rows of a harmonic, counted in that of the orbit's period."""
    rows = slice(0, 1) if number == 0 else slice(2 * number - 1, 2 * number + 1)
    return coefficients[rows]


def _kept(coefficients: Array, harmonics: tuple[float, ...], multiple: int) -> Array:
    """Coefficients (h, L) of some harmonics of the drive; zeros where an orbit has none."""
    parts = []
    for number in harmonics:
        index = number * multiple
        own = _numbered(coefficients, int(index)) if index == int(index) else coefficients[:0]
        rows = 1 if number == 0 else 2
        empty = np.zeros((rows, coefficients.shape[1]))
        parts.append(own if len(own) == rows else empty)
    return np.concatenate(parts)


def _splined(equations: RowEquations, omega: Array, states: Array) -> tuple[Array, Array]:
    """Frequencies (m,), rising, and states (m, h, L) of a spline by the length of the way."""
    flat = states.reshape(len(states), -1) / max(float(np.abs(states).max()), 1e-300)
    width = float(np.max(equations.terms.damping))
    steps = np.hypot(np.diff(omega) / width, np.linalg.norm(np.diff(flat, axis=0), axis=1))
    way = np.append(0.0, np.cumsum(np.maximum(steps, 1e-12)))
    table = np.column_stack([omega, states.reshape(len(states), -1)])
    fine = np.unique(np.concatenate([np.linspace(0, way[-1], SAMPLES), way]))
    found = CubicSpline(way, table)(fine)
    rising = np.append(True, found[1:, 0] > np.maximum.accumulate(found[:, 0])[:-1])
    inside = rising & (found[:, 0] >= omega[0]) & (found[:, 0] <= omega[-1])
    return found[inside, 0], found[inside, 1:].reshape(-1, *states.shape[1:])
