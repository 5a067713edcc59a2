"""How the barrier of Fig. 3 breaks: sweeps up, integrated in time, and the branch they land on.

The equations of the drum without bending (demos/fig3.py, eleven modes) are integrated while the
drive frequency rises in small steps from the doubled branch of f01 on, as an instrument would do
it.  Beyond the Neimark-Sacker points near f21 the motion is irregular.  Either it falls down, or it
surges: it lands on a branch of periodic motion that is not connected to the one that starts at
2 f01.  Which of the two, and where, depends on the smallest differences of state and steps.

The detached branch is found without luck from f01 and f02 alone: their doubled branch, embedded in
the eleven modes, is a guess from which all of them are corrected together.

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
from nanorom.aim import aimed
from nanorom.continuation import PeriodicOrbit, explore
from nanorom.continuation.sweep import sweep
from nanorom.files import make_directory
from nanorom.plots.style import COLUMN, save, styled

LEVELS = (1.6, 2.0, 2.4)
START, STOP, STEP = 2.36, 4.1, 0.02  # drive frequency by f01
PERIODS = 150  # of the drive, waited at most at each frequency
ALIVE = 0.5  # of the largest f01 of a sweep; below, it has fallen down
PLAIN = ("f01", "f02")  # modes of the first guess of the detached branch
SEED = 3.0  # f01: where that guess is taken
NEAR, REACH = 0.03, 1.35  # range of the base branch about it, and how far the detached one goes


def main(directory="results/surge", source="results/fig3", levels=LEVELS, stop=STOP):
    """Sweep, follow, print and draw; return frequencies of the falls and the detached stretches."""
    model, diagrams = branches(Path(source) / "membrane", levels)
    f1 = model.frequency[0]
    ratios = np.arange(START + STEP, stop, STEP)
    unit = fig3.levels(model, [1.0])
    system = aimed(model, unit).system(unit.direct_pattern, unit.parametric_pattern)
    swept, falls = [], []
    for level, diagram in zip(levels, diagrams):
        branch = ph.first_branch(diagram, model)
        before = branch.stable & (branch.omega / tau / f1 < START)
        orbit = branch.orbit(int(np.flatnonzero(before)[branch.omega[before].argmax()]))
        state = np.concatenate([orbit(0.0), orbit.velocity(0.0)])
        drive = level * unit.direct[0], level * unit.parametric[0]
        found = sweep(system, tau * f1 * ratios, *drive, state=state, periods=PERIODS)
        swept.append(found.amplitude[:, 0])
        falls.append(float(ratios[swept[-1] > ALIVE * swept[-1].max()].max()))
    detached = [follow(system, model, unit, level) for level in levels]
    print_rows(model, levels, diagrams, falls, detached, ratios[-1])
    path = make_directory(directory) / "surge.png"
    draw(model, diagrams, detached, ratios, swept, levels, path)
    print(f"picture in {directory}: surge.png")
    return falls, [stretches for _, stretches in detached]


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


def follow(system, model, unit, level):
    """The detached branch at a level and its stable stretches; (None, []) if there is none."""
    seed = seed_of(model, unit, level)
    drive = level * unit.direct[0], level * unit.parametric[0]
    near = ((1 - NEAR) * seed.omega, (1 + NEAR) * seed.omega)
    options = {"depth": 0, "tolerance": fig3.TOLERANCE, "reach": REACH, "seeds": [seed]}
    diagram = explore(system, near, *drive, **options)
    found = [branch for branch in diagram.branches if branch.period_multiple == 2]
    if not found:
        return None, []
    return found[0], ph.stable_stretches(diagram, found[0], model)


def print_rows(model, levels, diagrams, falls, detached, last):
    """Where sweeps fall down and where the detached branch is stable, level by level."""
    print("drum of demos/fig3.py without bending, eleven modes; frequencies by f01")
    print("level  first loss of stability  sweep up falls at  f01 alone   detached branch: stable")
    for level, diagram, fall, (_, stretches) in zip(levels, diagrams, falls, detached):
        reach = ph.reach(diagram, model)
        spans = sorted((min(s.start, s.stop), s.top) for s in stretches)
        text = ", ".join(f"{low:.3f} to {high:.3f}" for low, high in spans) or "not found"
        end = f"{fall:.2f}" if fall < last else f"beyond {last:.2f}"
        row = f"{level:5g} {reach.first:19.3f} ({reach.lost}) {end:>18}"
        print(f"{row} {ph.alone(level):10.3f}   {text}")
    print(f"paper: the peak surges to {ph.PAPER_PEAK}")


@styled
def draw(model, diagrams, detached, ratios, swept, levels, path):
    """The largest f01 of the last periods at each frequency, over both branches."""
    figure = Figure(figsize=(COLUMN, 0.5 + 0.42 * COLUMN * len(levels)), layout="constrained")
    panels = figure.subplots(len(levels), 1, sharex=True, squeeze=False)[:, 0]
    for axes, level, diagram, (other, _), f01 in zip(panels, levels, diagrams, detached, swept):
        pairs = [(ph.first_branch(diagram, model), "C0"), (other, "C2")]
        for branch, colour in [(b, c) for b, c in pairs if b is not None]:
            x, y = branch.omega / tau / model.frequency[0], 1e9 * branch.amplitude[:, 0]
            axes.plot(x, y, color=colour, linewidth=0.5, alpha=0.5)
            axes.plot(x, np.where(branch.stable, y, np.nan), color=colour, linewidth=1.6)
        axes.plot(ratios, 1e9 * f01, ".", color="C3", markersize=2.5)
        axes.set_title(f"γ = {level:g} γ₁", pad=3)
        axes.set_ylabel("f01 (nm)")
        axes.set_xlim(1.95, ratios[-1])
    panels[-1].set_xlabel("drive frequency / f01")
    handles = [
        Line2D([], [], color="C0", linewidth=1.6, label="from 2 f01"),
        Line2D([], [], color="C2", linewidth=1.6, label="detached"),
        Line2D([], [], color="0.5", linewidth=0.5, label="unstable (thin)"),
        Line2D([], [], color="C3", marker=".", linestyle="none", label="swept up in time"),
    ]
    panels[0].legend(handles=handles, loc="lower center", bbox_to_anchor=(0.45, 1.15), ncol=2)
    save(figure, path)


if __name__ == "__main__":
    main(*sys.argv[1:3])
