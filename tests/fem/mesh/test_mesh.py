"""Meshes: true curves of any order, tagged boundaries, and meshes that must be refused."""

from pathlib import Path

import numpy as np
import pytest
import ufl
from dolfinx import fem
from mpi4py import MPI

from nanorom.errors import MeshError
from nanorom.fem.mesh import mesh
from nanorom.fem.mesh.gmsh import GmshFile
from nanorom.fem.solvers import compat
from nanorom.fem.symmetry import Mirrors

MESHES = Path(__file__).parents[3] / "meshes"
HALF_SQUARE = """$MeshFormat
2.2 0 8
$EndMeshFormat
$Nodes
{n_nodes}
{nodes}
$EndNodes
$Elements
{n_elements}
{elements}
$EndElements
"""


def area(domain: mesh.Domain, degree: int) -> float:
    measure = ufl.dx(domain.mesh, metadata={"quadrature_degree": degree})
    return fem.assemble_scalar(compat.form(fem.Constant(domain.mesh, 1.0) * measure))


def written(folder: Path, nodes: list[tuple], triangles: list[tuple]) -> Path:
    file = folder / "film.msh"
    lines = [f"{i + 1} {x} {y} {z}" for i, (x, y, z) in enumerate(nodes)]
    cells = [f"{i + 1} 2 2 1 1 {a} {b} {c}" for i, (a, b, c) in enumerate(triangles)]
    file.write_text(
        HALF_SQUARE.format(
            n_nodes=len(nodes),
            nodes="\n".join(lines),
            n_elements=len(cells),
            elements="\n".join(cells),
        )
    )
    return file


@pytest.mark.parametrize(("order", "limit"), [(1, 5e-2), (2, 1e-4), (4, 2e-6), (8, 1e-13)])
def test_area_of_a_disc_converges_with_the_order_of_its_cells(order, limit):
    domain = mesh.build(MPI.COMM_SELF, GmshFile(MESHES / "drum.geo", {"rings": 2}), order)
    assert abs(area(domain, 2 * order) / np.pi - 1) < limit


def test_quarter_unfolds_to_the_whole_with_all_its_sides():
    parameters = {"length": 2.0, "width": 1.0, "half_x": 1, "half_y": 1, "n_x": 3, "n_y": 2}
    file, both = GmshFile(MESHES / "rectangle.geo", parameters), Mirrors(("x", "y"))
    quarter = mesh.build(MPI.COMM_SELF, file)
    assert area(quarter, 2) == pytest.approx(0.5, rel=1e-14)
    whole = mesh.build(MPI.COMM_SELF, file, unfold=both)
    assert area(whole, 2) == pytest.approx(2.0, rel=1e-14)
    assert {name: len(f) for name, f in whole.facets.items()} == {
        "left": 4,
        "right": 4,
        "bottom": 6,
        "top": 6,
    }


@pytest.mark.parametrize(
    ("nodes", "triangles", "cause"),
    [
        ([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)], [(1, 2, 3), (2, 3, 4)], "inverted"),
        ([(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0)], [(1, 2, 3), (1, 2, 4)], "no area"),
        (
            [(0, 0, 0), (1, 0, 0), (0, 1, 0), (5, 5, 0), (6, 5, 0), (5, 6, 0)],
            [(1, 2, 3), (4, 5, 6)],
            "2 separate parts",
        ),
        ([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 1)], [(1, 2, 3), (2, 4, 3)], "not flat"),
    ],
)
def test_meshes_that_cannot_be_films_are_refused(tmp_path, nodes, triangles, cause):
    with pytest.raises(MeshError, match=cause):
        mesh.build(MPI.COMM_SELF, GmshFile(written(tmp_path, nodes, triangles)))


def test_text_that_is_no_mesh_is_refused(tmp_path):
    file = tmp_path / "film.msh"
    file.write_text("not a mesh\n")
    with pytest.raises(MeshError, match="film.msh"):
        mesh.build(MPI.COMM_SELF, GmshFile(file))


def test_cells_that_fold_over_are_refused(tmp_path):
    """An arc on one edge sinks below the opposite corner of the only triangle."""
    file = tmp_path / "folded.geo"
    file.write_text(
        "Point(1) = {-1, 0, 0, 9}; Point(2) = {1, 0, 0, 9}; Point(3) = {0, -0.3, 0, 9};\n"
        "Point(4) = {0, 1.2, 0, 9}; Mesh.Algorithm = 3;\n"
        "Circle(1) = {1, 4, 2}; Transfinite Curve {1} = 2; Line(2) = {2, 3}; Line(3) = {3, 1};\n"
        "Curve Loop(1) = {1, 2, 3}; Plane Surface(1) = {1};\n"
        'Physical Surface("film") = {1}; Physical Curve("edge") = {1, 2, 3};\n'
    )
    assert area(mesh.build(MPI.COMM_SELF, GmshFile(file)), 2) == pytest.approx(0.3)
    with pytest.raises(MeshError, match="1 of 1 curved cells fold over"):
        mesh.build(MPI.COMM_SELF, GmshFile(file), order=4)
