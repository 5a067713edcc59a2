"""Any number of ranks gives the model that one gives; run with mpirun these tests compare them."""

from functools import cache

import attrs
import numpy as np
import pytest
from mpi4py import MPI
from petsc4py import PETSc

from nanorom.errors import NanoromError
from nanorom.fem.mesh.gmsh import MESHES
from nanorom.fem.reduce import reduce_scene
from nanorom.fem.solvers import algebra, groups, partition
from nanorom.rom.model import ReducedModel
from nanorom.scene.film import Plate
from nanorom.scene.geometry import MeshFile, Rectangle, String
from nanorom.scene.load import Load
from nanorom.scene.material import Material
from nanorom.scene.scene import Accuracy, Modes, Reduction, Scene
from nanorom.scene.support import Support
from tests.fem.exact import RADIUS, drum, paper_drum

SIZE = MPI.COMM_WORLD.size
SAME = 1e-10  # of the largest entry
ROUNDING = 1e-13  # of a product
FEW_CELLS = Accuracy(degree=6, mesh_size=RADIUS / 3)


def shell(**changes):
    """A thick drum of few cells, geometrically exact."""
    few = Accuracy(degree=5, mesh_size=RADIUS / 2)
    plate = Plate(thickness=RADIUS / 50, model="shell")
    return attrs.evolve(drum(100.0, count=3, accuracy=few), plate=plate, **changes)


SCENES = {
    "paper": paper_drum(6),
    "degenerate pairs": drum(100.0, count=6, accuracy=FEW_CELLS),
    "degenerate pairs without mirrors": attrs.evolve(
        drum(100.0, count=5, accuracy=FEW_CELLS),
        geometry=MeshFile(file=MESHES / "drum.geo", scale=RADIUS),
    ),
    "near modes on a second mesh": attrs.evolve(
        drum(100.0, count=3), geometry=String(length=8 * RADIUS, width=RADIUS)
    ),
    "static load cases": drum(
        100.0, count=3, accuracy=FEW_CELLS, reduction=Reduction(method="step")
    ),
    "static load": drum(100.0, count=3, accuracy=FEW_CELLS, load=Load(pressure="2 kPa")),
    "flat shell": shell(),
    "curved shell": shell(load=Load(pressure="100 kPa")),
    "solid": Scene(
        geometry=Rectangle(1e-3, 4e-4),
        plate=Plate(1e-4, model="solid"),
        material=Material(160e9, 0.22, 2320.0),
        support=Support({"left": "clamped", "top": "clamped"}),
        modes=Modes(count=3),
        accuracy=Accuracy(degree=3, mesh_size=2e-4),
    ),
}


@cache
def alone(name):
    """The model that one rank makes, on every rank."""
    world = MPI.COMM_WORLD
    model = reduce_scene(SCENES[name], comm=MPI.COMM_SELF) if world.rank == 0 else None
    return world.bcast(model)


@pytest.mark.parametrize("name", SCENES)
def test_ranks_give_the_same_model(name):
    assert_same(reduce_scene(SCENES[name], groups=1), alone(name))


@pytest.mark.parametrize("groups", [n for n in range(min(SIZE, 2), SIZE + 1) if SIZE % n == 0])
@pytest.mark.parametrize("name", ["paper", "static load cases", "static load", "curved shell"])
def test_groups_of_ranks_give_the_same_model(name, groups):
    assert_same(reduce_scene(SCENES[name], groups=groups), alone(name))


def test_cells_are_dealt_out_by_place_with_those_across_a_facet():
    corners, points = (
        np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2]]),
        np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [2.0, 0.0], [3.0, 1.0]]),
    )
    found = partition.destinations(corners, points, 3)
    assert [(ranks[0], set(ranks[1:])) for ranks in found] == [(0, {1}), (1, {0, 2}), (2, {1})]


def test_groups_get_shares_of_equal_cost():
    cost = {"a": 10.0, "b": 6.0, "c": 6.0, "d": 1.0}
    assert groups.dealt(list("dcba"), 2, cost.__getitem__) == [["a", "d"], ["c", "b"]]


def test_iterations_on_ranks_give_the_same_model():
    """But for how they went, and what is no more than estimated from displacements."""
    reduction = Reduction(solver="multigrid")
    scene = drum(100.0, count=3, accuracy=FEW_CELLS, reduction=reduction)
    single, shared = reduce_scene(scene, comm=MPI.COMM_SELF), reduce_scene(scene, groups=1)
    assert shared.diagnostics["solver_iterations"] > 1
    assert_same(attrs.evolve(shared, diagnostics={}), attrs.evolve(single, diagnostics={}))


def test_matrix_of_which_a_rank_has_no_columns_multiplies():
    own = 0 if MPI.COMM_WORLD.rank == 0 and SIZE > 1 else 2
    shared = 2 * max(SIZE - 1, 1)
    matrix = PETSc.Mat().createAIJ(((3, 3 * SIZE), (own, shared)), nnz=(shared, shared))
    rows = np.arange(*matrix.getOwnershipRange(), dtype=PETSc.IntType)
    values = np.sin(1.0 + 5 * rows[:, None] + np.arange(shared))
    matrix.setValues(rows, np.arange(shared, dtype=PETSc.IntType), values)
    matrix.assemble()
    columns = np.arange(3.0 * own).reshape(-1, 3) + MPI.COMM_WORLD.rank
    whole = np.concatenate(MPI.COMM_WORLD.allgather(columns))
    assert algebra.multiply(matrix, columns) == pytest.approx(values @ whole, rel=ROUNDING)


def test_groups_are_formed_by_default():
    assert reduce_scene(SCENES["paper"]).diagnostics["groups"] == max(
        n for n in range(1, min(SIZE, 4) + 1) if SIZE % n == 0
    )


def test_ranks_are_dealt_out_evenly():
    for count in (0, SIZE + 1):
        with pytest.raises(NanoromError, match="--groups: found"):
            reduce_scene(SCENES["paper"], groups=count)


def assert_same(model, other):
    """All that goes into the file but times and number of ranks."""
    for field in attrs.fields(ReducedModel):
        found, expected = getattr(model, field.name), getattr(other, field.name)
        if field.name == "diagnostics":
            found, expected = untimed(found), untimed(expected)
        if field.name == "outside_cubic" and found is not None:  # what is left of differences,
            found, expected = found + other.cubic, expected + other.cubic  # and adds to the cubic
        assert_close(found, expected, field.name)


def untimed(diagnostics):
    """What a computation tells of itself, estimates of its errors and times apart."""
    free = ("ranks", "groups", "seconds", "error", "asymmetry")
    free += ("plateau", "truncation", "plate_", "tangential")  # small differences, of a shell
    free += ("outside_dynamics",)  # an estimate, from what is left of differences
    return {name: value for name, value in diagnostics.items() if not name.startswith(free)}


def assert_close(found, expected, name):
    if attrs.has(type(found)):
        found, expected = attrs.asdict(found), attrs.asdict(expected)
    if isinstance(found, dict):
        assert found.keys() == expected.keys()
        for key in found:
            assert_close(found[key], expected[key], f"{name} {key}")
    elif np.asarray(found).dtype.kind == "f":
        scale = np.abs(expected).max(initial=0.0)
        np.testing.assert_allclose(found, expected, rtol=0, atol=SAME * scale, err_msg=name)
    else:
        assert np.array_equal(found, expected), name
