"""Write splitting.md beside this: what splitting saves of following a response, by number of modes.

    ./run python -m tests.benchmarks.splitting

The membrane of demos/fig3.py at its level 1.6 about its first resonance: with multipliers by
splitting and by series, turn by turn; of each the shorter of two runs counts. It asserts nothing.
"""

from __future__ import annotations

import sys
import time
import warnings
from pathlib import Path

import attrs
import numpy as np

from nanorom.bench import report
from nanorom.continuation import explore
from nanorom.continuation.orbits import splitting
from nanorom.rom.model import ReducedModel
from nanorom.rom.patterns import aimed

TABLE = Path(__file__).with_suffix(".md")
DEMOS = Path(__file__).parents[2] / "demos"
SIZES = (11, 18, 28, 40)
LEVEL, RANGE = 1.6, (0.97, 1.05)  # of the ladder of fig3.py; by the first frequency
NEVER = 1000  # modes


@attrs.frozen
class Row:
    """CPU seconds of one number of modes, and special points found by both."""

    modes: int
    splitting: float
    series: float
    ratio: float
    points: str


def seconds(model: ReducedModel, many: int) -> tuple[float, int]:
    """CPU seconds of a diagram with splitting from so many modes on, and its special points."""
    import fig3

    splitting.MANY = many
    drive = fig3.levels(model, [LEVEL])
    system = aimed(model, drive).system(drive.direct_pattern, drive.parametric_pattern)
    first = 2 * np.pi * model.frequency[0]
    window = RANGE[0] * first, RANGE[1] * first
    start = time.process_time()
    found = explore(system, window, drive.direct[0], drive.parametric[0], depth=0)
    return time.process_time() - start, len(found.special_points)


def main() -> None:
    """Print rows as they come, then write the table."""
    warnings.simplefilter("ignore")
    sys.path.insert(0, str(DEMOS))
    import fig3

    full = attrs.evolve(fig3.reduced("membrane", max(SIZES)), larger=None)
    rows = []
    for size in SIZES:
        model = full.select(list(range(1, size + 1)))
        turns = [[seconds(model, many) for many in (1, NEVER)] for _ in range(2)]
        (by_splitting, one), (by_series, other) = (min(times) for times in zip(*turns))
        rows.append(Row(size, by_splitting, by_series, by_splitting / by_series, f"{one}, {other}"))
        print(report.line(rows[-1]), flush=True)
    command = "python -m tests.benchmarks.splitting"
    report.write_markdown("Multipliers by splitting and by series", (rows,), TABLE, command)


if __name__ == "__main__":
    main()
