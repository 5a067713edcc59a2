"""Discs and rectangles meshed here are those of gmsh's geometry files, and need no gmsh."""

import subprocess
import sys

import numpy as np
import pytest
from scipy.spatial import cKDTree

from nanorom.fem.mesh.curved import reference_element
from nanorom.fem.mesh.gmsh import MESHES, GmshFile
from nanorom.fem.mesh.shapes import Grid, Rings
from nanorom.fem.symmetry import Mirrors

AREA = 1e-13  # of curved cells of order 8, of a disc's
SAME = 1e-8  # places
LONGEST = 1.05  # an edge by the longest of gmsh's
WITHOUT_GMSH = """
import sys
sys.modules["gmsh"] = None  # as if it were not there
from nanorom.exact import cases
from nanorom import reduce
for case in (cases.drum(100.0, 3), cases.square(3)):
    frequency, _ = case.errors(reduce(case.scene))
    assert frequency < 1e-8, frequency
"""


def areas(points, cells):
    a, b, c = np.moveaxis(points[cells[:, :3]], 1, 0)
    return 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])


def longest(data):
    x = data.points[data.cells[:, :3]]
    return np.linalg.norm(x - np.roll(x, 1, axis=1), axis=2).max()


def assert_same_places(one, two):
    """Every point of either set is one of the other."""
    for a, b in ((one, two), (two, one)):
        assert cKDTree(a).query(b)[0].max() < SAME


def assert_alike(ours, theirs):
    """As many cells between the same vertices, none turned over, the same named sides."""
    assert_same_places(ours.points, theirs.points)
    assert len(ours.cells) == len(theirs.cells)
    area = areas(ours.points, ours.cells)
    assert (area > 0).all()
    assert area.sum() == pytest.approx(np.abs(areas(theirs.points, theirs.cells)).sum(), rel=1e-9)
    assert longest(ours) < LONGEST * longest(theirs)
    assert ours.facets.keys() == theirs.facets.keys()
    for name, pairs in ours.facets.items():
        assert len(pairs) == len(theirs.facets[name])
        assert_same_places(
            ours.points[pairs].mean(axis=1), theirs.points[theirs.facets[name]].mean(axis=1)
        )


@pytest.mark.parametrize("quadrants", [1, 4])
@pytest.mark.parametrize("seed", range(5))
def test_disc_is_that_of_the_geometry_file(quadrants, seed):
    random = np.random.default_rng(seed)
    count, growth = int(random.integers(1, 8)), float(random.uniform(1, 2.5))
    at_most = int(random.integers(3, 12))
    parameters = {"rings": count, "growth": growth, "sectors": 4 * at_most, "quadrants": quadrants}
    sectors = [min(int(np.ceil(growth * ring)), at_most) for ring in range(1, count + 1)]
    rings = Rings(tuple(np.arange(1, count + 1) / count), tuple(sectors), quadrants)
    assert_alike(rings.mesh(1), GmshFile(MESHES / "drum.geo", parameters).mesh(1))
    assert len(rings.mesh(1).cells) == rings.cells


@pytest.mark.parametrize("axes", [(), ("x",), ("y",), ("x", "y")])
def test_rectangle_is_that_of_the_geometry_file(axes):
    parameters = {"length": 2.0, "width": 1.0, "n_x": 5, "n_y": 4}
    parameters |= {f"half_{axis}": float(axis in axes) for axis in ("x", "y")}
    x = np.linspace(0.0 if "x" in axes else -1.0, 1.0, 6)
    y = np.linspace(0.0 if "y" in axes else -0.5, 0.5, 5)
    grid = Grid(tuple(x), tuple(y), Mirrors(axes))
    ours, theirs = grid.mesh(1), GmshFile(MESHES / "rectangle.geo", parameters).mesh(1)
    assert_alike(ours, theirs)
    assert_same_places(*(data.points[data.cells].mean(axis=1) for data in (ours, theirs)))
    assert len(ours.cells) == grid.cells


@pytest.mark.parametrize("polar", [0.25, 0.5, 0.75])
def test_curved_cells_fill_the_disc(polar):
    """Area by the boundary's nodes: of order 8, between chords they err by 1e-14."""
    data = Rings((0.25, 0.5, 0.75, 1.0), (2, 4, 6, 7), 4, polar).mesh(8)
    element = reference_element(8, equispaced=True)
    points, weights = np.polynomial.legendre.leggauss(12)
    s, t = (np.ravel(x) for x in np.meshgrid((points + 1) / 2, (points + 1) / 2))
    inside = np.column_stack([s, t * (1 - s)])  # the square collapsed onto the triangle
    weight = np.outer(weights, weights).ravel() / 4 * (1 - s)
    slopes = np.asarray(element.tabulate(1, inside)).reshape(3, len(inside), -1)[1:]
    jacobian = np.einsum("kqn,cnd->cqdk", slopes, data.points[data.cells])
    area = (np.linalg.det(jacobian) * weight).sum()
    assert area == pytest.approx(np.pi, rel=AREA)


def test_no_gmsh_is_needed_for_a_named_shape():
    run = subprocess.run([sys.executable, "-c", WITHOUT_GMSH], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
