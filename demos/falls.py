"""Where the barrier of Fig. 3 breaks, by hundreds of sweeps instead of one.

The drum of demos/surge.py (no bending, eleven modes) is swept up from many starts near rest at
2 f01, all at once. How many sweeps are up is drawn against the drive frequency, with its 95 %
interval.

    python demos/falls.py [DIRECTORY [COUNT]]     leaves falls.png
"""

import sys
import time
from math import tau

import fig3
import numpy as np
from matplotlib.figure import Figure

from nanorom.continuation import falls, sweeps
from nanorom.files.whole import make_directory
from nanorom.plots.style import COLUMN, save, styled
from nanorom.rom.patterns import aimed

LEVELS = (2.0, 2.4)
START, STOP, STEP = 2.02, 4.1, 0.02  # drive frequency by f01
PERIODS = 150  # of the drive, waited at most at each frequency
GROWS, GROWTH = 2.0, 3000  # where the starts grow onto the doubled branch, for so many periods
SIZE = 1e-2  # of the starts, in units of the amplitude at which the film doubles its stiffness
COUNT, SEED = 200, 1


def main(directory="results/falls", count=COUNT, levels=LEVELS, steps=None):
    """Sweep, print and draw; return the falls at every level."""
    model = fig3.reduced("membrane", 11)
    unit = fig3.levels(model, [1.0])
    system = aimed(model, unit).system(unit.direct_pattern, unit.parametric_pattern)
    ratios = np.arange(START, STOP, STEP)[:steps]
    found = []
    print(f"{count} sweeps up of the drum of demos/surge.py; frequencies by f01")
    print("level   first falls     a quarter          half three quarters  still up  CPU s a sweep")
    for level in levels:
        drive = level * unit.direct[0], level * unit.parametric[0]
        random = np.random.default_rng(SEED).standard_normal((int(count), 2 * model.size))
        starts = system.scaled(*drive).given_states(SIZE * random)
        begun = time.process_time()
        first = tau * model.frequency[0]
        grown = sweeps(system, [GROWS * first], *drive, state=starts, periods=GROWTH).state[:, 0]
        many = sweeps(system, first * ratios, *drive, state=grown, periods=PERIODS)
        seconds = (time.process_time() - begun) / int(count)
        found.append(falls(many))
        row = "".join(f"{found[-1].quantile(q) / first:14.2f}" for q in (0, 0.25, 0.5, 0.75))
        up = 100 * np.mean(~found[-1].fell)
        print(f"{level:5g}{row}{up:8.3g} %{seconds:16.2f}", flush=True)
    draw(found, levels, tau * model.frequency[0], make_directory(directory) / "falls.png")
    print(f"picture in {directory}: falls.png")
    return found


@styled
def draw(found, levels, unit, path):
    """The share of sweeps that are up over the drive frequency."""
    figure = Figure(figsize=(COLUMN, 0.7 * COLUMN), layout="constrained")
    axes = figure.subplots()
    for number, (each, level) in enumerate(zip(found, levels)):
        colour = f"C{number}"
        x = each.omega / unit
        axes.fill_between(x, each.low, each.high, color=colour, alpha=0.25, step="mid", linewidth=0)
        axes.step(x, each.up, color=colour, where="mid", label=f"γ = {level:g} γ₁")
    axes.set_xlabel("drive frequency / f01")
    axes.set_ylabel("share of the sweeps that are up")
    axes.legend()
    save(figure, path)


if __name__ == "__main__":
    main(*sys.argv[1:2], *map(int, sys.argv[2:3]))
