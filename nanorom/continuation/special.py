"""Special points of a path: smooth test functions, detection without stepping over pairs, location.

    LP  fold                  d rate / da = 0 (roots of a polynomial in every step)
    PD  period doubling       prod (mu_i + 1) = 0
    BP  branch point          prod (mu_i - 1) / (d rate / da) = 0
    NS  Neimark-Sacker        prod_{i<j} (mu_i mu_j - 1) = 0 at a complex pair

On a symmetric orbit the eigenvalues of the half-period map (with the symmetry applied) take the place of the
multipliers: -1 is then the breaking of the symmetry. Source: Kuznetsov, Elements of Applied Bifurcation
Theory, section 10.2 (test functions).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from .path import Path, Place
from .system import Array
from .trace import real_roots

MINIMUM_REFINEMENTS = 8
UNIT_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Detected:
    """A located special point of a path, before it is polished and confirmed."""

    type: str
    place: Place
    eigenvalues: Array


def signed_log_product(factors: Array) -> tuple[Array, Array]:
    """Sign and log modulus of the (real) product over the last axis."""
    sizes = np.abs(factors)
    logs = np.log(np.maximum(sizes, 1e-300)).sum(axis=-1)
    signs = np.where(np.cos(np.angle(factors).sum(axis=-1)) >= 0, 1.0, -1.0)
    return signs, logs


def test_function(kind: str, eigenvalues: Array, slopes: Array) -> tuple[Array, Array]:
    """Sign and log modulus of the test function "flip", "unit" or "torus" at points with eigenvalues (n, 2L)."""
    if kind == "flip":
        return signed_log_product(eigenvalues + 1.0)
    if kind == "unit":
        signs, logs = signed_log_product(eigenvalues - 1.0)
        return signs * np.where(slopes >= 0, 1.0, -1.0), logs - np.log(np.maximum(np.abs(slopes), 1e-300))
    first, second = np.triu_indices(eigenvalues.shape[-1], 1)
    return signed_log_product(eigenvalues[:, first] * eigenvalues[:, second] - 1.0)


class Detector:
    """Finds the special points of one path; the points it evaluates on the way become points of the branch."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.places: list[Place] = []
        self.eigenvalues = np.empty((0, 2 * path.tracer.system.size), dtype=complex)
        self._insert(path.initial_places())

    def _evaluate(self, places: list[Place]) -> tuple[Array, Array]:
        slopes = np.array([self.path.rate_slope(place) for place in places])
        return self.path.maps_eigenvalues(places), slopes

    def _insert(self, places: list[Place]) -> None:
        if not places:
            return
        values = self.path.maps_eigenvalues(places)
        everything = self.places + places
        order = np.argsort([self.path.position(place) for place in everything], kind="stable")
        self.eigenvalues = np.concatenate([self.eigenvalues, values])[order]
        self.places = [everything[i] for i in order]

    def find(self) -> list[Detected]:
        """All special points in order along the path."""
        found = self._folds()
        for kind in ("flip", "unit", "torus"):
            if kind == "torus" and self.path.tracer.system.size < 2:
                continue
            self._refine_minima(kind)
            found += self._roots(kind)
        return sorted(found, key=lambda point: self.path.position(point.place))

    def _tests(self, kind: str) -> tuple[Array, Array, Array]:
        slopes = np.array([self.path.rate_slope(place) for place in self.places])
        signs, logs = test_function(kind, self.eigenvalues, slopes)
        return np.array([self.path.position(place) for place in self.places]), signs, logs

    def _folds(self) -> list[Detected]:
        places = []
        for number, step in enumerate(self.path.steps):
            slope = step.rates[1:] * np.arange(1, len(step.rates))
            curvature = slope[1:] * np.arange(1, len(slope))
            for root in real_roots(slope, step.start, step.length):
                if np.polynomial.polynomial.polyval(root, curvature) != 0:
                    places.append(Place(number, root))
        if not places:
            return []
        values = self.path.maps_eigenvalues(places)
        return [Detected("LP", place, value) for place, value in zip(places, values)]

    def _refine_minima(self, kind: str) -> None:
        """Go down every dip of |test function| that may hide a pair of roots between two points."""
        for _ in range(MINIMUM_REFINEMENTS):
            positions, signs, logs = self._tests(kind)
            wanted = []
            for i in range(1, len(logs) - 1):
                same_sign = signs[i - 1] == signs[i] == signs[i + 1]
                if same_sign and logs[i] < logs[i - 1] and logs[i] < logs[i + 1]:
                    vertex = _vertex(positions[i - 1 : i + 2], logs[i - 1 : i + 2])
                    if vertex is not None:
                        wanted.append(self.path.place(vertex))
            if not wanted:
                return
            self._insert(wanted)

    def _roots(self, kind: str) -> list[Detected]:
        positions, signs, _ = self._tests(kind)
        found = []
        for i in np.flatnonzero(signs[1:] != signs[:-1]):
            place = self._locate(kind, positions[i], positions[i + 1])
            point = self._classify(kind, place) if place is not None else None
            if point is not None:
                found.append(point)
        return found

    def _locate(self, kind: str, low: float, high: float) -> Place | None:
        reference = None

        def value(position: float) -> float:
            nonlocal reference
            eigenvalues, slopes = self._evaluate([self.path.place(position)])
            signs, logs = test_function(kind, eigenvalues, slopes)
            if reference is None:
                reference = logs[0]
            return float(signs[0] * np.exp(np.clip(logs[0] - reference, -600, 600)))

        # stay inside one step: its ends are points of the list
        shift = 1e-12 * (high - low)
        try:
            root = brentq(value, low + shift, high - shift, xtol=1e-15 * max(high, 1.0), rtol=1e-14)
        except ValueError:
            return None
        return self.path.place(float(root))

    def _classify(self, kind: str, place: Place) -> Detected | None:
        """The type of a root, or nothing where the test function vanishes for another reason."""
        eigenvalues = self.path.maps_eigenvalues([place])[0]
        if kind == "flip":
            if np.abs(eigenvalues + 1).min() > UNIT_TOLERANCE:
                return None
            return Detected("BP" if self.path.symmetric else "PD", place, eigenvalues)
        if kind == "unit":
            return Detected("BP", place, eigenvalues) if np.abs(eigenvalues - 1).min() < UNIT_TOLERANCE else None
        complex_ones = eigenvalues[np.abs(eigenvalues.imag) > 1e-7]
        if len(complex_ones) == 0 or np.abs(np.abs(complex_ones) - 1).min() > UNIT_TOLERANCE:
            return None  # a neutral saddle: two real multipliers whose product is one
        return Detected("NS", place, eigenvalues)


def _vertex(positions: Array, logs: Array) -> float | None:
    """Where a parabola through three values has its minimum, if that is worth another point."""
    values = np.exp(np.clip(logs - logs[1], -50, 50))
    left, right = positions[0] - positions[1], positions[2] - positions[1]
    bend = ((values[2] - 1) / right - (values[0] - 1) / left) / (right - left)
    slope = (values[2] - 1) / right - bend * right
    if bend <= 0:
        return None
    vertex = -slope / (2 * bend)
    gain = slope**2 / (4 * bend)
    if gain < 0.3 or abs(vertex) < 1e-3 * (right - left):
        return None
    vertex = float(np.clip(vertex, 0.9 * left, 0.9 * right))
    return float(positions[1] + vertex)
