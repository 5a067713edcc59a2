"""The demo of static loads in its short form: softening, limits, snap-through, relaxation."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import nanorom

DEMO = Path(__file__).parents[2] / "demos" / "statics.py"


def test_statics_show_what_their_page_says(tmp_path, capsys):
    rough = nanorom.Accuracy(degree=4, mesh_size=1e-5)
    gate, (bulge, hencky), (tip, linear, cubic), dome, trampoline = runpy.run_path(str(DEMO))[
        "main"
    ](tmp_path, points=7, tolerance=rough)
    frequency = gate.frequency[gate.stable, 0]
    assert 0 < np.flatnonzero(np.diff(frequency) > 0)[0]  # softer first
    assert frequency.max() > 1.3 * frequency[0]
    assert gate.pull_in == pytest.approx(15.51, abs=0.01)
    assert gate.pull_in > gate.lumped
    assert bulge.centre[-1] == pytest.approx(hencky[-1], rel=2e-3)
    assert tip.load[0] == pytest.approx(linear[0], rel=3e-3)
    assert tip.load[-1] == pytest.approx(cubic[-1], rel=0.1)
    assert dome.limits[0] < dome.limits[1] < 0
    assert 0 < trampoline.static["mean_tension"] < 50.0
    for name in ("statics.png", "trampoline.png", "gate.csv", "tip.h5"):
        assert (tmp_path / name).stat().st_size > 100
    assert "pulled in at 15.5" in capsys.readouterr().out
