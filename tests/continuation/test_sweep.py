"""Slow sweeps of the drive frequency."""

from __future__ import annotations

import numpy as np

from nanorom.continuation import explore, sweep
from tests.continuation.independent import state as state_at
from tests.continuation.systems import duffing


def test_sweeps_jump_at_the_folds() -> None:
    system = duffing(30.0)
    folds = sorted(p.omega for p in explore(system, (0.8, 1.6), direct=0.05).points("LP"))
    assert len(folds) == 2
    up = sweep(system, np.linspace(folds[1] - 0.03, folds[1] + 0.03, 13), direct=0.05, state=None)
    start = explore(system, (0.8, folds[1] - 0.03), direct=0.05).branches[0].orbit(-1)
    up = sweep(
        system,
        np.linspace(folds[1] - 0.03, folds[1] + 0.03, 13),
        direct=0.05,
        state=state_at(start, system.size),
    )
    jump = int(np.argmin(np.diff(up.amplitude[:, 0])))
    assert up.omega[jump] <= folds[1] + 0.005 + 1e-9
    assert up.omega[jump + 1] >= folds[1]
    assert up.settled.all()
