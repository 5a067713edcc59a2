"""Modal forces: from the pattern of the force, and as the paper gets them from measured folds.

J_r is the work of the force on mode r, int p phi_r dA: of a uniform pressure, of a Gaussian spot of
light, of a point.  The paper has no pattern; it takes J_r from the frequencies at which the driven
resonances fall down, level by level.

A known drum is "measured" here: a spot drives it at levels in dBm, and the folds of several modes
are read from its computed response with all modes.  From these frequencies alone J_r beta is found
again by the one-mode formula, as in the paper, and compared with what the spot exerts: the rest is
the coupling to other modes.  Where the pattern is known but for a factor, all modes may move, and
beta comes out exactly.  The parametric force J gamma follows from the widths of the tongues.

    python demos/instrument.py [DIRECTORY]     leaves folds.png
"""

import sys
from math import tau
from pathlib import Path

import numpy as np

import nanorom
from nanorom.files.whole import make_directory
from nanorom.measurement.calibration import (
    Calibration,
    amplitude_ratio,
    calibrate,
    force_of_tongue,
    power,
)
from nanorom.plots.calibration import calibration_figure
from nanorom.rom.patterns import aimed

LEVELS = np.array([-8.0, -6.0, -4.0, -2.0, 0.0])  # dBm
BETA = 300.0  # Pa at the centre of the spot at 0 dBm
POSITION, RADIUS = (1.0e-6, 0.6e-6), 1.0e-6
SPOT = {"direct_pattern": "spot", "position": POSITION, "radius": RADIUS}
MODES = ("f01", "f11s", "f11c", "f21s")
ABOVE = 2.0  # gamma at 0 dBm by the threshold of f01


def main(directory="results/instrument", count=6, modes=MODES):
    """Print forces found and exerted; return ratios (mode alone, all modes) by mode."""
    scene = nanorom.Scene.from_file(Path(__file__).with_name("drum.toml"))
    scene = scene.with_(modes=count)
    model = nanorom.reduce(scene.with_(drive=nanorom.Drive(1.0, **SPOT)))
    point = nanorom.Drive(1.0, direct_pattern="point", position=POSITION)
    patterns(model.drive | nanorom.reduce(scene.with_(drive=point)).drive, model.label)
    drive = nanorom.Drive(BETA * amplitude_ratio(LEVELS, 0.0), **SPOT)
    exerted = np.abs(aimed(model, drive).drive["spot"]) * BETA
    watts = "  ".join(f"{level:g} dBm = {power(level) * 1e3:.3f} mW" for level in LEVELS)
    print(f"\n{watts}\nbeta at 0 dBm: {BETA:g} Pa")
    pattern = aimed(model, drive).drive["spot"]
    print("                J_r beta at 0 dBm (pN)              beta with all modes and the pattern")
    print("mode   folds   exerted  mode alone   ratio  spread      (Pa)      ratio  spread")
    ratios, folds, found = {}, {}, {}
    for label in modes:
        r = model.label.index(label)
        measured = measured_folds(model, drive, r)
        folds[label] = LEVELS[measured > 0], measured[measured > 0]
        found[label] = alone = calibrate(model, label, *folds[label])
        whole = calibrate(model, label, *folds[label], pattern=pattern)
        ratios[label] = alone.force / exerted[r], whole.force / exerted[r]
        row = f"{label:5} {len(folds[label][0]):6} {1e12 * exerted[r]:9.4f}"
        row += f" {1e12 * alone.force:11.4f} {ratios[label][0]:7.4f} {alone.spread:7.0e}"
        row += f" {BETA * ratios[label][1]:11.5f} {ratios[label][1]:9.7f}"
        print(f"{row} {whole.spread:7.0e}")
    ratios["gamma"] = parametric(model)
    calibration_figure(model, folds, found, make_directory(directory) / "folds.png")
    print(f"picture in {directory}: folds.png")
    return ratios


def patterns(force, labels):
    """Print J of each mode for three patterns."""
    print("J_r: pressure, spot of 1/e^2 radius 1 um at (1.0, 0.6) um, point there; max |phi| = 1")
    print("mode   pressure (um^2 = pN/Pa)  spot (um^2 = pN/Pa)  point (1 = N/N)")
    for r, label in enumerate(labels):
        pressure = 1e12 * force["pressure"][r]
        pressure = pressure if abs(pressure) > 1e-9 else 0.0
        spot, point = 1e12 * force["spot"][r], force["point"][r]
        print(f"{label:5} {pressure:24.4f} {spot:20.4f} {point:16.4f}")


def measured_folds(model, drive, r):
    """The frequency (n,) in Hz at which a mode falls down at each level, 0 where it does not."""
    f = model.frequency[r]
    sweep = nanorom.Sweep(0.985 * f, 1.2 * f, depth=0, tolerance=1e-8)
    response = nanorom.respond(model, drive, sweep)
    folds = [
        [p.omega / tau for p in diagram.points("LP") if np.argmax(p.amplitude) == r]
        for diagram in response.diagrams
    ]
    return np.array([max(found, default=0.0) for found in folds])


def parametric(model):
    """Find J gamma of f01 from its tongues with beta and gamma together; return the ratio."""
    force = abs(aimed(model, nanorom.Drive(1.0, **SPOT)).drive["spot"][0])
    quality = tau * model.frequency[0] * model.mass[0] / model.damping[0, 0]
    gamma = ABOVE * 2 * model.stiffness[0, 0] / (quality * force)
    ratio = amplitude_ratio(LEVELS, 0.0)
    drive = nanorom.Drive(BETA * ratio, gamma * ratio, parametric_pattern="paper", **SPOT)
    sweep = nanorom.Sweep("1.97 f1", "2.03 f1", depth=0, tolerance=1e-8)
    response = nanorom.respond(model, drive, sweep)
    tongues = [[p.omega / tau for p in diagram.points("PD")] for diagram in response.diagrams]
    seen = [place for place, tongue in enumerate(tongues) if len(tongue) == 2]
    low, high = np.array([sorted(tongues[place]) for place in seen]).T
    found = Calibration.of(LEVELS[seen], force_of_tongue(model, "f01", low, high))
    opening = -20 * np.log10(found.force * quality / (2 * model.stiffness[0, 0]))
    print(f"\nf01 doubles its period at {', '.join(f'{level:g}' for level in LEVELS[seen])} dBm:")
    exerted = gamma * force
    print(f"J gamma at 0 dBm (mN/m): exerted {exerted * 1e3:.4f}, found {found.force * 1e3:.4f}")
    print(f"it opens at {opening:.3f} dBm (exerted {-20 * np.log10(ABOVE):.3f})")
    print("\n  dBm   beta (Pa)  gamma (Pa/m), by the calibration")
    beta = BETA * ratio
    for level, b, g in zip(LEVELS, beta, found.at(LEVELS) / force):
        print(f"{level:5g} {b:11.2f} {g:13.3e}")
    return found.force / exerted


if __name__ == "__main__":
    main(*sys.argv[1:2])
