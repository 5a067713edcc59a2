"""How the barrier of Fig. 3 breaks: sweeps up, integrated in time, and the branch they land on.

The equations of the drum without bending (demos/fig3.py, eleven modes) are integrated while the
drive frequency rises in small steps from the doubled branch of f01 on, as an instrument would do
it.  Beyond the Neimark-Sacker points near f21 the motion is irregular.  It falls down in the end,
unless it lands on a branch of periodic motion before that is not connected to the one that starts
at 2 f01.  Where it falls and whether it lands depends on the smallest differences.

The detached branch is found without luck from f01 and f02 alone: their doubled branch, embedded in
the eleven modes, is a guess from which all of them are corrected together.  A second sweep starts
on it.

    python demos/surge.py [DIRECTORY [FIG3]]     leaves surge.png; FIG3: results of fig3.py, whose
                                                 branches are made anew if missing
"""

import sys
from math import tau
from pathlib import Path

import fig3
import numpy as np
import phenomena as ph
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

import nanorom
from nanorom.continuation import PeriodicOrbit, explore
from nanorom.continuation.sweep import sweep
from nanorom.files.whole import make_directory
from nanorom.plots.curves import stretches
from nanorom.plots.style import COLUMN, save, styled
from nanorom.rom.patterns import aimed

LEVELS = (1.6, 2.0, 2.4)
START, STOP, STEP = 2.36, 4.1, 0.02  # drive frequency by f01
PERIODS = 150  # of the drive, waited at most at each frequency
ALIVE = 0.5  # of the largest f01 of a sweep; below, it has fallen down
PLAIN = ("f01", "f02")  # modes of the first guess of the detached branch
SEED = 3.0  # f01: where that guess is taken
RATIOS, BEYOND = np.arange(START + STEP, STOP, STEP), np.arange(SEED + STEP, STOP, STEP)
BRANCHES, SWEEPS = ("C0", "C2"), ("C3", "C1")  # colours
NEAR, REACH = 0.03, 1.35  # range of the base branch about it, and how far the detached one goes


def main(directory="results/surge", source="results/fig3", levels=LEVELS, steps=None):
    """Sweep, follow, print and draw; return falls of both sweeps and the detached stretches."""
    model, diagrams = branches(Path(source) / "membrane", levels)
    unit = fig3.levels(model, [1.0])
    system = aimed(model, unit).system(unit.direct_pattern, unit.parametric_pattern)
    paths, rows = [], []
    print("drum of demos/fig3.py without bending, eleven modes; frequencies by f01")
    print("       stable from         f01  a sweep up  from the detached branch  that is")
    print("level     2 f01 to       alone    falls at                  falls at  stable")
    for level, diagram in zip(levels, diagrams):
        drive = level * unit.direct[0], level * unit.parametric[0]
        other = beyond(system, model, unit, level)
        both = [(diagram, ph.first_branch(diagram, model))]
        if other is not None:
            both.append((other, other.branches[doubled(other)]))
        found = [
            up(system, model, branch, drive, ratios[:steps])
            for (_, branch), ratios in zip(both, (RATIOS, BEYOND))
        ]
        paths.append([(*pair, swept) for pair, swept in zip(both, found)])
        stable = ph.stable_stretches(*both[1], model) if other is not None else []
        rows.append(([fall(*swept) for swept in found], stable))
        ends = [f"{f:.2f}" if f < swept[0][-1] else "none" for f, swept in zip(rows[-1][0], found)]
        print_row(model, level, diagram, ends, stable)
    print(f"paper: the peak surges to {ph.PAPER_PEAK}")
    draw(model, paths, levels, make_directory(directory) / "surge.png")
    print(f"picture in {directory}: surge.png")
    return rows


def up(system, model, branch, drive, ratios):
    """Drive frequencies by f01 and largest f01 of a sweep from the branch near the first."""
    unit = tau * model.frequency[0]
    distance = np.where(branch.stable, np.abs(branch.omega / unit - ratios[0]), np.inf)
    orbit = branch.orbit(int(distance.argmin()))
    state = np.concatenate([orbit(0.0), orbit.velocity(0.0)])
    found = sweep(system, unit * ratios, *drive, state=state, periods=PERIODS)
    return ratios, found.amplitude[:, 0]


def branches(folder, levels):
    """The model and its diagrams at the levels, from fig3.py's files or anew."""
    if (folder / "response.h5").exists():
        model = nanorom.ReducedModel.load(folder / "rom.h5")
        response = nanorom.Response.load(folder / "response.h5")
        gamma = fig3.levels(model, [1.0]).parametric[0]
        there = [round(parametric / gamma, 6) for _, parametric in response.drive.levels]
        if set(levels) <= set(there):
            return model, [response.diagrams[there.index(level)] for level in levels]
    model = fig3.reduced("membrane", 11)
    around = nanorom.Sweep("1.95 f1", "2.05 f1", tolerance=fig3.TOLERANCE)
    return model, nanorom.respond(model, fig3.levels(model, levels), around).diagrams


