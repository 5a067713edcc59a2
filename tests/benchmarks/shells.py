"""Full load-deflection curves of the shell benchmarks beside the published tables.

python -m tests.benchmarks.shells [CASE ...] writes tests/benchmarks/shells/CASE.csv: load relative
to the largest, and for every displacement ours and the published one.
"""

import sys
import time
from pathlib import Path

import numpy as np

from nanorom.fem.statics import path
from tests.fem.models import sze_cases

MESHES = {  # degree and cells along a side
    "end_shear": (4, 8),
    "end_moment": (4, 8),
    "slit_annulus": (6, 12),
    "hemisphere": (6, 6),
    "cylinder_pull_out": (6, 6),
}


def curve(name):
    """Rows of load, then ours and the published value of every displacement."""
    shell, problem, largest, observed = sze_cases.CASES[name](*MESHES[name])
    table = sze_cases.table(name)
    rows = []
    for published, _ in zip(table, path.load_steps(problem, table[:, 0] * largest)):
        ours = sze_cases.observe(shell, observed)
        rows.append([published[0], *np.column_stack([ours, published[1:]]).ravel()])
    return np.array(rows)


def main(names):
    folder = Path(__file__).parent / "shells"
    folder.mkdir(exist_ok=True)
    for name in names or MESHES:
        start = time.perf_counter()
        rows = curve(name)
        n = rows.shape[1] // 2
        header = ",".join(["load"] + [f"{who}_{i + 1}" for i in range(n) for who in ("w", "sze")])
        np.savetxt(folder / f"{name}.csv", rows, "%.6g", ",", header=header, comments="")
        deviation = rows[:, 1::2] / rows[:, 2::2] - 1
        large = np.abs(rows[:, 2::2]) > 0.05 * np.abs(rows[:, 2::2]).max(axis=0)
        worst = np.abs(np.where(large, deviation, 0.0)).max()
        print(f"{name}: {100 * worst:.2f} % at most, {time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main(sys.argv[1:])
