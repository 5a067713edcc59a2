"""Write many_devices.md beside this: a thousand drums of six modes by `nanorom.study`.

    ./run python -m tests.benchmarks.many_devices [--count 1000]

The drum of demos/drum.toml with other thicknesses, radii and tensions, on all cores. It asserts
nothing.
"""

from __future__ import annotations

import argparse
import os
import resource
import time
from pathlib import Path

import attrs
import numpy as np

import nanorom
from nanorom.bench import report

TABLE = Path(__file__).with_suffix(".md")
DEMOS = Path(__file__).parents[2] / "demos"
MODES = 6
VARY = {
    "plate.thickness": {"from": "5 nm", "to": "20 nm"},
    "geometry.radius": {"from": "2 um", "to": "3 um"},
    "tension.x": "0.3 N/m +- 5 %",
    "tension.y": "0.27 N/m +- 5 %",
}


@attrs.frozen
class Row:
    """Devices, processes, seconds that went by, CPU seconds of each device, those that failed."""

    devices: int
    processes: int
    seconds: float
    cpu_each: float
    failed: int


def main() -> None:
    """Measure, print and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=1000, help="devices")
    count = parser.parse_args().count
    scene = nanorom.Scene.from_file(DEMOS / "drum.toml").with_(modes=MODES)
    of = [*(f"f{n + 1}" for n in range(MODES)), "b111"]
    before, start = _cpu(), time.perf_counter()
    table = nanorom.study(scene, VARY, of=of, samples=count)
    seconds = time.perf_counter() - start
    failed = int(np.isnan(table["f1"]).sum())
    row = Row(count, os.cpu_count() or 1, seconds, (_cpu() - before) / count, failed)
    print(report.line(row))
    command = "python -m tests.benchmarks.many_devices"
    report.write_markdown("Many devices", ([row],), TABLE, command)


def _cpu() -> float:
    """CPU seconds of this process and of those that it has waited for."""
    kinds = resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN
    used = [resource.getrusage(kind) for kind in kinds]
    return sum(each.ru_utime + each.ru_stime for each in used)


if __name__ == "__main__":
    main()
