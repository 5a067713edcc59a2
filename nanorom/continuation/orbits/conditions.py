"""What becomes critical at a bifurcation of periodic orbits, and the functions that vanish there.

    turn            d rate / da = 0 along the branch
    multiplier -1   prod (mu_i + 1) = 0
    multiplier 1    prod (mu_i - 1) / (d rate / da) = 0: a fold next to it is none of its zeros
    on the circle   prod_{i<j} (mu_i mu_j - 1) = 0 at a complex pair

Source: Kuznetsov, Elements of Applied Bifurcation Theory, section 10.2 (test functions).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable

import attrs
import numpy as np

from nanorom.continuation.arrays import slices
from nanorom.continuation.orbits.pairs import Index
from nanorom.errors import ContinuationError
from nanorom.types import Array, Numbers

NEAR = 0.2  # distance of two real multipliers that may be a complex pair nearby
ALIKE = 1e-4  # imaginary part of a real multiplier that another one comes close to
REAL = 1e-9  # imaginary part below which a multiplier is a real one
FAR_OUTSIDE = 1.02  # a real multiplier that no complex pair was an instant before
TINY = 1e-300  # keeps the logarithm of zero finite

Critical = Callable[[Numbers, float], float]


class Condition(ABC):
    """What a kind of bifurcation is told by, from multipliers (2L,) of a period.

    multipliers : how many are critical at once
    conjugate : the critical ones are a complex pair, whose angle nobody knows before
    by_slope : at a fold a multiplier is the same, and the slope of the rate tells it from one
    growth : log modulus of the critical ones
    """

    multipliers = 1
    conjugate = False
    by_slope = False
    growth = 0.0

    def candidates(self, multipliers: Numbers) -> Numbers:
        """Those that may be critical."""
        return multipliers

    @abstractmethod
    def distances(self, multipliers: Numbers) -> Array:
        """Of the candidates from where they belong."""

    def nearest(self, multipliers: Numbers) -> complex:
        """The one that is critical, or next to it."""
        return complex(self.candidates(multipliers)[self.distances(multipliers).argmin()])

    def second_frequency(self, multipliers: Numbers) -> tuple[float, ...]:
        """Of the motion of a critical pair, by the rate of the orbit; none of a real multiplier."""
        if not self.conjugate:
            return ()
        return (float(np.angle(self.nearest(multipliers)) / (2 * np.pi)),)

    @abstractmethod
    def crossing(self, multipliers: Numbers) -> float:
        """A number that changes sign where it happens."""

    @abstractmethod
    def test(
        self, eigenvalues: Numbers, slopes: Array, pairs: tuple[Index, Index]
    ) -> tuple[Array, Array]:
        """Sign and log modulus of the test function at points with eigenvalues (n, 2L) and slopes
        (n,) of the rate; `pairs` of eigenvalues that belong to the same modes.
        """

    def impostor(self, multipliers: Numbers) -> float:
        """How near those are for which the test function vanishes though nothing is critical."""
        return np.inf

    @abstractmethod
    def critical(self, symmetric: bool, multiplicity: int = 1) -> Critical:
        """A smooth function of the eigenvalues (2L,) and the slope of the rate that is zero at the
        point.

        A product, not the critical eigenvalue itself: that is not smooth where it meets another
        one. Of several that are critical at once, their mean: the product has no change of sign
        there.  On a symmetric orbit the eigenvalues are those of half a period.
        """

    @abstractmethod
    def among(self, nearest: Numbers) -> Numbers:
        """Which of the eigenvalues next to the circle cross it in this way."""

    def is_spurious(self, before: Numbers, after: Numbers) -> bool:
        """Whether the test function changes sign between two points for another reason."""
        return False


@attrs.frozen
class At(Condition):
    """A multiplier is 1 or -1.

    by_slope : the rate does not turn there.
    """

    target: float
    by_slope: bool = False

    def distances(self, multipliers: Numbers) -> Array:
        return np.asarray(np.abs(multipliers - self.target))

    def crossing(self, multipliers: Numbers) -> float:
        """Sign and size of det(M - target I), damped: large multipliers do not hide its zero."""
        values = multipliers - self.target
        return float(np.prod(values / (1 + np.abs(values))).real)

    def test(
        self, eigenvalues: Numbers, slopes: Array, pairs: tuple[Index, Index]
    ) -> tuple[Array, Array]:
        signs, logs = signed_log_product(eigenvalues - self.target)
        if self.by_slope:
            signs = signs * np.where(slopes >= 0, 1.0, -1.0)
            logs = logs - np.log(np.maximum(np.abs(slopes), TINY))
        return signs, logs

    def critical(self, symmetric: bool, multiplicity: int = 1) -> Critical:
        chosen: dict[str, float] = {}

        def target(eigenvalues: Numbers) -> float:
            if not chosen:
                flips = self.target < 0 or (symmetric and _nearer_flip(eigenvalues))
                chosen["target"] = -1.0 if flips else 1.0
                factors = np.sort(np.abs(eigenvalues - chosen["target"]))
                chosen["unit"] = float(np.prod(factors[1:]))
            return chosen["target"]

        def mean(eigenvalues: Numbers, slope: float) -> float:
            gaps = eigenvalues - target(eigenvalues)
            return float(gaps[np.argsort(np.abs(gaps))[:multiplicity]].mean().real)

        def product(eigenvalues: Numbers, slope: float) -> float:
            at = target(eigenvalues)
            value = float(np.prod(eigenvalues - at).real) / chosen["unit"]
            if at < 0 or symmetric:
                return value
            if slope == 0:
                raise ContinuationError("a fold at the very place")
            return value / slope

        return mean if multiplicity > 1 else product

    def among(self, nearest: Numbers) -> Numbers:
        real = np.abs(nearest.imag) < ALIKE
        return np.asarray(real & (nearest.real * self.target > 0))


@attrs.frozen
class OnCircle(Condition):
    """A complex pair has modulus 1."""

    multipliers = 2
    conjugate = True

    def candidates(self, multipliers: Numbers) -> Numbers:
        return multipliers[multipliers.imag > REAL]

    def distances(self, multipliers: Numbers) -> Array:
        return np.asarray(np.abs(np.abs(self.candidates(multipliers)) - 1))

    def crossing(self, multipliers: Numbers) -> float:
        outside = (np.abs(multipliers.imag) > REAL) & (np.abs(multipliers) > 1)
        return float(outside.sum() // 2) - 0.5

    def test(
        self, eigenvalues: Numbers, slopes: Array, pairs: tuple[Index, Index]
    ) -> tuple[Array, Array]:
        first, second = pairs
        signs, logs = np.empty((2, len(eigenvalues)))
        for some in slices(len(eigenvalues), len(first)):
            here = eigenvalues[some]
            signs[some], logs[some] = signed_log_product(here[:, first] * here[:, second] - 1.0)
        return signs, logs

    def impostor(self, multipliers: Numbers) -> float:
        """Of a neutral saddle: a real pair with product one, of which one is far outside."""
        real = multipliers[np.abs(multipliers.imag) <= REAL].real
        products = np.multiply.outer(real[np.abs(real) > FAR_OUTSIDE], real)
        return float(np.abs(products - 1).min(initial=np.inf))

    def critical(self, symmetric: bool, multiplicity: int = 1) -> Critical:
        def mean(eigenvalues: Numbers, slope: float) -> float:
            logs = np.log(np.abs(eigenvalues[eigenvalues.imag > REAL]))
            return float(logs[np.argsort(np.abs(logs))[:multiplicity]].mean())

        def growth(eigenvalues: Numbers, slope: float) -> float:
            return _pair_growth(eigenvalues)

        return mean if multiplicity > 1 else growth

    def among(self, nearest: Numbers) -> Numbers:
        return np.asarray(~(np.abs(nearest.imag) < ALIKE))

    def is_spurious(self, before: Numbers, after: Numbers) -> bool:
        """Whether real pairs with product one alone, neutral saddles, change the sign."""

        def split(values: Numbers) -> tuple[int, int, int]:
            # a real pair may turn complex, cross the circle and be real again
            complex_ones, outside = np.abs(values.imag) > REAL, np.abs(values) > 1
            return complex_ones.sum(), (complex_ones & outside).sum(), outside.sum()

        return split(before) == split(after)


def signed_log_product(factors: Numbers) -> tuple[Array, Array]:
    """Sign and log modulus of the (real) product over the last axis."""
    logs = np.log(np.maximum(np.abs(factors), TINY)).sum(axis=-1)
    signs = np.where(np.cos(np.angle(factors).sum(axis=-1)) >= 0, 1.0, -1.0)
    return signs, logs


def _nearer_flip(eigenvalues: Numbers) -> bool:
    return bool(np.abs(eigenvalues + 1).min() < np.abs(eigenvalues - 1).min())


def _pair_growth(eigenvalues: Numbers) -> float:
    """log |mu_1 mu_2| of the pair closest to the circle: conjugates, or the real pair they
    become.
    """
    pairs = eigenvalues[eigenvalues.imag > REAL]
    products = list(np.abs(pairs) ** 2)
    real = np.sort(eigenvalues.real[np.abs(eigenvalues.imag) <= REAL])
    products += [a * b for a, b in zip(real[:-1], real[1:]) if a * b > 0 and b - a < NEAR]
    if not products:
        raise ContinuationError("no complex pair in the neighbourhood")
    sizes = np.log(np.array(products))
    return float(sizes[np.abs(sizes).argmin()])
