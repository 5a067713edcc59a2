"""Extreme parameters, each against an exact solution: right, or told that it is not, or refused."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator
from pathlib import Path

import attrs
import numpy as np

from nanorom.bench import accuracy, measure
from nanorom.errors import NanoromError
from nanorom.exact import cases
from nanorom.exact.cases import BUCKLING, Case, Film
from nanorom.scene.geometry import MeshFile
from nanorom.scene.scene import Accuracy
from nanorom.scene.units import to_si
from nanorom.workflow import reduce

TOLERANCE = 1e-6
BUCKLING_ERROR = 1e-6  # of the critical tension that the message tells


@attrs.frozen
class Trial:
    """A parameter at an extreme, and what came of it."""

    parameter: str
    value: str
    dofs: int
    seconds: float
    error_frequency: float
    estimate_frequency: float
    error_tensor: float
    estimate_tensor: float
    verdict: str

    @property
    def sound(self) -> bool:
        """Right to what was claimed, or refused with a message; never silent nonsense."""
        return self.verdict.startswith(("ok", "refused"))


def rows(quick: bool = False) -> Iterator[Trial]:
    """All trials; quick: the ends of each range only, with few modes."""
    count = 3 if quick else 11
    yield from tensions(quick, count)
    yield from materials(quick, count)
    yield from sizes(quick, count)
    yield from unequal_tensions(quick, count)
    yield from many_modes(quick)
    yield from nearly_degenerate()
    yield from poor_triangles(quick)
    yield from compression(quick)


def tensions(quick: bool, count: int) -> Iterator[Trial]:
    """T R^2/D from 0 to 1e8, and the membrane."""
    kappas = (0.0, 1e8) if quick else (0.0, 1.0, 1e2, 1e4, 1e5, 1e6, 1e7, 1e8, np.inf)
    for kappa in kappas:
        few = min(count, 3 if kappa > 1e6 and np.isfinite(kappa) else count)
        yield trial("T R^2/D", f"{kappa:g}", cases.drum(kappa, few))


def materials(quick: bool, count: int) -> Iterator[Trial]:
    """nu from -0.9 to 0.499, E from 1 kPa to 1 TPa."""
    for nu in (-0.9, 0.499) if quick else (-0.9, -0.5, 0.0, 0.3, 0.45, 0.49, 0.499):
        yield trial("nu", f"{nu:g}", cases.drum(100.0, count, Film(nu=nu)))
    for modulus in (1e3,) if quick else (1e3, 1e6, 1e12):
        yield trial("E", f"{modulus:g} Pa", cases.drum(100.0, count, Film(modulus=modulus)))


def sizes(quick: bool, count: int) -> Iterator[Trial]:
    """Radius from 1 nm to 1 m, h/R from 1e-6 to 0.1."""
    for radius in (1e-9,) if quick else (1e-9, 1e-7, 1e-3, 1.0):
        film = Film(radius=radius, thickness=0.01 * radius)
        yield trial("R", f"{radius:g} m", cases.drum(100.0, count, film))
    for ratio in (1e-6,) if quick else (1e-6, 1e-4, 1e-2, 0.1):
        film = Film(thickness=ratio * cases.RADIUS)
        yield trial("h/R", f"{ratio:g}", cases.drum(100.0, count, film))


def unequal_tensions(quick: bool, count: int) -> Iterator[Trial]:
    """T_x/T_y from 1 to 100."""
    for ratio in (100.0,) if quick else (3.0, 10.0, 100.0):
        case = cases.unequal_drum(100.0, 100.0 / ratio, count)
        yield trial("T_x/T_y", f"{ratio:g}", case)


def many_modes(quick: bool) -> Iterator[Trial]:
    """L up to 60."""
    for count in (20,) if quick else (30, 60):
        yield trial("L", str(count), cases.drum(100.0, count))


def nearly_degenerate() -> Iterator[Trial]:
    """Pairs split by less than the discretisation's error, and by more."""
    for split in (1e-10, 1e-6, 1e-3):
        # a lower tension along x makes f11c the lower of its pair
        case = cases.unequal_drum(100.0 * (1 - split), 100.0, 3)
        yield trial("1 - T_x/T_y", f"{split:g}", case)
    # longer along y: (1,2) is below (2,1), and the square's tensor is right to the split
    split = 1e-9
    yield trial("rectangle, 1 - a/b", f"{split:g}", cases.square(4, split))


