"""Frequencies of polygons and sectors from files, whose exact values are in closed form.

A membrane whose tension is A A^T is, in the coordinates of A, one of equal tension: random
parallelograms and triangles have the frequencies of the square and of the equilateral triangle
(k^2 = (4 pi/3)^2 (m^2 + m n + n^2) on sides of 1; Lame, see McCartin 2003,
doi:10.1137/S003614450238720).  A simply supported plate on a convex polygon has the squares of the
membrane's wave numbers.  The first eigenvalue of the L-shaped membrane is that of Betcke and
Trefethen 2005, doi:10.1137/S0036144503437336, the third is 2 pi^2; their method of particular
solutions, with 40 functions, gives all three to 1e-8.
"""

import warnings
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import jv

from nanorom.errors import AccuracyWarning
from nanorom.fem.reduce import reduce_scene
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import MeshFile
from nanorom.scene.material import Material
from nanorom.scene.scene import Accuracy, Modes, Scene
from nanorom.scene.support import Support

TOLERANCE = 1e-4
UNDERRATED = 3.0  # true error by the estimate, at most
ROUNDING = 1e-13
THICKNESS, NU = 1e-3, 0.3
SQUARE = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
EQUILATERAL = [(0.0, 0.0), (1.0, 0.0), (0.5, np.sqrt(0.75))]
ISOSCELES = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]
L_SHAPE = [(0.0, 0.0), (-1.0, 0.0), (-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (0.0, 1.0)]
L_WAVES = np.sqrt([9.6397238440219, 15.1972519264546, 2 * np.pi**2])
COUNTS = np.arange(1, 15)
M, N = (grid.ravel() for grid in np.meshgrid(COUNTS, COUNTS))
SQUARE_WAVES = np.pi * np.sqrt(np.sort(M**2 + N**2))
EQUILATERAL_WAVES = 4 * np.pi / 3 * np.sqrt(np.sort(M**2 + M * N + N**2))
ISOSCELES_WAVES = np.pi * np.sqrt(np.sort((M**2 + N**2)[M > N]))
MOST_STRETCHED = 5.0  # condition of a random A: beyond, cells are slivers


def geometry(points, lines):
    """Text of a film whose rim are some lines or arcs about the first point."""
    size = 0.3 * float(np.ptp(np.array(points), axis=0).min())
    text = [f"Point({i}) = {{{x!r}, {y!r}, 0, {size!r}}};" for i, (x, y) in enumerate(points, 1)]
    text += [f"{kind}({i}) = {{{ends}}};" for i, (kind, ends) in enumerate(lines, 1)]
    rim = ", ".join(str(i) for i in range(1, len(lines) + 1))
    return "\n".join(
        [
            *text,
            f"Curve Loop(1) = {{{rim}}}; Plane Surface(1) = {{1}};",
            f'Physical Surface("film") = {{1}}; Physical Curve("rim") = {{{rim}}};\n',
        ]
    )


def polygon(points):
    """Straight sides from corner to corner."""
    points = [(float(x), float(y)) for x, y in points]
    n = len(points)
    return geometry(points, [("Line", f"{i + 1}, {(i + 1) % n + 1}") for i in range(n)])


def sector(angle):
    """Of the unit disc, from the x axis on."""
    arcs = int(np.ceil(angle / (np.pi / 2)))
    turns = angle / arcs * np.arange(arcs + 1)
    points = [(0.0, 0.0), *((float(np.cos(t)), float(np.sin(t))) for t in turns)]
    middle = [("Circle", f"{i + 2}, 1, {i + 3}") for i in range(arcs)]
    return geometry(points, [("Line", "1, 2"), *middle, ("Line", f"{arcs + 2}, 1")])


def sector_waves(angle, count):
    """Zeros of the Bessel functions whose sines vanish on both straight sides."""
    found = []
    grid = np.linspace(0.5, 15.0, 2000)
    for order in np.arange(1, 12) * np.pi / angle:
        values = jv(order, grid)
        turns = np.flatnonzero(values[:-1] * values[1:] < 0)
        found += [brentq(lambda k, n=order: jv(n, k), grid[i], grid[i + 1]) for i in turns]
    return np.sort(found)[:count]


def solved(folder, text, count, tension=None):
    """Model of a film of density and modulus 1: a membrane, or a simply supported plate."""
    Path(folder / "film.geo").write_text(text)
    kind = "membrane" if tension else "plate"
    scene = Scene(
        geometry=MeshFile(file=folder / "film.geo", scale=1.0),
        plate=Plate(thickness=THICKNESS, model=kind),
        material=Material(youngs_modulus=1.0, poisson_ratio=NU, density=1.0),
        tension=tension or Tension(0.0, 0.0),
        support=Support({"rim": "clamped" if tension else "simply_supported"}),
        modes=Modes(count=count),
        accuracy=Accuracy(tolerance=TOLERANCE),
    )
    return reduce_scene(scene)


def assert_right(model, wave, stiffness):
    """omega^2 = stiffness k^2 (membrane) or stiffness k^4 (plate), by mass per area."""
    exact = np.sqrt(stiffness / THICKNESS) * wave / (2 * np.pi)
    error = np.abs(model.frequency / exact - 1).max()
    assert error < TOLERANCE
    assert error < UNDERRATED * model.diagnostics["error_frequency"] + ROUNDING


@pytest.mark.parametrize("seed", range(6))
def test_random_triangles_and_parallelograms_have_their_exact_frequencies(tmp_path, seed):
    random = np.random.default_rng(seed)
    corners, waves = ((EQUILATERAL, EQUILATERAL_WAVES), (SQUARE, SQUARE_WAVES))[seed % 2]
    shape = random.normal(size=(2, 2))
    while np.linalg.det(shape) < 0 or np.linalg.cond(shape) > MOST_STRETCHED:
        shape = random.normal(size=(2, 2))
    squared = 1e-3 * THICKNESS * shape @ shape.T / np.trace(shape @ shape.T)
    tension = Tension(x=squared[0, 0], y=squared[1, 1], xy=squared[0, 1])
    count = int(random.integers(2, 6))
    with warnings.catch_warnings():
        # pairs that no turn of the film explains have entries of the tensor of their own mixture
        warnings.filterwarnings("ignore", "(?s).*exact pair", AccuracyWarning)
        model = solved(tmp_path, polygon(np.array(corners) @ shape.T), count, tension)
    assert_right(model, waves[:count], 1e-3 * THICKNESS / np.trace(shape @ shape.T))


@pytest.mark.parametrize(
    "text, waves",
    [
        (polygon(ISOSCELES), ISOSCELES_WAVES[:4]),
        (polygon(L_SHAPE), L_WAVES),
        (sector(np.pi / 3), sector_waves(np.pi / 3, 4)),
        (sector(1.5 * np.pi), sector_waves(1.5 * np.pi, 4)),
    ],
    ids=["isosceles", "L", "sector 60", "sector 270"],
)
def test_membranes_with_corners_have_their_exact_frequencies(tmp_path, text, waves):
    tension = 1e-3 * THICKNESS
    assert_right(solved(tmp_path, text, len(waves), Tension(tension, tension)), waves, tension)


@pytest.mark.parametrize(
    "corners, waves", [(EQUILATERAL, EQUILATERAL_WAVES), (ISOSCELES, ISOSCELES_WAVES)]
)
def test_simply_supported_triangular_plates_have_squared_waves(tmp_path, corners, waves):
    rigidity = THICKNESS**3 / (12 * (1 - NU**2))
    assert_right(solved(tmp_path, polygon(corners), 4), waves[:4] ** 2, rigidity)
