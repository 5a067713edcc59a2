"""What the phenomena of Fig. 3 of Keskekler et al. depend on: one thing changed at a time.

The drum of demos/fig3.py with bending switched off is run again with another bending, Young's
modulus, tension, drive and set of modes.  Every run follows the doubled branch of f01 at the same
levels, gamma by the threshold of f01, and prints where f01 meets f21 (backbones), how far the
branch is stable from 2 f01 on, its highest stable point and the Neimark-Sacker point nearest to the
paper's.  Without bending Young's modulus only scales the amplitudes, by E^(-1/2).

    python demos/dependence.py [DIRECTORY]     leaves dependence.png
"""

import sys
from pathlib import Path

import fig3
import numpy as np
import phenomena as ph
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

import nanorom
from nanorom.files.whole import make_directory
from nanorom.plots.style import COLUMN, save, styled

LEVELS = (1.6, 2.4)
PRESSURE = 8.0  # Pa per step of the ladder: f01 is driven as by the spot
ELEVEN = tuple(range(1, 12))
AXISYMMETRIC_AND_F21 = ("f01", "f21c", "f02", "f03")  # the paper's modes 1, 4, 6, 15
EVEN = ("f01", "f21c", "f02", "f41c", "f22c", "f03")  # all that a pressure can move


def spot(x, y, beta=1.0):
    """A drive by the spot of demos/fig3.py at another place or with another beta, by the ladder."""
    aim = fig3.SPOT | {"position": [x * 1e-6, y * 1e-6]}
    return {"direct": beta * fig3.BETA, **aim}


BASE = {"model": "membrane", "modes": ELEVEN, "drive": spot(1.0, 0.6)}
CASES = {
    "bending off": {},
    "E = 410 GPa, clamped": {"model": "auto"},
    "E = 41 GPa, clamped": {"model": "auto", "modulus": 41e9},
    "E = 410 MPa, clamped": {"model": "auto", "modulus": 410e6},
    "T_x = T_y = 0.289 N/m": {"tension": (0.289, 0.289)},
    "T_x, T_y = 0.35, 0.23 N/m": {"tension": (0.35, 0.23)},
    "spot at (0.5, 1.2) um": {"drive": spot(0.5, 1.2)},
    "beta doubled": {"drive": spot(1.0, 0.6, 2.0)},
    "with f03": {"modes": (*ELEVEN, "f03")},
    "pressure (6 modes move)": {"modes": EVEN, "drive": {"direct": PRESSURE}},
    "pressure, E = 41 GPa": {"modes": EVEN, "drive": {"direct": PRESSURE}, "modulus": 41e9},
    "pressure, modes 1 4 6 15": {"modes": AXISYMMETRIC_AND_F21, "drive": {"direct": PRESSURE}},
    "pressure, f01 and f21c": {"modes": ("f01", "f21c"), "drive": {"direct": PRESSURE}},
    "f01 alone": {"modes": ("f01",), "drive": {"direct": PRESSURE}},
}


def reduced(
    drive,
    model="membrane",
    modulus=410e9,
    tension=(0.321, 0.257),
    modes=ELEVEN,
    count=fig3.MODES,
):
    """The drum of a case, its modes chosen among the lowest ``count``."""
    scene = nanorom.Scene.from_file(Path(__file__).with_name("drum.toml"))
    thickness, material = scene.plate.thickness, scene.material
    material = nanorom.Material(modulus, material.poisson_ratio, material.density)
    plate = nanorom.Plate(thickness=thickness, model=model)
    scene = scene.with_(plate=plate, material=material, tension=nanorom.Tension(*tension))
    scene = scene.with_(modes=count, drive=nanorom.Drive(**drive))
    full = nanorom.reduce(scene)
    return full.select(list(modes))


def levels(reduced_model, drive, modulus=410e9, **_):
    """The drive of a case; beta goes with E^(-1/2) as the amplitudes do."""
    beta = drive["direct"] * (410e9 / modulus) ** 0.5
    aim = {name: value for name, value in drive.items() if name != "direct"}
    gamma = ph.threshold(reduced_model, nanorom.Drive(1.0, **aim))[0]
    return nanorom.Drive(
        [beta * step for step in LEVELS],
        [gamma * step for step in LEVELS],
        parametric_pattern="paper",
        **aim,
    )


