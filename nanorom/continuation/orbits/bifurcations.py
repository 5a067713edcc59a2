"""Bifurcations of periodic orbits: kinds, and the test functions that vanish there."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from nanorom.errors import ContinuationError
from nanorom.types import Array, Numbers

SPECIAL_POINTS = {
    "LP": "fold",
    "PD": "period doubling",
    "NS": "Neimark-Sacker",
    "BP": "branch point",
}


def signed_log_product(factors: Numbers) -> tuple[Array, Array]:
    """Sign and log modulus of the (real) product over the last axis."""
    sizes = np.abs(factors)
    logs = np.log(np.maximum(sizes, 1e-300)).sum(axis=-1)
    signs = np.where(np.cos(np.angle(factors).sum(axis=-1)) >= 0, 1.0, -1.0)
    return signs, logs


def test_function(kind: str, eigenvalues: Numbers, slopes: Array) -> tuple[Array, Array]:
    """Sign and log modulus of the test function "flip", "unit" or "torus" at points with
    eigenvalues (n, 2L).
    """
    if kind == "flip":
        return signed_log_product(eigenvalues + 1.0)
    if kind == "unit":
        signs, logs = signed_log_product(eigenvalues - 1.0)
        return signs * np.where(slopes >= 0, 1.0, -1.0), logs - np.log(
            np.maximum(np.abs(slopes), 1e-300)
        )
    first, second = np.triu_indices(eigenvalues.shape[-1], 1)
    return signed_log_product(eigenvalues[:, first] * eigenvalues[:, second] - 1.0)


CONFIRMED = 1e-7
NEAR = 0.2  # distance of two real multipliers that may be a complex pair nearby


def critical_distance(kind: str, multipliers: Array) -> float:
    """Distance of the critical multiplier from where the type of bifurcation wants it."""
    if kind == "PD":
        return float(np.abs(multipliers + 1).min())
    if kind == "NS":
        complex_ones = multipliers[np.abs(multipliers.imag) > 1e-9]
        return float(np.abs(np.abs(complex_ones) - 1).min(initial=np.inf))
    return float(np.abs(multipliers - 1).min())


def test_value(kind: str, symmetric: bool) -> Callable[[Array, float], float]:
    """A smooth function of the eigenvalues (2L,) and the slope of the rate that is zero at the
    point.

    A product, not the critical eigenvalue itself: that is not smooth where it meets another one.
    """
    chosen: dict[str, float] = {}

    def torus(eigenvalues: Numbers, slope: float) -> float:
        return _pair_growth(eigenvalues)

    def at_target(eigenvalues: Numbers, slope: float) -> float:
        if not chosen:
            flip, unit = (np.abs(eigenvalues - target).min() for target in (-1.0, 1.0))
            chosen["target"] = -1.0 if kind == "PD" or (symmetric and flip < unit) else 1.0
            factors = np.sort(np.abs(eigenvalues - chosen["target"]))
            chosen["unit"] = float(np.prod(factors[1:]))
        value = float(np.prod(eigenvalues - chosen["target"]).real) / chosen["unit"]
        if chosen["target"] < 0 or symmetric:
            return value
        if slope == 0:
            raise ContinuationError("a fold at the very place")
        return value / slope  # a fold next to a branch point is none of its zeros

    return torus if kind == "NS" else at_target


def _pair_growth(eigenvalues: Numbers) -> float:
    """log |mu_1 mu_2| of the pair closest to the circle: conjugates, or the real pair they
    become.
    """
    pairs = eigenvalues[eigenvalues.imag > 1e-9]
    products = list(np.abs(pairs) ** 2)
    real = np.sort(eigenvalues.real[np.abs(eigenvalues.imag) <= 1e-9])
    products += [a * b for a, b in zip(real[:-1], real[1:]) if a * b > 0 and b - a < NEAR]
    if not products:
        raise ContinuationError("no complex pair in the neighbourhood")
    sizes = np.log(np.array(products))
    return float(sizes[np.abs(sizes).argmin()])


def determinant(multipliers: Array, at: float) -> float:
    """Sign and size of det(M - at I), damped so that large multipliers do not hide its zero."""
    values = multipliers - at
    return float(np.prod(values / (1 + np.abs(values))).real)
