"""Designs beside scans by brute force, runs at a tenth of the tolerance and closed forms.

./run python -m tests.benchmarks.designs
"""

import time
from pathlib import Path

import numpy as np

import nanorom
from nanorom.bench import report

HERE = Path(__file__).parent
DEMOS = HERE.parents[1] / "demos"
POINTS = 41  # of a scan
DRUM = {"plate.thickness": {"from": "10 nm", "to": "100 nm", "spacing": "log"}}


def main():
    """Scan the drum's ratio of modes, design it, and print both."""
    scene = nanorom.Scene.from_file(DEMOS / "drum.toml").with_(modes=2)
    begin = time.process_time()
    grid = {"plate.thickness": DRUM["plate.thickness"] | {"count": POINTS}}
    scan = nanorom.study(scene, grid, ["f2/f1"])
    h, ratio = scan["plate.thickness"], scan["f2/f1"]
    place = int(np.flatnonzero(np.diff(np.sign(ratio - 2)))[0])
    low, high = h[place], h[place + 1]
    share = (2 - ratio[place]) / (ratio[place + 1] - ratio[place])
    found = nanorom.design(scene, DRUM, conditions="f2/f1 = 2", starts=2)
    best = found["plate.thickness"]
    print(f"scan: {ratio.min():.4f} to {ratio.max():.4f}; 2 between {low:.5g} and {high:.5g} m,")
    print(f"  linear between them {low * (high / low) ** share:.6g} m")
    print(f"design: {best:.8g} m, f2/f1 - 2 = {found['f2/f1'] - 2:.1e}, ", end="")
    print(f"at a tenth of the tolerance {found.finer[0] - 2:.1e}, {len(found.search)} devices")
    print("\n".join(report.conditions("python -m tests.benchmarks.designs")))
    print(f"{time.process_time() - begin:.0f} s")
    assert low <= best <= high


if __name__ == "__main__":
    main()