def poor_triangles(quick: bool) -> Iterator[Trial]:
    """Square membrane on a mesh file whose rows are thin beside their neighbours."""
    square = cases.square(4)
    for thin in (1e-3,) if quick else (1e-1, 1e-2, 1e-3, 1e-4, 1e-5):
        with tempfile.TemporaryDirectory() as directory:
            file = Path(directory) / "slivers.msh"
            side = square.scene.geometry.length  # type: ignore[union-attr]
            write_slivers(file, thin)
            scene = square.scene.with_(
                geometry=MeshFile(file=file, scale=side),
                accuracy=Accuracy(degree=8, mesh_size=side),
            )
            case = cases.with_scene(square, scene)
            yield trial("height of slivers/side", f"{thin:g}", case, None)


def write_slivers(file: Path, thin: float, cells: int = 4) -> None:
    """Unit square in gmsh's format 2.2, every second row ``thin`` high; boundary "edge"."""
    heights = np.where(np.arange(2 * cells) % 2, thin, 1.0)
    y = np.concatenate([[0.0], np.cumsum(heights)]) / heights.sum()
    x = np.linspace(0, 1, cells + 1)
    n_x, n_y = len(x), len(y)
    number = np.arange(n_x * n_y).reshape(n_y, n_x) + 1
    nodes = [f"{number[j, i]} {x[i]!r} {y[j]!r} 0" for j in range(n_y) for i in range(n_x)]
    boundary = [*zip(number[0], number[0, 1:]), *zip(number[-1], number[-1, 1:])]
    boundary += [*zip(number[:, 0], number[1:, 0]), *zip(number[:, -1], number[1:, -1])]
    elements = [f"1 2 1 1 {a} {b}" for a, b in boundary]
    for j in range(n_y - 1):
        for i in range(n_x - 1):
            a, b, c, d = number[j, i], number[j, i + 1], number[j + 1, i + 1], number[j + 1, i]
            elements += [f"2 2 2 2 {a} {b} {c}", f"2 2 2 2 {a} {c} {d}"]
    numbered = [f"{i + 1} {element}" for i, element in enumerate(elements)]
    file.write_text(
        "\n".join(
            ["$MeshFormat", "2.2 0 8", "$EndMeshFormat"]
            + ["$PhysicalNames", "2", '1 1 "edge"', '2 2 "film"', "$EndPhysicalNames"]
            + ["$Nodes", str(len(nodes)), *nodes, "$EndNodes"]
            + ["$Elements", str(len(numbered)), *numbered, "$EndElements", ""]
        )
    )


def compression(quick: bool) -> Iterator[Trial]:
    """Below buckling the frequencies are right, beyond it the message tells the critical value."""
    for fraction in (0.99,) if quick else (0.5, 0.9, 0.99, 0.999, 0.9999):
        case = cases.drum(-fraction * BUCKLING, 3)
        yield trial("compression/buckling", f"{fraction:g}", case)
    for fraction in (1.01,) if quick else (1.0001, 1.01, 2.0, 20.0):
        yield buckled(fraction)


def buckled(fraction: float) -> Trial:
    """A film compressed beyond buckling; the critical tension in the message is held against
    the exact one."""
    case = cases.with_tolerance(cases.drum(-fraction * BUCKLING, 3), TOLERANCE)
    nan = float("nan")
    verdict, error = "wrong: a buckled film was taken for a stable one", nan
    try:
        reduce(case.scene)
    except NanoromError as failure:
        told = re.search(r"critical.*?(-\d[\d.]* \S*N/m)", str(failure))
        verdict = f"wrong: no critical tension in: {failure}"
        if told is not None:
            critical = -BUCKLING * Film().tension_unit
            error = abs(to_si(told.group(1), "N/m", "tension") / critical - 1)
            verdict = f"refused: {failure}" if error < BUCKLING_ERROR else f"wrong: {failure}"
    return Trial("compression/buckling", f"{fraction:g}", 0, nan, error, nan, nan, nan, verdict)


def trial(parameter: str, value: str, case: Case, tolerance: float | None = TOLERANCE) -> Trial:
    """Solve a case and judge it; without a tolerance the estimate alone is judged."""
    if tolerance is not None:
        case = cases.with_tolerance(case, tolerance)
    row = measure.reduction(case, repeats=0)
    claimed = tolerance is None or bool(row.estimate <= tolerance)
    verdict = accuracy.verdict(row, np.inf if tolerance is None else tolerance, claimed)
    return Trial(
        parameter,
        value,
        row.dofs,
        row.seconds,
        row.error_frequency,
        row.estimate_frequency,
        row.error_tensor,
        row.estimate_tensor,
        verdict,
    )
