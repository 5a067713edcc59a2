"""Write docs/outside.md: published tables and other codes' printed results beside ours.

./run python -m tests.benchmarks.outside
"""

from pathlib import Path

import attrs
import numpy as np

import nanorom
from nanorom import Disc, Material, Modes, Plate, Rectangle, Scene, Support, Tension
from nanorom.scene.scene import Accuracy

DOCUMENT = Path(__file__).parents[2] / "docs" / "outside.md"
HEAD = """# Numbers of others

What others printed, beside what this package computes; `./run python -m tests.benchmarks.outside`
writes this page anew, and the suite holds it against a new computation. Where a difference is more
than the printed digits, the last column says whose it is. Beside these: the paper's Table 1
(`demos/table1.py`), its Table 4 entry by entry (`demos/table4.py`), and five nonlinear shells
(`tests/benchmarks/shells`). Plates: omega L^2 (rho h/D)^(1/2), L the radius or the side.

| problem | quantity | printed | ours | difference | of the difference |
| --- | --- | --- | --- | --- | --- |
"""
LEISSA = "Leissa, Vibration of Plates, NASA SP-160 (1969)"
RITZ = "Leissa 1973, doi:10.1016/S0022-460X(73)80371-2"


@attrs.frozen
class Row:
    """One printed number and ours; why: what makes the difference."""

    problem: str
    quantity: str
    printed: float
    ours: float
    why: str

    def line(self) -> str:
        """Of the table."""
        difference = f"{100 * (self.ours / self.printed - 1):+.3f} %"
        cells = self.problem, self.quantity, f"{self.printed:g}", f"{self.ours:.6g}", difference
        return f"| {' | '.join((*cells, self.why))} |"


def film(geometry, edge, count, nu=0.3, **changes):
    """A plate of thickness .01 without units, and what its angular frequencies are measured in."""
    fields = {
        "geometry": geometry,
        "plate": Plate(0.01, model="plate"),
        "material": Material(1.0, nu, 1.0),
        "support": Support(edge),
        "modes": Modes(count=count),
        "accuracy": Accuracy(tolerance=1e-6),
    }
    scene = Scene(**(fields | changes))
    h, material = scene.plate.thickness, scene.material
    bending = material.youngs_modulus * h**3 / 12 / (1 - nu**2)
    return nanorom.reduce(scene), np.sqrt(bending / (material.density * h))


def plates():
    """Linear frequencies omega L^2 (rho h/D)^(1/2), L the radius or the side."""
    ritz = "the printed one is Ritz' upper bound"
    digits = "the printed digits"
    tables = (
        (f"clamped disc ({LEISSA})", Disc(1), "clamped", 0.3, (10.2158, 21.26, 34.88, 39.771),
         (0, 1, 3, 5), digits),
        (f"free disc, nu .33 ({LEISSA})", Disc(1), "free", 0.33, (5.253, 9.084, 12.23, 20.52),
         (0, 2, 3, 5), "the characteristic equation has ours"),
        (f"clamped square ({RITZ})", Rectangle(1, 1), "clamped", 0.3, (35.992, 73.413, 108.27),
         (0, 1, 3), ritz),
        (f"free square ({RITZ})", Rectangle(1, 1), "free", 0.3, (13.489, 19.789, 24.432, 35.024),
         (0, 1, 2, 3), ritz),
    )  # fmt: skip
    for problem, geometry, edge, nu, printed, places, why in tables:
        model, unit = film(geometry, edge, max(places) + 1, nu)
        for value, place in zip(printed, places):
            ours = 2 * np.pi * model.frequency[place] / unit
            yield Row(problem, f"mode {model.label[place]}", value, float(ours), why)


def square_of_ssmtool():
    """1 m square, 10 mm, E 70 GPa, rho 2700, nu .33, u = v = w = 0 on the edges."""
    model, _ = film(
        Rectangle(1, 1),
        "simply_supported",
        3,
        0.33,
        plate=Plate(0.01, model="plate"),
        material=Material(70e9, 0.33, 2700),
    )
    problem = "supported square (SSMTool 2, 800 triangles), rad/s"
    why = "its mesh of flat triangles; exact are 307.357 and 768.392"
    for printed, place in ((307.2, 0), (767.2, 1), (768.2, 2)):
        ours = 2 * np.pi * model.frequency[place]
        yield Row(problem, f"mode {place + 1}", printed, float(ours), why)


def drum_of_davidovikj():
    """Cubic stiffness of a graphene drum's first mode by its radius and E h."""
    nu, radius, h = 0.16, 2.5e-6, 5e-9
    model, _ = film(
        Disc(radius),
        "clamped",
        1,
        nu,
        plate=Plate(h, model="membrane"),
        material=Material(1e12, nu, 2267),
        tension=Tension(0.3),
    )
    printed = np.pi / (1.27 - 0.97 * nu - 0.27 * nu**2)
    yield Row(
        "graphene drum, nu .16 (Davidovikj et al. 2017, doi:10.1038/s41467-017-01351-4)",
        "k3 by E h/R^2",
        round(float(printed), 4),
        float(model.cubic[0, 0, 0, 0] * radius**2 / (1e12 * h)),
        "its formula is rounded to two digits",
    )


def rows():
    """All of them."""
    return [*plates(), *square_of_ssmtool(), *drum_of_davidovikj()]


def page():
    """The page's text."""
    return HEAD + "\n".join(row.line() for row in rows()) + "\n"


if __name__ == "__main__":
    DOCUMENT.write_text(page(), encoding="utf-8")
