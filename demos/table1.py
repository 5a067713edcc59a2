"""Table 1 of Keskekler et al. (arXiv:2304.01419): couplings of the first two axisymmetric modes.

An ideal drum (uniform tension, no bending, nu = 0.16) moves as w = phi_1 q_1 + phi_2 q_2 with
phi_m = J0(j_0m r/R), and its in-plane displacement follows statically:

    eta_r = b_111 q_1^3 + b_112 q_1^2 q_2 + b_122 q_1 q_2^2 + b_222 q_2^3      (r = 1, 2)

Coefficients are in units of E h/R^2.  The paper's mode 2 is negative at the centre, ours positive;
the table is in the paper's sign.  Neither tension nor size matters, so that any will do.

    python demos/table1.py [DIRECTORY]     leaves table1.png
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import nanorom
from nanorom.files.whole import make_directory
from nanorom.plots.style import COLUMN, save, styled

# b^(r)_jkl: exact, the paper's analytic column, the paper's STEP column, all in the paper's sign.
# Exact: 50-digit Bessel series, checked by a spectral Galerkin solution to 1e-13.
PAPER = {
    (1, (1, 1, 1)): (2.839702975852, 2.84, 2.84),
    (2, (1, 1, 1)): (-0.569047835511, -0.57, -0.57),
    (1, (2, 2, 2)): (-3.297553006293, -3.32, -3.29),
    (2, (2, 2, 2)): (22.944139015372, 22.76, 22.9),
    (1, (1, 1, 2)): (-1.707143506533, -1.73, -1.71),
    (2, (1, 1, 2)): (9.300841164477, 9.25, 9.27),
    (1, (1, 2, 2)): (9.300841164477, 9.25, 9.27),
    (2, (1, 2, 2)): (-9.892659018879, -9.96, -9.85),
}


def main(directory="results/table1"):
    """Print the table, draw the errors; return the coefficients by route, equation and indices."""
    drum = nanorom.Scene(
        geometry=nanorom.Disc(radius="2.5 um"),
        plate=nanorom.Plate(thickness="10 nm", model="membrane"),
        material=nanorom.Material(
            youngs_modulus="410 GPa", poisson_ratio=0.16, density="2267 kg/m^3"
        ),
        tension=nanorom.Tension.isotropic("0.289 N/m"),
        modes=nanorom.Modes(select=[1, 6]),  # f01 and f02
    )
    unit = drum.material.youngs_modulus * drum.plate.thickness / drum.geometry.radius**2
    sign = np.array([1, -1])
    found = {}
    for method in ("direct", "step"):
        model = nanorom.reduce(drum.with_(method=method))
        assert model.label == ("f01", "f02")
        for r in (1, 2):
            for indices, value in model.b(r).items():
                signs = np.prod(sign[[r - 1, *(i - 1 for i in indices)]])
                found[method, r, indices] = float(signs * value / unit)
        if method == "step":
            cases, largest = model.diagnostics["load_cases"], np.abs(model.quadratic).max()
            print(f"our STEP: {cases} load cases (others follow by symmetry of a flat film),")
            print(f"asymmetry {model.asymmetry:.0e}, largest alpha {largest:g} N/m^2\n")

    head = ("b", "exact", "analytic", "STEP", "our STEP", "our direct", "difference")
    print("                            paper   paper")
    print("{:8} {:>15} {:>9} {:>7} {:>15} {:>15} {:>11}".format(*head))
    for (r, indices), (exact, analytic, step) in PAPER.items():
        name = f"b{''.join(map(str, indices))}^({r})"
        ours = found["step", r, indices], found["direct", r, indices]
        error = max(abs(value / exact - 1) for value in ours)
        print(f"{name:8} {exact:15.10f} {analytic:9.2f} {step:7.2f}", end=" ")
        print(f"{ours[0]:15.10f} {ours[1]:15.10f} {error:11.0e}")
    print("\nunit E h/R^2; difference: of ours from exact, relative")
    for column, name in ((1, "analytic"), (2, "STEP")):
        worst = max(abs(row[column] / row[0] - 1) for row in PAPER.values())
        print(f"the paper's {name} column is within {worst:.2%} of exact")
    draw(found, Path(make_directory(directory)) / "table1.png")
    print(f"picture in {directory}: table1.png")
    return found


@styled
def draw(found, path):
    """Relative differences from the exact coefficients, on a logarithmic scale."""
    figure = Figure(figsize=(COLUMN, 0.75 * COLUMN), layout="constrained")
    axes = figure.add_subplot()
    columns = {
        "paper, analytic": [row[1] for row in PAPER.values()],
        "paper, STEP": [row[2] for row in PAPER.values()],
        "ours, STEP": [found["step", *key] for key in PAPER],
        "ours, direct": [found["direct", *key] for key in PAPER],
    }
    exact = np.array([row[0] for row in PAPER.values()])
    for number, (name, values) in enumerate(columns.items()):
        error = np.abs(np.array(values) / exact - 1).clip(1e-16)
        shift = 0.15 * (number - 1.5)
        axes.semilogy(np.arange(8) + shift, error, "osD^"[number], markersize=3.5, label=name)
    names = [f"$b_{{{''.join(map(str, jkl))}}}^{{({r})}}$" for r, jkl in PAPER]
    axes.set_xticks(range(8), names)
    axes.set_ylabel("|coefficient / exact - 1|")
    axes.set_ylim(1e-14, 1)
    axes.legend(loc="upper center", bbox_to_anchor=(0.45, 1.25), ncol=2)
    save(figure, path)


if __name__ == "__main__":
    main(*sys.argv[1:2])
