"""Write windows.md beside this: random ranges of random systems beside a wide one.

    ./run python -m tests.stress.windows [FIRST LAST]

Seeds of `tests/continuation/windows`. A stable orbit that the wide range has and the narrow one
lacks is missing; one that only the narrow one has is an isola that the wide one did not meet. It
asserts nothing.
"""

from __future__ import annotations

import sys
from pathlib import Path

import attrs

from nanorom.bench import report
from tests.continuation.windows import compared

TABLE = Path(__file__).with_suffix(".md")


@attrs.frozen
class Row:
    """A system: ranges tried, stable orbits that they lack (told, or not), that only they have."""

    seed: int
    ranges: int
    told: int
    missing: int
    beyond: int


def main(first: int = 0, last: int = 100) -> None:
    """Print rows as they come, then write the table."""
    rows = []
    for seed in range(first, last):
        windows = compared(seed)
        told = sum(min(len(window.missing), window.told) for window in windows)
        missing = sum(len(window.missing) for window in windows)
        beyond = sum(len(window.beyond) for window in windows)
        rows.append(Row(seed, len(windows), told, missing - told, beyond))
        print(report.line(rows[-1]), flush=True)
    command = f"python -m tests.stress.windows {first} {last}"
    report.write_markdown("Ranges beside a wider one", (rows,), TABLE, command)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
