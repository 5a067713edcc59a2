"""Errors against exact solutions, as the README tells them:  python -m tests.demos.accuracy

Every device is reduced with default settings (tolerance 1e-6).
"""

from collections.abc import Callable, Iterator

import numpy as np

import nanorom
from nanorom.continuation import explore
from tests.continuation.systems import REFERENCE, from_monomials
from tests.fem.exact import (
    DENSITY,
    MODULUS,
    RADIUS,
    THICKNESS,
    clamped_disc,
    drum,
    drum_tensor,
    membrane_disc,
    paper_drum,
)
from tests.fem.routes.test_drum import PAPER, TABLE_1

# Square membrane with immovable edges, nu = 0.25, side a: B_rjkl in E h/a^2. Provenance: Ritz
# solution of the in-plane problem in integrated Legendre polynomials, extrapolated to 2e-10.
SQUARE = {
    ("(1,1)", "(1,1)", "(1,1)", "(1,1)"): 11.203317022,
    ("(1,1)", "(1,1)", "(1,2)", "(1,2)"): 13.525842273,
    ("(1,1)", "(1,1)", "(2,1)", "(2,1)"): 13.525842273,
    ("(1,1)", "(1,1)", "(2,2)", "(2,2)"): 15.412928150,
    ("(1,1)", "(1,2)", "(2,1)", "(2,2)"): 12.421481085,
    ("(1,2)", "(1,2)", "(1,2)", "(1,2)"): 87.874500747,
    ("(1,2)", "(1,2)", "(2,1)", "(2,1)"): 30.320828378,
    ("(1,2)", "(1,2)", "(2,2)", "(2,2)"): 67.516445530,
    ("(2,2)", "(2,2)", "(2,2)", "(2,2)"): 178.890822665,
}


def square(side: float = 1e-4, thickness: float = 1e-7, modulus: float = 1e11) -> nanorom.Scene:
    """Square membrane without bending, with its four lowest modes."""
    return nanorom.Scene(
        geometry=nanorom.Rectangle(length=side, width=side),
        plate=nanorom.Plate(thickness=thickness, model="membrane"),
        material=nanorom.Material(youngs_modulus=modulus, poisson_ratio=0.25, density=3000.0),
        tension=nanorom.Tension(x=10.0, y=10.0),
        modes=nanorom.Modes(count=4),
    )


def drum_frequencies() -> float:
    """Clamped drums from pure plate to near membrane."""
    worst = 0.0
    for ratio in (0.0, 100.0, 1e4):
        found = nanorom.reduce(drum(ratio)).frequency
        rigidity = MODULUS * THICKNESS**3 / (12 * (1 - 0.16**2))
        scale = 2 * np.pi * np.sqrt(DENSITY * THICKNESS / rigidity) * RADIUS**2
        worst = max(worst, np.abs(found * scale / clamped_disc(ratio, 11) - 1).max())
    return worst


def paper_frequencies() -> float:
    """The paper's drum, whose tension differs between x and y."""
    model = nanorom.reduce(paper_drum())
    found = dict(zip(model.label, model.frequency / 1e6))
    return max(abs(found[label] / exact - 1) for label, exact in PAPER.items())


def drum_cubic() -> float:
    """All coefficients between the eleven lowest modes, relative to the largest."""
    exact = drum_tensor()[:11, :11, :11, :11] * MODULUS * THICKNESS / RADIUS**2
    return float(np.abs(nanorom.reduce(drum(100.0)).cubic - exact).max() / np.abs(exact).max())


def membrane_frequencies() -> float:
    """Drum without bending: zeros of Bessel functions."""
    scene = drum(100.0, model="membrane")
    scale = 2 * np.pi * RADIUS * np.sqrt(DENSITY * THICKNESS / scene.tension.x)
    return float(np.abs(nanorom.reduce(scene).frequency * scale / membrane_disc(11) - 1).max())


def table_1() -> float:
    """The eight coefficients of the paper's Table 1, each relative to itself."""
    model = nanorom.reduce(drum(100.0, count=6, model="membrane"))
    modes = {1: model.label.index("f01"), 2: model.label.index("f02")}
    unit = MODULUS * THICKNESS / RADIUS**2
    worst = 0.0
    for (r, *jkl), exact in TABLE_1.items():
        found = model.b(modes[r] + 1)[tuple(sorted(modes[i] + 1 for i in jkl))] / unit
        worst = max(worst, abs(found / exact - 1))
    return worst


def square_frequencies() -> float:
    """f_mn = sqrt(T/(rho h)) sqrt(m^2 + n^2)/(2 a)."""
    scene = square()
    model = nanorom.reduce(scene)
    film, speed = scene.geometry, np.sqrt(scene.tension.x / (3000.0 * scene.plate.thickness))
    exact = [speed / 2 / film.length * np.hypot(*_waves(label)) for label in model.label]
    return float(np.abs(model.frequency / exact - 1).max())


def _waves(label: str) -> tuple[int, int]:
    m, n = label.strip("()").split(",")
    return int(m), int(n)


def square_cubic() -> float:
    """The coefficients of SQUARE, each relative to itself."""
    scene = square().with_(accuracy=nanorom.Accuracy(1e-7))
    model = nanorom.reduce(scene)
    unit = scene.material.youngs_modulus * scene.plate.thickness / scene.geometry.length**2
    found = {
        labels: model.cubic[tuple(model.label.index(label) for label in labels)] / unit
        for labels in SQUARE
    }
    return max(abs(found[labels] / exact - 1) for labels, exact in SQUARE.items())


def special_points() -> float:
    """Drive frequencies of folds and period doublings that shooting confirms to 1e-11."""
    worst = 0.0
    for name in ("p1 direct_b0.005", "p2 direct_b0.02", "p1 par_b0.002_g0.013"):
        system, case = name.split()
        wanted = [p for p in REFERENCE["points"] if (p["system"], p["case"]) == (system, case)]
        drive = {"direct": wanted[0]["beta"], "parametric": wanted[0]["gamma"]}
        diagram = explore(from_monomials(system), tuple(REFERENCE["ranges"][name]), **drive)
        for point in wanted:
            found = [p.omega for p in diagram.points(point["type"])]
            worst = max(worst, min(abs(omega / point["W"] - 1) for omega in found))
    return worst


ROWS: dict[str, tuple[str, Callable[[], float]]] = {
    "frequencies, clamped drum, T R²/D = 0, 100, 10⁴": (
        "characteristic equation",
        drum_frequencies,
    ),
    "frequencies, the paper's drum (T_x ≠ T_y)": ("spectral solution", paper_frequencies),
    "frequencies, drum membrane": ("zeros of J_p", membrane_frequencies),
    "frequencies, square membrane": ("closed form", square_frequencies),
    "cubic tensor, clamped drum, T R²/D = 100": ("spectral solution", drum_cubic),
    "cubic coefficients of the paper's Table 1": ("Bessel series", table_1),
    "cubic coefficients, square membrane, `tolerance = 1e-7`": ("Ritz, extrapolated", square_cubic),
    "folds and period doublings": ("shooting", special_points),
}


def table() -> Iterator[tuple[str, str, float]]:
    """Quantity, exact solution and measured relative error, row by row."""
    for quantity, (exact, measure) in ROWS.items():
        yield quantity, exact, float(measure())


if __name__ == "__main__":
    print("| quantity | against | largest relative error |\n|---|---|---|")
    for quantity, exact, error in table():
        print(f"| {quantity} | {exact} | {error:.0e} |", flush=True)
