"""A measured response beside the model's: sweeps up and down over the Duffing resonance of f01.

The "measurement" is the paper's drum with six modes under a pressure, integrated in time while the
drive frequency steps up and down as an instrument does it, with 2 % noise.  It knows nothing of the
continuation that it is laid over: it jumps where the branches fold and follows the stable ones.

    python demos/measured.py [DIRECTORY]     leaves response.h5, measured.csv and response.png; once
                                             there, `nanorom plot response.h5 --data measured.csv`
"""

import sys
from math import tau
from pathlib import Path

import numpy as np

import nanorom
from nanorom import plots
from nanorom.continuation.sweep import sweep
from nanorom.files.whole import make_directory
from nanorom.measurement.data import MeasuredResponse

LEVELS = (20.0, 60.0)  # Pa
RATIOS = np.linspace(0.9, 1.5, 49)  # of drive frequency and f01
PERIODS = 100  # of the drive, waited at most at each frequency
NOISE, SEED = 0.02, 1


def main(directory="results/measured", levels=LEVELS, ratios=RATIOS):
    """Follow, sweep and draw; return the response and what was measured."""
    directory = make_directory(Path(directory))
    scene = nanorom.Scene.from_file(Path(__file__).with_name("drum.toml"))
    model = nanorom.reduce(scene.with_(modes=6, drive=None, sweep=None))
    around = nanorom.Sweep(f"{ratios[0]} f1", f"{ratios[-1]} f1")
    response = nanorom.respond(model, nanorom.Drive(list(levels)), around)
    response.save(directory / "response.h5")
    lines = measure(model, levels, ratios * model.frequency[0])
    (directory / "measured.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    measured = MeasuredResponse.from_file(directory / "measured.csv")
    plots.response_figure(response, directory / "response.png", measured)

    print("level   fold up (MHz)  a sweep up falls  fold down (MHz)  a sweep down rises")
    for level, diagram in zip(levels, response.diagrams):
        up, down = (jump(measured, level, direction) for direction in ("up", "down"))
        low, high = sorted(p.omega / tau / 1e6 for p in diagram.points("LP", 0))
        print(f"{level:3g} Pa {high:14.4f} {up:17.4f} {low:16.4f} {down:19.4f}")
    step = (ratios[1] - ratios[0]) * model.frequency[0] / 1e6
    print(f"frequencies are {step:.3f} MHz apart; files in {directory}")
    return response, measured


def measure(model, levels, frequency):
    """Lines of a table of sweeps in time: frequency, total amplitude, direction, level."""
    moved = model.select(["f01", "f21c", "f02"])  # by a pressure: the others stay at rest
    system, random = moved.system(), np.random.default_rng(SEED)
    lines = ["frequency (MHz),amplitude (nm),sweep,level"]
    for level in levels:
        state = None
        for direction, places in (("up", frequency), ("down", frequency[::-1])):
            found = sweep(system, tau * places, level, state=state, periods=PERIODS)
            state = found.state[-1]
            total = np.linalg.norm(found.amplitude, axis=1)
            noisy = 1e9 * total * (1 + NOISE * random.standard_normal(len(places)))
            lines += [
                f"{f / 1e6:.4f},{q:.4g},{direction},{level:g} Pa" for f, q in zip(places, noisy)
            ]
    return lines


def jump(measured, level, direction):
    """Where the amplitude changes most between two frequencies of a sweep, in MHz."""
    (own,) = [
        trace
        for trace in measured.traces
        if trace.direction == direction and trace.level == f"{level:g} Pa"
    ]
    place = int(np.abs(np.diff(own.amplitude)).argmax())
    return float(own.frequency[place : place + 2].mean()) / 1e6


if __name__ == "__main__":
    main(*sys.argv[1:2])
