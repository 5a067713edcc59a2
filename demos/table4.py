"""The paper's Table 4 (Supplement II), entry by entry beside the model of the same drum.

Seven modes f01 f11s f21c f02 f31s f12s f03, equations with sums over j <= k <= l, in E h/R^2.  The
tensions and Poisson's ratio are the paper's; its frequency ratios then fix the bending stiffness:
E = 650 GPa at 10 nm, T R^2/D = 32.5.  A mode may be turned upside down: the signs that fit best.
`table4.csv` was taken down from a public transcription (rknetemann/poscidyn,
tests/ata/multimode/parameters_table_4.py, commit 8d71fc1f), three digits.

    python demos/table4.py [E in GPa]
"""

import sys
from itertools import permutations, product
from pathlib import Path

import numpy as np

import nanorom
from nanorom.scene.scene import Accuracy

MODES = ("f01", "f11s", "f21c", "f02", "f31s", "f12s", "f03")
RATIOS = np.array([1, 1.73, 2.59, 2.89, 3.54, 4.07, 5.73])
MASSES = np.array([0.204, 0.195, 0.183, 0.103, 0.192, 0.118, 0.0698])  # of rho h pi R^2
LARGE = 5.0  # E h/R^2: entries from here on are compared


def published():
    """B (7, 7, 7, 7) of the table, symmetric in the last three, and its median asymmetry."""
    rows = np.loadtxt(Path(__file__).with_name("table4.csv"), delimiter=",", skiprows=2)
    cubic = np.zeros((7,) * 4)
    for row in rows:
        orders = set(permutations(row[:3].astype(int) - 1))
        for order in orders:
            cubic[(slice(None), *order)] = row[3:] / len(orders)
    turned = np.stack([np.moveaxis(cubic, 0, place) for place in range(4)])
    spread = np.ptp(turned, axis=0)[np.abs(turned).min(axis=0) > LARGE / 3]
    size = np.abs(turned).mean(axis=0)[np.abs(turned).min(axis=0) > LARGE / 3]
    return cubic, float(np.median(spread / size))


def model_of(modulus):
    """Frequency ratios (7,) and B (7, 7, 7, 7) in E h/R^2 of the drum with a modulus in Pa."""
    scene = nanorom.Scene(
        geometry=nanorom.Disc(radius="2.5 um"),
        plate=nanorom.Plate(thickness="10 nm", model="plate"),
        material=nanorom.Material(modulus, 0.16, "2267 kg/m^3"),
        tension=nanorom.Tension("0.321 N/m", "0.257 N/m"),
        modes=nanorom.Modes(count=17),
        accuracy=Accuracy(tolerance=1e-4),
    )
    model = nanorom.reduce(scene)
    own = [model.label.index(name) for name in MODES]
    unit = modulus * 10e-9 / 2.5e-6**2
    return model.frequency[own] / model.frequency[0], model.cubic[np.ix_(own, own, own, own)] / unit


def signed(ours, theirs):
    """Ours (7, 7, 7, 7) with the signs of modes that fit theirs best, and those signs (7,)."""
    signs = [np.array([1, *s]) for s in product((1, -1), repeat=6)]
    turned = [ours * np.einsum("i,j,k,l->ijkl", s, s, s, s) for s in signs]
    best = min(range(len(signs)), key=lambda i: np.abs(turned[i] - theirs).sum())
    return turned[best], signs[best]


def meeting(cubic):
    """Drive by f01 at which the backbone of f01, at half of it, meets that of f21, by the table.

    omega1^2 + 3/4 B11/m1 a^2 = (W/2)^2 and omega3^2 + 3/2 B31/m3 a^2 = W^2, omega1 = 1.
    """
    ratio = cubic[2, 0, 0, 2] / MASSES[2] / (cubic[0, 0, 0, 0] / MASSES[0])
    return np.sqrt((RATIOS[2] ** 2 - 2 * ratio) / (1 - ratio / 2))


def main(gigapascals="650"):
    """Print both tables; return ratios (7,), median difference of large entries, asymmetry."""
    theirs, asymmetry = published()
    ratios, ours = model_of(float(gigapascals) * 1e9)
    ours, signs = signed(ours, theirs)
    turned = " ".join(f"{sign:+d}" for sign in signs)
    print(f"E = {gigapascals} GPa; signs of the modes beside ours: {turned}")
    print("\nmode   f/f01, paper   f/f01, ours   difference")
    for name, paper, own in zip(MODES, RATIOS, ratios):
        print(f"{name:6} {paper:12.2f} {own:13.3f} {100 * (own / paper - 1):+10.2f} %")
    print("\nequation  entry   b, paper     b, ours   difference")
    differences = []
    for r, j, k, l in np.ndindex(ours.shape):
        if not j <= k <= l:
            continue
        count = len(set(permutations((j, k, l))))
        paper, own = count * theirs[r, j, k, l], count * ours[r, j, k, l]
        if abs(paper) > LARGE:
            differences.append(abs(own / paper - 1))
            entry = f"{j + 1}{k + 1}{l + 1}"
            print(
                f"{r + 1:8}  {entry:5} {paper:10.3f} {own:11.3f} {100 * (own / paper - 1):+9.2f} %"
            )
    median = float(np.median(differences))
    print(f"\n{len(differences)} entries above {LARGE:g}: median difference {100 * median:.2f} %, ")
    print(f"the table's own asymmetry {100 * asymmetry:.2f} % in the median")
    print(f"f01 at half the drive meets f21 at {meeting(theirs):.2f} f01 by the table's numbers")
    return ratios, median, asymmetry


if __name__ == "__main__":
    main(*sys.argv[1:])
