"""Films made thick: volumes, faces, curved cells."""

import numpy as np
import pytest
from mpi4py import MPI

from nanorom.errors import MeshError
from nanorom.fem.fields.faces import Faces
from nanorom.fem.fields.volume import Volume
from nanorom.fem.mesh import mesh, tetrahedra, vetting
from nanorom.fem.mesh.gmsh import MESHES
from nanorom.fem.mesh.shapes import Grid, Rings
from nanorom.fem.mesh.volumes import SolidFile, Thick
from nanorom.fem.solvers import compat, partition

ROUNDING = 1e-12
CURVED = 1e-9  # volume of a cylinder by cells of order 4


def volume_of(domain, degree=2):
    space = compat.lagrange_space(domain.mesh, degree, 3)
    return Volume.of(space, degree, 12).whole.weights.sum()


def area_vector(domain, name):
    space = compat.lagrange_space(domain.mesh, 2, 3)
    points = np.array([[1 / 3, 1 / 3]])
    return 0.5 * Faces.of(space, domain.facets[name], points).areas.sum(axis=(0, 1))


@pytest.mark.parametrize("layers", (1, 3))
def test_a_block_has_its_volume_and_its_faces(layers):
    source = Thick(Grid((0.0, 0.2, 1.0), (-0.5, 0.1, 0.5)), 0.25, layers)
    domain = mesh.build(MPI.COMM_SELF, source)
    assert domain.mesh.topology.index_map(3).size_global == source.cells
    assert volume_of(domain) == pytest.approx(0.25, rel=ROUNDING)
    outwards = {
        "left": (-0.25, 0, 0),
        "right": (0.25, 0, 0),
        "bottom": (0, -0.25, 0),
        "top": (0, 0.25, 0),
        "lower": (0, 0, -1),
        "upper": (0, 0, 1),
    }
    for name, expected in outwards.items():
        assert area_vector(domain, name) == pytest.approx(expected, abs=ROUNDING)
    outside = np.unique(np.concatenate(list(domain.facets.values())))
    assert np.array_equal(outside, np.sort(compat.exterior_facets(domain.mesh)))


def test_a_thick_disc_is_a_cylinder():
    source = Thick(Rings((0.5, 1.0), (1, 2), polar=0.5), 0.1, 1)
    straight, curved = (volume_of(mesh.build(MPI.COMM_SELF, source, order)) for order in (1, 4))
    assert curved == pytest.approx(0.1 * np.pi, rel=1e-4)
    assert abs(curved / (0.1 * np.pi) - 1) < 1e-3 * abs(straight / (0.1 * np.pi) - 1)


ARCH = {"rise": 0.1, "thickness": 0.05, "width": 0.2, "size": 0.2}


def test_an_arch_of_a_file_has_its_volume_and_faces(tmp_path):
    radius = (0.25 + 0.01) / 0.2
    volume = 2 * np.arcsin(0.5 / radius) * radius * 0.05 * 0.2
    straight, curved = (
        volume_of(mesh.build(MPI.COMM_SELF, SolidFile(MESHES / "arch.geo", ARCH), order))
        for order in (1, 2)
    )
    assert curved == pytest.approx(volume, rel=1e-5)
    assert abs(straight - volume) > 100 * abs(curved - volume)
    domain = mesh.build(MPI.COMM_SELF, SolidFile(MESHES / "arch.geo", ARCH), 2)
    assert set(domain.facets) == {"ends", "lower", "upper", "sides"}
    outside = np.unique(np.concatenate(list(domain.facets.values())))
    assert np.array_equal(outside, np.sort(compat.exterior_facets(domain.mesh)))


def test_a_mesh_of_volumes_is_read_as_it_stands(tmp_path):
    file = tmp_path / "two.msh"
    with vetting.session("two") as gmsh:
        gmsh.model.occ.addBox(0, 0, 0, 1, 0.5, 0.25)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(3, [1])
        gmsh.model.setPhysicalName(2, gmsh.model.addPhysicalGroup(2, [1]), "held")
        gmsh.option.setNumber("Mesh.CharacteristicLengthMax", 0.5)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(3)
        gmsh.write(str(file))
    domain = mesh.build(MPI.COMM_SELF, SolidFile(file), 1)
    assert volume_of(domain) == pytest.approx(0.125, rel=ROUNDING)
    assert area_vector(domain, "held") == pytest.approx((-0.125, 0, 0), abs=ROUNDING)


def test_flat_files_are_made_thick():
    source = SolidFile(MESHES / "cantilever.geo", {"width": 0.3}, thickness=0.1, layers=2)
    domain = mesh.build(MPI.COMM_SELF, source)
    assert volume_of(domain) == pytest.approx(0.03, rel=1e-9)
    assert set(domain.facets) == {"clamp", "tip", "sides", "lower", "upper"}


def test_volumes_of_other_cells_are_refused(tmp_path):
    file = tmp_path / "bricks.msh"
    with vetting.session("bricks") as gmsh:
        gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
        gmsh.model.occ.extrude([(2, 1)], 0, 0, 1, [2], recombine=True)
        gmsh.model.occ.synchronize()
        gmsh.model.mesh.generate(3)
        gmsh.write(str(file))
    with pytest.raises(MeshError, match="give tetrahedra"):
        mesh.build(MPI.COMM_SELF, SolidFile(file))


def test_rows_of_cells_shrink_to_their_ends():
    row = tetrahedra.row(-1.0, 1.0, 0.3, (0.02, 0.1))
    widths = np.diff(row)
    assert row[[0, -1]].tolist() == [-1.0, 1.0]
    assert widths[0] < 0.04 and widths[-1] < 0.2
    assert widths.max() <= 0.3 * (1 + 1e-9)
    ratio = widths[1:] / widths[:-1]
    assert np.maximum(ratio, 1 / ratio).max() < 3.0


def test_tetrahedra_are_dealt_out_to_ranks_with_their_neighbours():
    data = Thick(Grid((0.0, 1.0, 2.0), (0.0, 1.0)), 1.0, 1).mesh(1)
    first, second = partition.neighbours(data.cells[:, :4])
    shared = [len(set(data.cells[a]) & set(data.cells[b])) for a, b in zip(first, second)]
    assert set(shared) == {3}
    # 12 tetrahedra have 48 faces, 2 of each of the 10 outer squares are outside
    assert len(first) == (4 * len(data.cells) - 20) // 2
