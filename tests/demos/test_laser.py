"""The demo of the laser in its short form: thresholds in milliwatts are where motion doubles."""

import csv
import runpy
from pathlib import Path

DEMO = Path(__file__).parents[2] / "demos" / "laser.py"


def test_motion_doubles_beyond_the_power_that_the_table_tells(tmp_path):
    demo = runpy.run_path(str(DEMO))
    model, response = demo["main"](tmp_path, ladder=(0.95, 1.1), count=2)
    below, above = (len(diagram.points("PD")) for diagram in response.diagrams)
    assert (below, above) == (0, 2)
    with (tmp_path / "laser.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["mode"] for row in rows] == list(model.label)
    assert all(float(row["threshold in mW"]) > 0 for row in rows)
    for name in ("response.h5", "laser.png"):
        assert (tmp_path / name).stat().st_size > 10_000