def main(directory="results/dependence", names=tuple(CASES)):
    """Run the cases, print and draw; return `Reach` by name and level, and where f01 meets f21."""
    print("drum of demos/fig3.py: R = 2.5 um, h = 10 nm, nu = 0.16, rho = 2267 kg/m^3, Q = 180;")
    print("unless the case says otherwise: bending off, T_x = 0.321, T_y = 0.257 N/m, 11 modes,")
    print("spot of 1/e^2 radius 1 um at (1.0, 0.6) um, beta = 60 Pa and pressure 8 Pa x level,")
    print("times (E/410 GPa)^(-1/2); frequencies by f01, levels by the threshold of gamma\n")
    print(f"{'case':26} f01 (MHz)  meets f21  level  stable to  highest      NS  modes there")
    found, meets = {}, {}
    for name in names:
        case = BASE | CASES[name]
        model = reduced(**case)
        sweep = nanorom.Sweep("1.96 f1", "2.04 f1", tolerance=fig3.TOLERANCE)
        response = nanorom.respond(model, levels(model, **case), sweep)
        found[name] = [ph.reach(diagram, model) for diagram in response.diagrams]
        f21 = "f21c" in model.label
        meets[name] = ph.internal_resonance(model, "f21c") if f21 else np.nan
        start = f"{name:26} {model.frequency[0] / 1e6:9.4f} {meets[name]:10.3f}"
        for level, diagram, reach in zip(LEVELS, response.diagrams, found[name]):
            torus = ph.nearest_torus(diagram, model)
            modes = ph.most_excited(model, torus.orbit, 4) if torus else ""
            row = f"{level:6g} {reach.first:7.3f} {reach.lost:2} {reach.peak:8.3f}"
            print(f"{start} {row} {reach.torus:7.4f}  {modes}", flush=True)
            start = " " * len(start)
    draw(found, meets, make_directory(directory) / "dependence.png")
    print(f"\npicture in {directory}: dependence.png")
    return found, meets


@styled
def draw(found, meets, path):
    """How far the doubled branch is stable in every case, a panel per level."""
    rows = np.arange(len(found))
    figure = Figure(figsize=(COLUMN, 1.3 + 0.25 * len(found)), layout="constrained")
    panels = figure.subplots(1, len(LEVELS), sharex=True, sharey=True)
    for number, (axes, level) in enumerate(zip(panels, LEVELS)):
        reach = [reaches[number] for reaches in found.values()]
        first = np.array([r.first for r in reach])
        axes.barh(rows, first - 2, left=2, height=0.55, color="C0")
        axes.plot([r.peak for r in reach], rows, "|", color="C3", markersize=7, markeredgewidth=1.6)
        axes.plot([r.torus for r in reach], rows, "o", color="white", markeredgecolor="0.1",
                  markersize=3.2, markeredgewidth=0.8)  # fmt: skip
        axes.plot(list(meets.values()), rows, "x", color="C1", markersize=4)
        for paper in (ph.PAPER_NS, ph.PAPER_PEAK):
            axes.axvline(paper, color="0.4", linewidth=0.7, linestyle="--", zorder=0)
        axes.set_title(f"level {level:g}")
        axes.set_xlim(2, 4.1)
    panels[0].set_yticks(rows, list(found), fontsize=6)
    panels[0].invert_yaxis()
    figure.supxlabel("drive frequency / f01", fontsize=8)
    marks = {"linestyle": "none"}
    handles = [
        Line2D([], [], color="C0", linewidth=4, label="stable from 2 f01"),
        Line2D([], [], marker="|", color="C3", label="highest stable", **marks),
        Line2D([], [], marker="o", color="0.1", markerfacecolor="white", label="NS", **marks),
        Line2D([], [], marker="x", color="C1", label="f01 meets f21", **marks),
        Line2D([], [], color="0.4", linewidth=0.7, linestyle="--", label="paper: 2.538, 3.5"),
    ]
    figure.suptitle("\n")  # keeps the legend's place
    figure.legend(handles=handles, loc="upper center", ncol=3, handlelength=1.4)
    save(figure, path)


if __name__ == "__main__":
    main(*sys.argv[1:2])
