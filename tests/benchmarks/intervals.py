"""A table of intervals: how often they hold the truth, how far estimates are from it."""

from collections.abc import Mapping

import numpy as np

HEAD = ["| found | holds the truth | mean error | scatter | half width |", "|---|---|---|---|---|"]


def table(found: Mapping[str, list[tuple[float, float]]]) -> list[str]:
    """Lines of Markdown: of each name error and half width of every seed, relative to the truth."""
    lines = list(HEAD)
    for name, pairs in found.items():
        error, width = np.array(pairs, dtype=float).T
        held = int((np.abs(error) <= width).sum())
        lines.append(
            f"| {name} | {held} of {len(error)} | {error.mean():+.1e} | {error.std():.1e} | "
            f"{np.median(width):.1e} |"
        )
    return lines
