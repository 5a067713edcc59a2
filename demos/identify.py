"""Tension and Young's modulus of the paper's drum from eleven measured resonances (its step I).

The measured modes carry no labels and the first guess is poor: no anisotropy, a third less
tension, the modulus two and a half times. Then only five of them, modes 1, 3, 4, 6 and 11: which
modes they are is found as well, and the intervals grow.
"""

import sys
from pathlib import Path

import attrs

import nanorom
from nanorom import plots
from nanorom.measurement.data import Resonances
from nanorom.measurement.identify import identify
from nanorom.report import text

HERE = Path(__file__).parent
FEW = [0, 2, 3, 5, 10]


def main(directory="results/identify"):
    """Print both fits, write the picture of the first; returns both."""
    scene = nanorom.Scene.from_file(HERE / "drum.toml")
    guess = attrs.evolve(
        scene,
        tension=nanorom.Tension(x=0.2, y=0.2),
        material=nanorom.Material("1 TPa", scene.material.poisson_ratio, scene.material.density),
    )
    measured = Resonances.from_file(HERE / "drum-resonances.csv")
    found = identify(guess, measured)
    print(text.identification_text(found), end="\n\n")
    directory = Path(directory)
    directory.mkdir(parents=True, exist_ok=True)
    plots.resonance_figure(found, directory / "resonances.png")
    few = identify(guess, Resonances(measured.frequency[FEW], ("",) * len(FEW)))
    print(text.identification_text(few))
    return found, few


if __name__ == "__main__":
    main(*sys.argv[1:])
