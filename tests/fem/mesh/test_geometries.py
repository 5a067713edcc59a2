"""Every parametric geometry meshes, with its true area and its named boundary."""

import numpy as np
import pytest
import ufl
from dolfinx import fem
from mpi4py import MPI

import nanorom
from nanorom.errors import MeshError, SceneError
from nanorom.fem.mesh import gmsh, mesh

CURVED = 1e-9  # of areas bounded by circles, on cells of order 8
ORDER = 8

HOLES = 13  # lattice points within 1 - 0.1 - 0.15 of the centre at pitch 0.35
FILLET = 1 - np.pi / 4  # what a fillet adds to a corner, by its radius squared
CHORD, REACH = 0.3, np.sqrt(1 - 0.3**2)  # half a channel, and where it leaves its drum
SEGMENT = np.arcsin(CHORD) - CHORD * REACH
# centres at (i + j/2, j root 3/2)/5 with |x| <= .4, |y| <= .35 but for the middle one: rows of 5, 4
LATTICE = 4 + 2 * 4 + 2 * 5
AREAS = {
    "paddle": ({}, 0.2 + 0.3 * 0.6 + 2 * FILLET * 0.05**2, {"clamp", "free"}),
    "hbeam": ({}, 2 * 0.06 + 0.2 * 0.1 + 4 * FILLET * 0.03**2, {"ends", "free"}),
    "drums": (
        {"count": 3},
        3 * np.pi - 4 * SEGMENT + 2 * 0.6 * (2.3 - 2 * REACH),
        {"edge"},
    ),
    "phononic": ({}, 0.9 - LATTICE * np.pi * 0.05**2, {"edge", "holes"}),
    "ellipse": ({"a": 1.2, "b": 0.7}, np.pi * 1.2 * 0.7, {"edge"}),
    "annulus": ({"inner": 0.3}, np.pi * (1 - 0.09), {"outer", "inner"}),
    "perforated": ({"pitch": 0.35}, np.pi * (1 - HOLES * 0.01), {"edge", "holes"}),
    "cantilever": ({"width": 0.3}, 0.3, {"clamp", "tip", "sides"}),
    # pad and tethers, and what eight fillets add between tether and pad
    "trampoline": (
        {},
        0.3**2 + 4 * 0.35 * 0.08 + 8 * (1 - np.pi / 4) * 0.04**2,
        {"ends", "free"},
    ),
    "cross": (
        {"pad": 0.08},
        0.08**2 + 4 * 0.46 * 0.08 + 4 * (1 - np.pi / 4) * 0.04**2,
        {"ends", "free"},
    ),
}


@pytest.mark.parametrize("name", AREAS)
def test_area_and_boundary_names_are_right(name):
    parameters, area, boundaries = AREAS[name]
    file = gmsh.MESHES / f"{'trampoline' if name == 'cross' else name}.geo"
    domain = mesh.build(MPI.COMM_WORLD, gmsh.GmshFile(file, parameters), ORDER)
    one = fem.Constant(domain.mesh, 1.0)
    measured = fem.assemble_scalar(
        fem.form(one * ufl.dx(domain.mesh, metadata={"quadrature_degree": 2 * ORDER}))
    )
    assert measured == pytest.approx(area, rel=CURVED)
    assert set(domain.facets) == boundaries
    assert all(len(facets) for facets in domain.facets.values())


@pytest.mark.parametrize("name", ["film.msh", "film.geo"])
def test_file_without_a_surface_is_refused_by_name(tmp_path, name):
    file = tmp_path / name
    file.write_text("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n" if name.endswith("msh") else "")
    with pytest.raises(MeshError, match=f"{name}: no surface"):
        mesh.build(MPI.COMM_WORLD, gmsh.GmshFile(file))


def test_parameters_of_a_geometry_file_are_keys_of_the_scene():
    """A membrane's frequency goes with (1/a^2 + 1/b^2)^1/2 of its sides."""

    def scene(**parameters):
        return nanorom.Scene(
            geometry=nanorom.MeshFile(gmsh.MESHES / "rectangle.geo", 1e-5, parameters),
            plate=nanorom.Plate("10 nm", model="membrane"),
            material=nanorom.Material("250 GPa", 0.23, 3100),
            tension=nanorom.Tension(0.5),
            modes=nanorom.Modes(1),
            accuracy=nanorom.Accuracy(tolerance=1e-3),
        )

    with pytest.raises(SceneError, match=r"geometry.parameters.lenght: unknown"):
        scene(lenght=2.0)
    one = scene(length=1.0, width=1.0)
    assert nanorom.Scene.from_toml(one.to_toml()) == one
    f = [nanorom.reduce(each).frequency[0] for each in (one, scene(length=2.0, width=1.0))]
    exact = [np.hypot(1, 1), np.hypot(1, 0.5)]
    assert f[1] / f[0] == pytest.approx(exact[1] / exact[0], rel=2e-3)


def test_last_line_that_gmsh_would_leave_out_is_told(tmp_path):
    file = tmp_path / "film.geo"
    file.write_text((gmsh.MESHES / "drum.geo").read_text().rstrip())
    with pytest.raises(MeshError, match="its last line has no line break"):
        mesh.build(MPI.COMM_WORLD, gmsh.GmshFile(file))
