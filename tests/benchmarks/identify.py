"""How often intervals of `nanorom.identify_sweeps` hold the truth, over seeds of the noise.

    ./run python -m tests.benchmarks.identify [SEEDS [drum]]      writes identify.md beside it

`mode`: one mode of the drum of Davidovikj et al., read in metres, two levels; `drum`: the paper's
drum, three modes read in mV, three levels of 400 rows up and down, all transduction unknown.
Sweeps are those of the continuation with 2 % noise, whose rows lie elsewhere for every seed: where
between two rows a sweep falls is a part of what is not known.  Seeds that are done are kept.
"""

import csv
import sys
import time
from pathlib import Path

import attrs
import numpy as np

import nanorom
from nanorom.continuation import ModalSystem
from nanorom.errors import NanoromError
from nanorom.scene.excitation import Damping
from tests.benchmarks.intervals import table
from tests.measurement.device import test_device as one
from tests.measurement.device.truth import noisy, sweeps

NOISE, LABELS = 0.02, ("f01", "f11s", "f11c")
QUALITY, GAIN = (180.0, 150.0, 210.0), np.array([2e5, 1.2e5, 1.5e5])  # mV/m
DRUM = Path(__file__).parents[2] / "demos/drum.toml"
ROWS = Path(__file__).with_suffix(".csv")


def single(shift):
    """Clean sweeps at rows shifted by a part of their step, guess, unknowns, truth, labels."""
    truth = {"youngs_modulus": one.MODULUS, "quality_factor": one.QUALITY, "drive": one.FORCE}
    return one.truth_of_one(shift), one.guess(), one.UNKNOWNS, truth, ()


def drum(shift):
    """The same of the paper's drum."""
    scene = nanorom.Scene.from_file(DRUM).with_(modes=3, drive=None, sweep=None, damping=None)
    model = nanorom.reduce(scene).with_damping(Damping(QUALITY))
    force = 12e-9 * model.stiffness.diagonal() / 180 * [1, 0.6, 0.8]
    system = ModalSystem(
        mass=model.mass,
        damping=model.damping,
        stiffness=model.stiffness,
        cubic=model.cubic,
        direct=force,
    )
    f = model.frequency
    ends = ((0.97, 1.1, 134), (0.985, 1.02, 133), (0.99, 1.08, 133))
    rows = [np.linspace(low * x, high * x, n) for x, (low, high, n) in zip(f, ends)]
    rows = [own + shift * (own[1] - own[0]) for own in rows]
    levels = {f"{level} dBm": 10 ** (level / 20) for level in (-12, -6, 0)}
    truth = {"tension_x": 0.321, "tension_y": 0.257, "youngs_modulus": 410e9}
    for name, values in (("quality_factor", QUALITY), ("drive", force), ("readout", GAIN)):
        truth |= {f"{name}.{label}": float(v) for label, v in zip(LABELS, values)}
    guess = attrs.evolve(
        scene, tension=nanorom.Tension(0.25, 0.22), material=nanorom.Material(8e11, 0.16, 2267)
    )
    names = ["tension_x", "tension_y", "youngs_modulus", "quality_factors", "drives", "readouts"]
    return sweeps(system, rows, levels, GAIN, "mV"), guess, names, truth, LABELS


def main(seeds="50", case="mode"):
    done = list(csv.reader(ROWS.open(encoding="utf-8"))) if ROWS.exists() else []
    known = {(row[0], int(row[1])) for row in done}
    for seed in range(int(seeds)):
        if (case, seed) in known:
            continue
        shift = np.random.default_rng(seed).random()
        clean, guess, names, truth, labels = {"mode": single, "drum": drum}[case](shift)
        start = time.process_time()
        data = noisy(clean, NOISE, seed)
        row = [case, seed]
        try:
            found = nanorom.identify_sweeps(guess, data, names, labels=labels)
        except NanoromError as error:  # it counts as what does not hold the truth
            print(f"{case} {seed}: {error}", file=sys.stderr)
            row += [round(time.process_time() - start, 2), "failed"]
            row += [part for title in truth for part in (title, np.nan, np.nan)]
        else:
            row += [round(time.process_time() - start, 2), found.misfit]
            for title, value in truth.items():
                estimate = found[title]
                row += [title, estimate.value / value - 1, estimate.interval / value]
        with ROWS.open("a", newline="", encoding="utf-8") as file:
            csv.writer(file).writerow(row)
    page()


def page():
    """The table of all rows that there are."""
    rows = list(csv.reader(ROWS.open(encoding="utf-8")))
    lines = ["# Intervals of `nanorom identify` from sweeps", ""]
    lines += ["Written by `./run python -m tests.benchmarks.identify`, which tells what it fits."]
    for case in dict.fromkeys(row[0] for row in rows):
        own = [row for row in rows if row[0] == case]
        seconds = np.median([float(row[2]) for row in own])
        told = sum(row[3] == "True" for row in own)
        lines += ["", f"## {case}", ""]
        lines += [
            f"{len(own)} seeds, {seconds:.1f} s of a core each (median); misfit told: {told}."
        ]
        columns = range(4, len(own[0]), 3)
        lines += ["", *table({own[0][i]: [row[i + 1 : i + 3] for row in own] for i in columns})]
    text = "\n".join(lines) + "\n"
    Path(__file__).with_suffix(".md").write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main(*sys.argv[1:])
