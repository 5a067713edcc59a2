"""Numbers, names and directions of modes do not depend on the mesh, and no two share a name."""

import attrs
import numpy as np
import pytest

from nanorom.exact import cases
from nanorom.fem.mesh.gmsh import MESHES
from nanorom.fem.reduce import reduce_scene
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import MeshFile
from nanorom.scene.material import Material
from nanorom.scene.scene import Accuracy, Modes, Scene
from nanorom.scene.support import Support
from tests.fem.routes.test_sides import film

SAFE = 3.0  # times the estimates of both meshes: what their tensors may differ by
THIN = attrs.evolve(cases.GRAPHENE, thickness=1e-9)


def difference(one, other):
    """Of tensors, by the sum of their estimates."""
    change = np.abs(one.cubic - other.cubic).max() / np.abs(other.cubic).max()
    return change / (one.diagnostics["error_tensor"] + other.diagnostics["error_tensor"])


def test_pairs_that_a_small_difference_of_tension_splits_keep_their_numbers():
    """Of sixty modes at T R^2/D = 100 and 97 nine pairs are closer than a mesh tells apart."""
    known = cases.unequal_drum(100.0, 97.0, 60, THIN).scene
    scene = attrs.evolve(known, modes=Modes(select=list(range(30, 61, 3))))
    rough, fine = (reduce_scene(scene.with_(tolerance=t)) for t in (1e-3, 1e-6))
    assert rough.label == fine.label
    # f01 is f01, however many modes there are beside it; f10,1 is not f101
    assert all(("," in name) == (sum(map(str.isdigit, name)) > 2) for name in fine.label)
    assert difference(rough, fine) < SAFE
    apart = np.diff(fine.frequency) / fine.frequency[1:]
    assert apart.min() > -1e-5  # ranked by name where they are closer


@pytest.mark.parametrize("sides", ["cfff", "ccff", "sfcf"])
def test_no_two_modes_have_one_name(sides):
    scene = film(sides, 0.3, tolerance=1e-3, count=8)
    model = reduce_scene(scene.with_(in_plane="fixed"))  # names do not ask for its plane
    assert len(set(model.label)) == 8


def test_bending_modes_of_a_cantilever_count_its_quarter_waves():
    model = reduce_scene(film("cfff", 0.2, tolerance=1e-3, count=4).with_(in_plane="fixed"))
    assert model.label == ("(1,0)", "(2,0)", "(1,1)", "(3,0)")


def trampoline(degree):
    """Silicon nitride; its fourfold symmetry makes modes 2 and 3 a pair, which its mesh splits."""
    return Scene(
        geometry=MeshFile(MESHES / "trampoline.geo", scale=100e-6),
        plate=Plate(thickness=100e-9),
        material=Material(youngs_modulus=250e9, poisson_ratio=0.23, density=3100.0),
        tension=Tension.isotropic(10.0),
        support=Support({"ends": "clamped", "free": "free"}),
        modes=Modes(count=3),
        accuracy=Accuracy(degree=degree, mesh_size="6 um"),
    )


def test_a_pair_of_a_film_with_fourfold_symmetry_has_directions_of_its_own():
    rough, fine = (reduce_scene(trampoline(degree)) for degree in (4, 5))
    assert rough.frequency[1] == rough.frequency[2]
    assert rough.diagnostics["dofs"] < fine.diagnostics["dofs"]
    assert difference(rough, fine) < SAFE
    along = [float(fine.cubic[i, i, i, i]) for i in (1, 2)]
    assert along[0] == pytest.approx(along[1], rel=1e-4)  # turned by 90 degrees