def seed_of(model, unit, level):
    """The stable doubled orbit of f01 and f02 at `SEED`, as one of all modes."""
    plain = model.select(PLAIN)
    drive = nanorom.Drive(
        level * unit.direct[0],
        level * unit.parametric[0],
        parametric_pattern="paper",
        **fig3.SPOT,
    )
    around = nanorom.Sweep("1.95 f1", "2.05 f1", tolerance=fig3.TOLERANCE)
    (diagram,) = nanorom.respond(plain, drive, around, processes=1).diagrams
    branch = ph.first_branch(diagram, plain)
    distance = np.abs(branch.omega / tau / model.frequency[0] - SEED)
    orbit = branch.orbit(int(np.where(branch.stable, distance, np.inf).argmin()))
    coefficients = np.zeros((len(orbit.coefficients), model.size))
    coefficients[:, [model.label.index(label) for label in PLAIN]] = orbit.coefficients
    return PeriodicOrbit(coefficients, orbit.omega, 2)


def beyond(system, model, unit, level):
    """The diagram of the detached branch at a level, or None if there is none."""
    seed = seed_of(model, unit, level)
    drive = level * unit.direct[0], level * unit.parametric[0]
    near = ((1 - NEAR) * seed.omega, (1 + NEAR) * seed.omega)
    options = {"depth": 0, "tolerance": fig3.TOLERANCE, "reach": REACH, "seeds": [seed]}
    diagram = explore(system, near, *drive, **options)
    return diagram if doubled(diagram) is not None else None


def doubled(diagram):
    """Place of the first branch of doubled period, or None."""
    places = [n for n, branch in enumerate(diagram.branches) if branch.period_multiple == 2]
    return places[0] if places else None


def fall(ratios, f01):
    """The last frequency of a sweep before it has fallen down."""
    return float(ratios[f01 > ALIVE * f01.max()].max())


def print_row(model, level, diagram, ends, stable):
    """Where sweeps fall down and where the detached branch is stable, at one level."""
    reach = ph.reach(diagram, model)
    text = ", ".join(f"{low:.3f} to {high:.3f}" for low, high in spans(stable)) or "not found"
    row = f"{level:5g} {reach.first:9.3f} ({reach.lost}) {ph.alone(level):10.3f}"
    print(f"{row} {ends[0]:>11} {ends[-1] if stable else '':>25}  {text}", flush=True)


def spans(stable):
    """The frequencies of stable stretches, those that overlap as one."""
    found = []
    for low, high in sorted((min(s.start, s.stop), s.top) for s in stable):
        if found and low <= found[-1][1] + STEP / 10:
            found[-1][1] = max(high, found[-1][1])
        else:
            found.append([low, high])
    return found


@styled
def draw(model, paths, levels, path):
    """The largest f01 of the last periods at each frequency, over both branches."""
    figure = Figure(figsize=(COLUMN, 0.5 + 0.42 * COLUMN * len(levels)), layout="constrained")
    panels = figure.subplots(len(levels), 1, sharex=True, squeeze=False)[:, 0]
    unit = tau * model.frequency[0]
    for axes, level, pairs in zip(panels, levels, paths):
        for (diagram, branch, (ratios, f01)), colour, dots in zip(pairs, BRANCHES, SWEEPS):
            located = diagram.points(branch=diagram.branches.index(branch))
            for curve in stretches(branch, located):
                width, alpha = (1.6, 1.0) if curve.stable else (0.5, 0.5)
                x, y = curve.omega / unit, 1e9 * curve.amplitude[:, 0]
                axes.plot(x, y, color=colour, linewidth=width, alpha=alpha)
            axes.plot(ratios, 1e9 * f01, ".", color=dots, markersize=2.5)
        axes.set_title(f"γ = {level:g} γ₁", pad=3)
        axes.set_ylabel("f01 (nm)")
        axes.set_xlim(1.95, STOP)
    panels[-1].set_xlabel("drive frequency / f01")
    handles = [
        Line2D([], [], color=BRANCHES[0], linewidth=1.6, label="from 2 f01"),
        Line2D([], [], color=BRANCHES[1], linewidth=1.6, label="detached"),
        Line2D([], [], color="0.5", linewidth=0.5, label="unstable (thin)"),
        Line2D([], [], color=SWEEPS[0], marker=".", linestyle="none", label="swept up in time"),
        Line2D([], [], color=SWEEPS[1], marker=".", linestyle="none", label="swept, from detached"),
    ]
    panels[0].legend(handles=handles, loc="lower center", bbox_to_anchor=(0.45, 1.15), ncol=2)
    save(figure, path)


if __name__ == "__main__":
    main(*sys.argv[1:3])
