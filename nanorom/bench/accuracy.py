"""True error against the estimate, tolerance by tolerance."""

from __future__ import annotations

from collections.abc import Iterator

import attrs
import numpy as np

from nanorom.bench import exact, measure

KAPPAS = (0.0, 1.0, 100.0, 1e4, 1e5, 1e6, np.inf)
TOLERANCES = tuple(10.0**-n for n in range(3, 10))
ROUNDING = 1e-11  # a hundredth of the smallest tolerance: errors below it are none
SMALLEST, LARGEST = 1 / 3, 100.0  # allowed ratios of estimate and true error


@attrs.frozen
class Claim:
    """What was asked for, found and claimed.

    error: true, the larger of frequencies and tensor; ratio: estimate over error; claimed: the
    tolerance is said to be met; verdict: "ok" or what is wrong.
    """

    case: str
    tolerance: float
    dofs: int
    seconds: float
    error_frequency: float
    error_tensor: float
    estimate: float
    ratio: float
    claimed: bool
    verdict: str


def rows(quick: bool = False) -> Iterator[Claim]:
    """Drums from plate to membrane, square and strings."""
    tolerances = (1e-3, 1e-6) if quick else TOLERANCES
    if quick:
        cases = [exact.drum(100.0, count=3), exact.square(count=3)]
    else:
        cases = [exact.drum(kappa) for kappa in KAPPAS]
        cases += [exact.paper_drum(), exact.square()]
        cases += [exact.string(), exact.string(ends="simply_supported")]
        cases += [exact.string(model="beam")]
    for case in cases:
        for tolerance in tolerances:
            yield claim(exact.with_tolerance(case, tolerance), tolerance)


def claim(case: exact.Case, tolerance: float) -> Claim:
    """Solve for a tolerance and judge what is claimed."""
    row = measure.reduction(case, repeats=1)
    ratio = max(row.estimate, ROUNDING) / max(row.error, ROUNDING)
    claimed = bool(row.estimate <= tolerance)
    return Claim(
        case.name,
        tolerance,
        row.dofs,
        row.seconds,
        row.error_frequency,
        row.error_tensor,
        row.estimate,
        ratio,
        claimed,
        verdict(row, tolerance, ratio, claimed),
    )


def verdict(row: measure.Row, tolerance: float, ratio: float, claimed: bool) -> str:
    """What is wrong with a claim, or "ok"."""
    if np.isnan(row.error):
        return f"refused: {row.note}"
    wrong = []
    if claimed and row.error > tolerance:
        wrong.append("claimed but not met")
    if not claimed and "not met" not in row.note:
        wrong.append("not met, and not said")
    if ratio < SMALLEST:
        wrong.append("estimate too small")
    if ratio > LARGEST:
        wrong.append("estimate too large")
    return ", ".join(wrong) or ("ok" if claimed else "ok, told that it is not met")
