"""Fig. 3's parametric drive in milliwatts: what the drum's own heat makes of modulated light.

The paper sets the strength gamma of its opto-thermal modulation by hand.  Here the drum under the
laser of demos/fig3.py conducts the heat that it absorbs to its rim, expands (graphene shrinks) and
changes its tension with the delay of its thermal modes; no strength is fitted.  A mode of stiffness
k doubles its period at twice its frequency where the modulation exceeds 2 k/Q.

Properties of graphite of 10 nm: expansion of graphene at room temperature, Yoon et al. 2011
(doi:10.1021/nl201488g); conductivity in the plane and specific heat, round values of graphite; the
absorbed share is that of 30 layers of 2.3 % each, without the cavity's interference.

    python demos/laser.py [DIRECTORY]     leaves laser.csv, response.h5 and laser.png
"""

import csv
import sys
import warnings
from pathlib import Path

import attrs
import numpy as np

import nanorom
from nanorom.files.whole import make_directory

GRAPHITE = {"expansion": -8e-6, "conductivity": "1500 W/m/K", "specific_heat": "710 J/kg/K"}
ABSORPTION = 1 - (1 - 0.023) ** 30
SPOT = {"position": ["1.0 um", "0.6 um"], "radius": "1.0 um", "absorption": ABSORPTION}
MEAN = "0.1 mW"
MODES = 6
LADDER = (0.9, 1.2, 1.6, 2.0)  # powers by the threshold of f01
SWEEP = ("1.9 f1", "2.3 f1")
COLUMNS = ("mode", "N/m per mW", "delay in degrees", "threshold in mW")


def scene(count=MODES, power=MEAN):
    """The drum of demos/drum.toml, a membrane as in Fig. 3, with graphite's heat."""
    drum = nanorom.Scene.from_file(Path(__file__).with_name("drum.toml"))
    return drum.with_(
        plate=attrs.evolve(drum.plate, model="membrane"),
        material=attrs.evolve(drum.material, **GRAPHITE),
        modes=count,
        drive=nanorom.Drive(laser=power, power=power, **SPOT),
        sweep=nanorom.Sweep(*SWEEP),
    )


def strengths(model, quality):
    """Rows of COLUMNS: modulation of a mode's stiffness at twice its frequency, and threshold."""
    heat, rows = model.heat, []
    for r, label in enumerate(model.label):
        omega = 4 * np.pi * model.frequency[r]
        per_watt = (heat.stiffness[r, r] * heat.feed / (heat.rate + 1j * omega)).sum()
        # the stiffness follows cos(omega t) late by minus the angle; graphene stiffens when warm
        late = -np.degrees(np.angle(per_watt))
        threshold = 2 * model.stiffness[r, r] / quality / abs(per_watt)
        rows.append((label, 1e-3 * abs(per_watt), late, 1e3 * threshold))
    return rows


def main(directory="results/laser", ladder=LADDER, count=MODES):
    """Tell strengths and thresholds, draw the response by power; return the model and it."""
    directory = make_directory(Path(directory))
    film = scene(count)
    model = nanorom.reduce(film)
    quality = film.damping.per_mode(1)[0]
    rows = strengths(model, quality)
    times = 1e9 / model.heat.rate
    print(f"thermal modes relax in {times[0]:.3g} ns and less; {ABSORPTION:.0%} are absorbed")
    print("{:6} {:>12} {:>18} {:>18}".format(*COLUMNS))
    for label, strength, late, threshold in rows:
        print(f"{label:6} {strength:12.4g} {late:18.1f} {threshold:18.3g}")
    with (directory / "laser.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([COLUMNS, *rows])
    levels = [1e-3 * rows[0][3] * step for step in ladder]
    mean = float(film.drive.power)
    drive = nanorom.Drive(laser=levels, power=max(mean, *levels), **SPOT)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", nanorom.errors.AccuracyWarning)
        response = nanorom.respond(model, drive, film.sweep, film.damping)
    response.save(directory / "response.h5")
    nanorom.plots.response_figure(response, directory / "laser.png")
    return model, response


if __name__ == "__main__":
    main(*sys.argv[1:])
