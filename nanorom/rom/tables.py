"""Tables of modes and nonlinear coefficients: to the screen, as CSV and as LaTeX.

Three normalisations, all for shapes with max |phi| = 1 and q in m:

    force   eta_r in N, coefficients in N/m^2 (alpha_jk) and N/m^3 (b_jkl): as stored
    mass    divided by the modal mass m_r: in 1/(m s^2) and 1/(m^2 s^2), as in q'' + ... = F/m
    film    in units of E h/L and E h/L^2: pure numbers, L the radius of a disc, else the length
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from nanorom.errors import ModelError
from nanorom.files.whole import atomic_path
from nanorom.rom.model import ReducedModel
from nanorom.scene.geometry import Disc, MeshFile
from nanorom.scene.scene import Scene

NORMALISATIONS = ("force", "mass", "film")
NEGLIGIBLE = 1e-9  # of the largest coefficient: zero by symmetry but for rounding
COLUMNS: tuple[str, ...] = ("equation", "order", "j", "k", "l", "modes")
COLUMNS += ("force (N/m^order)", "mass (m^(1 - order)/s^2)", "film (E h/L^(order - 1))")
UNITS = {
    "force": ("N/m^2", "N/m^3"),
    "mass": ("1/(m s^2)", "1/(m^2 s^2)"),
    "film": ("E h/L", "E h/L^2"),
}


@attrs.frozen(eq=False)
class CoefficientTable:
    """The paper's alpha_jk or b_jkl: one row for each product of amplitudes, one column per mode.

    order: 2 or 3; labels: L mode names; products: n tuples of mode places (1-based, rising);
    values: (n, L) in the normalisation's unit.
    """

    order: int
    labels: tuple[str, ...]
    products: tuple[tuple[int, ...], ...]
    values: np.ndarray
    normalisation: str

    @classmethod
    def of(
        cls, model: ReducedModel, order: int = 3, normalisation: str = "force"
    ) -> CoefficientTable:
        """All coefficients of one order; raises ModelError."""
        if normalisation not in NORMALISATIONS:
            raise ModelError(
                f"normalisation: found {normalisation!r}; allowed: {', '.join(NORMALISATIONS)}"
            )
        equations: list[Any] = [
            model.alpha(r) if order == 2 else model.b(r) for r in range(1, model.size + 1)
        ]
        products = tuple(equations[0])
        values = np.array([[equation[p] for equation in equations] for p in products])
        values = values / _unit(model, order, normalisation)
        return cls(order, model.label, products, values, normalisation)

    @property
    def unit(self) -> str:
        """Unit of the values."""
        return UNITS[self.normalisation][self.order - 2]

    def nonzero(self) -> CoefficientTable:
        """Without the products that no equation has."""
        largest = np.abs(self.values).max(initial=0.0)
        keep = np.flatnonzero((np.abs(self.values) > NEGLIGIBLE * largest).any(axis=1))
        products = tuple(self.products[i] for i in keep)
        return attrs.evolve(self, products=products, values=self.values[keep])

    def text(self) -> str:
        """For the screen: products with a coefficient, zeros as dots."""
        table, name = self.nonzero(), "b" if self.order == 3 else "alpha"
        head = f"{name}_{'jkl'[: self.order]}^(r) in {self.unit}, columns r:"
        if not table.products:
            return f"{head}\nall are zero"
        width = max(11, *(len(label) + 2 for label in self.labels))
        lines = [head, " " * 10 + "".join(label.rjust(width) for label in self.labels)]
        for product, row in zip(table.products, table.values):
            cells = [self._cell(value).rjust(width) for value in row]
            lines.append(",".join(map(str, product)).ljust(10) + "".join(cells))
        return "\n".join(lines)

    def latex(self) -> str:
        """A LaTeX tabular (booktabs) of the products with a coefficient."""
        table, name = self.nonzero(), "b" if self.order == 3 else r"\alpha"
        unit = self.unit.replace("N/m^", r"\mathrm{N/m}^")
        for plain in ("m", "s"):
            unit = unit.replace(f"({plain}", rf"(\mathrm{{{plain}}}")
        heads = " & ".join(
            rf"$f_\mathrm{{{label[1:]}}}$" if label[0] == "f" else label for label in self.labels
        )
        lines = [
            rf"% {name}^{{(r)}}_{{jkl}} in {self.unit}; max|phi| = 1, q in m; columns r",
            rf"\begin{{tabular}}{{l{'r' * len(self.labels)}}}",
            r"\toprule",
            rf"${name}_{{jkl}}^{{(r)}}$ (${unit}$) & {heads} \\",
            r"\midrule",
        ]
        for product, row in zip(table.products, table.values):
            cells = " & ".join(_latex_number(self._cell(value)) for value in row)
            lines.append(rf"${','.join(map(str, product))}$ & {cells} \\")
        return "\n".join([*lines, r"\bottomrule", r"\end{tabular}", ""])

    def _cell(self, value: float) -> str:
        if abs(value) <= NEGLIGIBLE * np.abs(self.values).max():
            return "."
        return f"{value:.4f}" if self.normalisation == "film" else f"{value:.3e}"


def write_csv(model: ReducedModel, path: str | Path) -> None:
    """Write every coefficient in all normalisations, a row for each; raises FileError."""
    with atomic_path(path) as temporary, open(temporary, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows(_rows(model))


def write_latex(model: ReducedModel, path: str | Path, normalisation: str = "force") -> None:
    """Write the tabular of b_jkl, and of alpha_jk where there are any; raises FileError."""
    tables = [CoefficientTable.of(model, order, normalisation) for order in (3, 2)]
    text = "\n".join(table.latex() for table in tables if table.nonzero().products)
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _rows(model: ReducedModel) -> Iterator[tuple[object, ...]]:
    for order in (2, 3):
        tables = [CoefficientTable.of(model, order, name) for name in NORMALISATIONS]
        for r in range(model.size):
            for i, product in enumerate(tables[0].products):
                places = [*product, *[""] * (3 - order)]
                names = "*".join(model.label[p - 1] for p in product)
                values = [f"{table.values[i, r]:.9e}" for table in tables]
                yield (r + 1, order, *places, names, *values)


def _unit(model: ReducedModel, order: int, normalisation: str) -> np.ndarray:
    """What to divide a coefficient of each equation (L,) by."""
    if normalisation == "force":
        return np.ones(model.size)
    if normalisation == "mass":
        return model.mass
    if not model.scene:
        raise ModelError("normalisation: film needs the scene, which this model does not hold")
    scene = Scene.from_toml(model.scene)
    geometry = scene.geometry
    if isinstance(geometry, Disc):
        length = geometry.radius
    else:
        length = geometry.scale if isinstance(geometry, MeshFile) else geometry.length
    stiffness = scene.material.youngs_modulus * scene.plate.thickness
    return np.full(model.size, stiffness / length ** (order - 1))


def _latex_number(cell: str) -> str:
    if cell == ".":
        return "0"
    mantissa, _, exponent = cell.partition("e")
    return f"${mantissa}$" if not exponent else rf"${mantissa}\times10^{{{int(exponent)}}}$"
