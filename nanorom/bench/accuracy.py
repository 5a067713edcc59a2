"""True error against the estimate, tolerance by tolerance."""

from __future__ import annotations

from collections.abc import Iterator

import attrs
import numpy as np

from nanorom.bench import measure
from nanorom.exact import cases as exact

KAPPAS = (0.0, 1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6, np.inf)
TOLERANCES = tuple(10.0**-n for n in range(3, 10))
FEW = (1e-4, 1e-6, 1e-8)  # tolerances of the cases beside
ROUNDING = 1e-12  # a thousandth of the smallest tolerance: errors below it are none
SMALLEST, LARGEST = 1 / 3, 100.0  # allowed ratios of estimate and true error


@attrs.frozen
class Claim:
    """What was asked for, found and claimed.

    Of frequencies and of the tensor each the true error, the estimate and their ratio, both at
    least `ROUNDING`; claimed: the tolerance is said to be met; verdict: "ok" or what is wrong.
    """

    case: str
    tolerance: float
    dofs: int
    seconds: float
    error_frequency: float
    estimate_frequency: float
    ratio_frequency: float
    error_tensor: float
    estimate_tensor: float
    ratio_tensor: float
    claimed: bool
    verdict: str


def rows(quick: bool = False) -> Iterator[Claim]:
    """Drums from plate to membrane and to buckling, with few modes and many; square and strings."""
    cases: list[tuple[exact.Case, tuple[float, ...]]]
    if quick:
        cases = [(exact.drum(100.0, count=3), (1e-3, 1e-6)), (exact.square(3), (1e-3, 1e-6))]
    else:
        cases = [(exact.drum(kappa), TOLERANCES) for kappa in KAPPAS]
        cases += [(exact.paper_drum(), TOLERANCES), (exact.square(), TOLERANCES)]
        cases += [(case, FEW) for case in _beside()]
        cases += [(exact.string(), TOLERANCES)]
        cases += [(exact.string(ends="simply_supported"), FEW), (exact.string(model="beam"), FEW)]
    for case, tolerances in cases:
        for tolerance in tolerances:
            yield claim(exact.with_tolerance(case, tolerance), tolerance)


def _beside() -> Iterator[exact.Case]:
    """Drums with one mode and with many, nu = 0.3, unequal tensions, near buckling; a square."""
    for count, kappa in ((1, 0.0), (1, 1e4), (5, 1e3), (20, 10.0), (20, 1e4), (30, 1e3)):
        yield _named(exact.drum(kappa, count), f"{count} modes")
    yield _named(exact.drum(100.0, film=exact.Film(nu=0.3)), "nu = 0.3")
    for kappa, count in ((1.0, 10), (200.0, 20)):
        yield _named(exact.unequal_drum(1.25 * kappa, kappa, count), f"{count} modes")
    for fraction in (0.99, 0.9999):
        yield exact.drum(-fraction * exact.BUCKLING, 3)
    yield _named(exact.square(1), "1 mode")


def _named(case: exact.Case, what: str) -> exact.Case:
    return attrs.evolve(case, name=f"{case.name}, {what}")


def claim(case: exact.Case, tolerance: float) -> Claim:
    """Solve for a tolerance and judge what is claimed."""
    row = measure.reduction(case, repeats=0)
    frequency, tensor = ratios(row)
    claimed = bool(row.estimate <= tolerance)
    return Claim(
        case.name,
        tolerance,
        row.dofs,
        row.seconds,
        row.error_frequency,
        row.estimate_frequency,
        frequency,
        row.error_tensor,
        row.estimate_tensor,
        tensor,
        claimed,
        verdict(row, tolerance, claimed),
    )


def ratios(row: measure.Row) -> tuple[float, float]:
    """Estimate over true error of frequencies and of the tensor, neither below `ROUNDING`."""
    pairs = (
        (row.estimate_frequency, row.error_frequency),
        (row.estimate_tensor, row.error_tensor),
    )
    frequency, tensor = (max(a, ROUNDING) / max(b, ROUNDING) for a, b in pairs)
    return frequency, tensor


def verdict(row: measure.Row, tolerance: float, claimed: bool) -> str:
    """What is wrong with a claim, or "ok"."""
    if np.isnan(row.error):
        return f"refused: {row.note}"
    wrong = []
    if claimed and row.error > tolerance:
        wrong.append("claimed but not met")
    if not claimed and "not met" not in row.note:
        wrong.append("not met, and not said")
    for what, ratio in zip(("frequencies", "tensor"), ratios(row)):
        if ratio < SMALLEST:
            wrong.append(f"estimate of {what} too small")
        if ratio > LARGEST:
            wrong.append(f"estimate of {what} too large")
    return ", ".join(wrong) or ("ok" if claimed else "ok, told that it is not met")
