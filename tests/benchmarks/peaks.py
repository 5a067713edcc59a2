"""How often the intervals of `nanorom peaks` hold the truth, over seeds of the noise.

    ./run python -m tests.benchmarks.peaks [SEEDS]      writes tests/benchmarks/peaks.md

Sweeps up and down at three levels of a Duffing resonance that the continuation has found, with 2 %
noise; no fit knows of it.
"""

import sys
import time
from pathlib import Path

import numpy as np

from nanorom.measurement.data import MeasuredResponse
from nanorom.measurement.sweeps.peaks import find_peaks
from tests.benchmarks.intervals import table
from tests.measurement.sweeps.truth import NM, PLACE, QUALITY, duffing_sweeps, noisy

LEVELS, RATIOS, NOISE = (0.0004, 0.001, 0.002), np.linspace(0.95, 1.1, 200), 0.02


def main(seeds=50):
    clean, rows, start = duffing_sweeps(LEVELS, RATIOS), [], time.process_time()
    for seed in range(seeds):
        (peak,) = find_peaks(MeasuredResponse(tuple(noisy(clean, NOISE, seed)), "nm"))
        truth = {
            "f0": (peak.frequency, PLACE),
            "Q": (peak.quality_factor, QUALITY),
            "duffing b/k": (peak.duffing, 1 / NM**2),
            **{f"drive {level:g}": (peak.force[f"{level:g}"], level * NM) for level in LEVELS},
        }
        rows.append({name: (e.value / v - 1, e.interval / v) for name, (e, v) in truth.items()})
    seconds = (time.process_time() - start) / seeds
    lines = [
        "# Intervals of `nanorom peaks`",
        "",
        "Written by `./run python -m tests.benchmarks.peaks`: three levels up and down, 200 rows",
        f"each, 2 % noise, {seeds} seeds; intervals are those of 95 %.",
        f"A fit takes {seconds:.1f} s of a core.",
        "",
        *table({name: [row[name] for row in rows] for name in rows[0]}),
    ]
    text = "\n".join(lines) + "\n"
    Path(__file__).with_suffix(".md").write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
