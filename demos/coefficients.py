"""Nonlinear coefficients of a drum, a string and a rectangle (the paper's Supplement II).

For each device the modal equations are, with max |phi| = 1 and q in m,

    m_r q_r'' + c_r q_r' + k_r q_r + sum_jk alpha_jk q_j q_k + sum_jkl b_jkl q_j q_k q_l = F_r

with sums over j <= k and j <= k <= l.  A flat film has no alpha, and most of its b vanish by
symmetry.  The force derives from a potential, so that b112 of equation 1 is 3 b111 of equation 2.

    python demos/coefficients.py [DIRECTORY]     leaves DEVICE.csv (all), DEVICE.tex (non-zero) and
                                                 DEVICE.png, the coefficients b_rss at a glance
"""

import sys
from pathlib import Path

import nanorom
from nanorom.files.whole import make_directory
from nanorom.plots.couplings import coupling_figure
from nanorom.rom import tables

DEVICES = {  # modes; the paper's Table 4 has seven, and a string that twists bends in its plane
    "drum": nanorom.Modes(count=7),
    "string": nanorom.Modes(select=(1, 3)),
    "rectangle": nanorom.Modes(count=6),
}
TITLES = {
    "drum": "experimental graphene drum, T_x = 0.321 and T_y = 0.257 N/m",
    "string": "silicon-nitride string, 300 um x 3 um x 100 nm",
    "rectangle": "silicon-nitride rectangle, 1 mm x 0.7 mm x 50 nm",
}


def main(directory="results/coefficients"):
    """Print the tables and write the files; return the models by device."""
    make_directory(directory)
    models = {}
    for device, modes in DEVICES.items():
        scene = nanorom.Scene.from_file(Path(__file__).with_name(f"{device}.toml"))
        models[device] = model = nanorom.reduce(scene.with_(modes=modes))
        print(f"== {TITLES[device]}\n")
        print("r  mode     frequency (Hz)    m_r (kg)   k_r (N/m)")
        for r, label in enumerate(model.label):
            numbers = f"{model.frequency[r]:16.8e} {model.mass[r]:11.4e}"
            print(f"{r + 1}  {label:6} {numbers} {model.stiffness[r, r]:11.4e}")
        print(f"\n{tables.CoefficientTable.of(model, 2).text()}\n")
        print(f"{tables.CoefficientTable.of(model, 3).text()}\n")
        tables.write_csv(model, Path(directory) / f"{device}.csv")
        tables.write_latex(model, Path(directory) / f"{device}.tex")
        coupling_figure(model, "film", Path(directory) / f"{device}.png")
    print(f"files in {directory}: CSV with all coefficients in three normalisations, LaTeX,")
    print("and pictures of b_rss in units of E h/L^2")
    return models


if __name__ == "__main__":
    main(*sys.argv[1:])
