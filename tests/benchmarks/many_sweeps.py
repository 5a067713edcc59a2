"""Write many_sweeps.md beside this: CPU time of sweeps at once beside that of sweeps one by one.

    ./run python -m tests.benchmarks.many_sweeps

The drum of demos/falls.py at level 2, at a few frequencies from random starts: the compiled engine,
the one of arrays and `sweep`, in one run; ratios are by the time of `sweep` for each sweep.
"""

from __future__ import annotations

import sys
import time
from math import tau
from pathlib import Path

import attrs
import numpy as np

from nanorom.bench import report
from nanorom.continuation import sweep, sweeps

TABLE = Path(__file__).with_suffix(".md")
DEMOS = Path(__file__).parents[2] / "demos"
MEMBERS = {"compiled": 64, "arrays": 64}
ALONE = 2  # sweeps one by one
RATIOS = (2.2,)  # drive frequencies by f01


@attrs.frozen
class Row:
    """Sweeps by one way, milliseconds of CPU for each sweep and frequency, times faster."""

    way: str
    sweeps: int
    milliseconds: float
    ratio: float


def main() -> None:
    """Measure, print and write the table."""
    sys.path.insert(0, str(DEMOS))
    import falls as demo
    import fig3

    from nanorom.rom.patterns import aimed

    model = fig3.reduced("membrane", 11)
    unit = fig3.levels(model, [1.0])
    system = aimed(model, unit).system(unit.direct_pattern, unit.parametric_pattern)
    drive = 2 * unit.direct[0], 2 * unit.parametric[0]
    omega = tau * model.frequency[0] * np.array(RATIOS)
    random = np.random.default_rng(1).standard_normal((max(MEMBERS.values()), 2 * model.size))
    starts = system.scaled(*drive).given_states(demo.SIZE * random)
    sweeps(system, omega[:1], *drive, state=starts[:1], periods=1)  # compiles
    start = time.process_time()
    for state in starts[:ALONE]:
        sweep(system, omega, *drive, state=state, periods=demo.PERIODS)
    alone = (time.process_time() - start) / ALONE
    rows = [Row("one by one", ALONE, 1e3 * alone / len(omega), 1.0)]
    for engine, count in MEMBERS.items():
        start = time.process_time()
        sweeps(system, omega, *drive, state=starts[:count], periods=demo.PERIODS, engine=engine)
        own = (time.process_time() - start) / count
        rows.append(Row(engine, count, 1e3 * own / len(omega), alone / own))
        print(report.line(rows[-1]), flush=True)
    command = "python -m tests.benchmarks.many_sweeps"
    report.write_markdown("Sweeps at once and one by one", (rows,), TABLE, command)


if __name__ == "__main__":
    main()
