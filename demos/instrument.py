"""Modal forces as the paper gets them: from the drop-down frequencies of the driven resonances.

A known drum is "measured": a spot of light drives it at levels in dBm, and the folds at which f01
and f11c fall down are read from its computed response with all its modes.  From these frequencies
alone the modal forces J_r beta are found again by the one-mode formula, and compared with what the
spot exerts.  What is left is the coupling to the other modes.

    python demos/instrument.py
"""

from math import tau
from pathlib import Path

import numpy as np

import nanorom
from nanorom.aim import aimed
from nanorom.instrument import amplitude_ratio, calibrate, power

LEVELS = (-6.0, -3.0, 0.0)  # dBm
BETA = 300.0  # Pa at the centre of the spot at 0 dBm
SPOT = {"direct_pattern": "spot", "position": ["1.0 um", "0.6 um"], "radius": "1.0 um"}
MODES = ("f01", "f11c")


def main(count=6):
    """Print forces found and exerted; return their ratio by mode."""
    scene = nanorom.Scene.from_file(Path(__file__).with_name("drum.toml"))
    model = nanorom.reduce(scene.with_(modes=count))
    drive = nanorom.Drive(BETA * amplitude_ratio(LEVELS, 0.0), **SPOT)
    exerted = aimed(model, drive).drive["spot"] * BETA
    watts = "  ".join(f"{level:g} dBm = {power(level) * 1e3:.3f} mW" for level in LEVELS)
    print(f"levels: {watts}; beta at 0 dBm: {BETA:g} Pa, spot of radius 1 um at (1.0, 0.6) um")
    print("mode  drop-down frequencies (MHz)     force at 0 dBm (pN): found  exerted   ratio")
    ratios = {}
    for label in MODES:
        r = model.label.index(label)
        f = model.frequency[r]
        sweep = nanorom.Sweep(0.985 * f, 1.2 * f, depth=0, tolerance=1e-8)
        response = nanorom.respond(model, drive, sweep)
        folds = [
            max(
                point.omega / tau
                for point in diagram.points("LP")
                if np.argmax(point.amplitude) == r
            )
            for diagram in response.diagrams
        ]
        found = calibrate(model, label, LEVELS, folds)
        ratios[label] = found.force / abs(exerted[r])
        numbers = "  ".join(f"{fold / 1e6:.4f}" for fold in folds)
        print(f"{label:5} {numbers:30} {found.force * 1e12:24.4f}", end=" ")
        print(f"{abs(exerted[r]) * 1e12:8.4f} {ratios[label]:8.4f}  spread {found.spread:.1e}")
    return ratios


if __name__ == "__main__":
    main()
