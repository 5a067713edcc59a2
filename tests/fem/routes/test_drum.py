"""The drum against exact frequencies and tensors."""

import attrs
import numpy as np
import pytest
from mpi4py import MPI

from nanorom.errors import SolverError
from nanorom.fem.mesh import discretisation
from nanorom.fem.models.build import build_plate
from nanorom.fem.modes import eigen, names
from nanorom.fem.modes.eigen import check_uncoupled
from nanorom.fem.modes.normal import normalise
from nanorom.fem.reduce import reduce_scene
from nanorom.fem.scales import Scales
from nanorom.fem.tensors.cases import load_cases
from nanorom.fem.tensors.flat_cases import FlatCases
from nanorom.fem.tensors.loaded_cases import StaticCases
from nanorom.scene.film import Plate, Tension
from nanorom.scene.scene import Accuracy, Reduction
from tests.fem.exact import (
    DENSITY,
    MODULUS,
    RADIUS,
    THICKNESS,
    clamped_disc,
    drum,
    drum_tensor,
    membrane_disc,
    paper_drum,
)

UNIT = MODULUS * THICKNESS / RADIUS**2  # E h/R^2, in which tensors are told
FREQUENCY_TOLERANCE = 1e-7
TENSOR_TOLERANCE = 1e-6  # of the largest entry
ROUTE_TOLERANCE = 1e-9
POTENTIAL_TOLERANCE = 1e-9

# PHYSICS of the paper's device: spectral solution with T_x = 0.321, T_y = 0.257 N/m, in MHz
PAPER = {
    "f01": 21.15119357,
    "f11s": 35.43957465,
    "f11c": 36.72212759,
    "f21c": 51.91279396,
    "f21s": 52.14308452,
    "f02": 57.68114750,
}
PAPER_F03 = 110.27634740

# Membrane drum, nu = 0.16, exact to the digits shown: sums over the membrane's Bessel functions
# (25-digit quadrature), in E h/R^2, b^(r)_jkl of the paper with both modes positive at the centre
TABLE_1 = {
    (1, 1, 1, 1): 2.839702975852,
    (1, 2, 2, 2): 3.297553006293,
    (1, 1, 1, 2): 1.707143506533,
    (1, 1, 2, 2): 9.300841164477,
    (2, 1, 1, 1): 0.569047835511,
    (2, 2, 2, 2): 22.944139015372,
    (2, 1, 1, 2): 9.300841164477,
    (2, 1, 2, 2): 9.892659018879,
}


@pytest.mark.parametrize("kappa", [0.0, 10.0, 1e3, 1e5])
def test_frequencies_of_a_clamped_drum_are_exact(kappa):
    model = reduce_scene(drum(kappa, count=6))
    rigidity = MODULUS * THICKNESS**3 / (12 * (1 - 0.16**2))
    scale = np.sqrt(DENSITY * THICKNESS / rigidity) * RADIUS**2
    found = 2 * np.pi * model.frequency * scale
    assert found == pytest.approx(clamped_disc(kappa, 6), rel=FREQUENCY_TOLERANCE)


def test_frequencies_of_the_papers_drum():
    model = reduce_scene(paper_drum(15))
    found = dict(zip(model.label, model.frequency / 1e6))
    for label, frequency in PAPER.items():
        assert found[label] == pytest.approx(frequency, rel=1e-9)
    assert model.label[14] == "f03"
    assert found["f03"] == pytest.approx(PAPER_F03, rel=FREQUENCY_TOLERANCE)


def test_cubic_tensor_of_a_clamped_drum_is_exact():
    exact = drum_tensor()
    model = reduce_scene(drum(100.0))
    error = np.abs(model.cubic / UNIT - exact[:11, :11, :11, :11])
    assert error.max() < TENSOR_TOLERANCE * np.abs(exact).max()
    assert not model.quadratic.any()


def test_table_1_of_the_paper():
    scene = drum(100.0, count=6, model="membrane", accuracy=Accuracy(tolerance=1e-7))
    model = reduce_scene(scene)
    zeros = membrane_disc(6)
    tension = scene.tension.x
    found = 2 * np.pi * model.frequency * RADIUS * np.sqrt(DENSITY * THICKNESS / tension)
    assert found == pytest.approx(zeros, rel=FREQUENCY_TOLERANCE)
    mode = {1: model.label.index("f01"), 2: model.label.index("f02")}
    for (r, j, k, l), exact in TABLE_1.items():
        multiplicity = 1 if j == k == l else 3
        value = multiplicity * model.cubic[mode[r], mode[j], mode[k], mode[l]] / UNIT
        assert value == pytest.approx(exact, rel=TENSOR_TOLERANCE), (r, j, k, l)


def test_static_load_cases_give_the_direct_tensor():
    scene = attrs.evolve(paper_drum(5), accuracy=Accuracy(degree=4, mesh_size=RADIUS / 3))
    direct = reduce_scene(scene)
    step = reduce_scene(attrs.evolve(scene, reduction=Reduction(method="step")))
    largest = np.abs(direct.cubic).max()
    assert np.abs(step.cubic - direct.cubic).max() < ROUTE_TOLERANCE * largest
    # of images one: only f01 and f21c are of one parity and need both signs
    assert step.diagnostics["load_cases"] == 5 + 10 + 1 + 10
    assert step.diagnostics["asymmetry"] < POTENTIAL_TOLERANCE
    quadratic_force = np.abs(step.quadratic).max() * THICKNESS**2
    assert quadratic_force < POTENTIAL_TOLERANCE * largest * THICKNESS**3


def test_block_solution_gives_the_reactions_of_snes_on_the_whole_film():
    """All 35 load cases of four modes: energy forms on the unfolded mesh against class kernels."""
    scene = attrs.evolve(paper_drum(4), accuracy=Accuracy(degree=4, mesh_size=RADIUS / 2))
    forces = {}
    for whole in (True, False):
        modes = solved_modes(scene, whole)
        cases = StaticCases(modes) if whole else FlatCases(modes)
        q = np.zeros((len(modes.parities), 0))
        for case in load_cases(4):
            column = np.zeros((len(modes.parities), 1))
            for mode, sign in case:
                column[mode] = 0.3 * sign
            q = np.hstack([q, column])
        forces[whole] = cases.nonlinear_force(q)[:4]
    assert forces[True].shape[1] == 2 * 4 + 3 * 6 + 4
    error = np.abs(forces[True] - forces[False]).max()
    assert error < ROUTE_TOLERANCE * np.abs(forces[True]).max()


def solved_modes(scene, whole):
    """Normalised modes of a scene, on the whole film or on the part that mirrors leave."""
    scales = Scales.of(scene)
    chosen = attrs.evolve(discretisation.choose(scene, scales.length, 0.0, None), whole=whole)
    plate = build_plate(MPI.COMM_WORLD, scene, scales, chosen)
    return normalise(names.name(scene, eigen.solve(plate, 4))[0])


def test_step_has_352_load_cases_for_eleven_modes():
    assert len(list(load_cases(11))) == 352


@pytest.mark.parametrize("amplitude", [1e-3, 1e-1, 1.0])
def test_step_does_not_depend_on_its_amplitude(amplitude):
    scene = attrs.evolve(paper_drum(2), accuracy=Accuracy(degree=4, mesh_size=RADIUS / 3))
    direct = reduce_scene(scene)
    reduction = Reduction(method="step", amplitude=amplitude * THICKNESS)
    step = reduce_scene(attrs.evolve(scene, reduction=reduction))
    spread = np.abs(step.cubic - direct.cubic).max() / np.abs(direct.cubic).max()
    assert spread < 1e-8


@pytest.mark.parametrize("method", ["direct", "step"])
def test_free_in_plane_displacement_softens(method):
    scene = attrs.evolve(paper_drum(1), accuracy=Accuracy(degree=4, mesh_size=RADIUS / 3))
    stiffness = {}
    for in_plane in ("free", "fixed"):
        reduction = Reduction(method=method, in_plane=in_plane)
        model = reduce_scene(attrs.evolve(scene, reduction=reduction))
        stiffness[in_plane] = model.cubic[0, 0, 0, 0]
    assert 0.4 * stiffness["fixed"] < stiffness["free"] < 0.9 * stiffness["fixed"]


def test_tensors_do_not_depend_on_the_mesh():
    """Orientation, sign and scale of every mode are the same on two coarse meshes."""
    scene = drum(100.0)
    models = [
        reduce_scene(attrs.evolve(scene, accuracy=Accuracy(degree=6, mesh_size=size * RADIUS)))
        for size in (0.4, 0.3)
    ]
    difference = np.abs(models[0].cubic - models[1].cubic).max()
    assert difference < 1e-3 * np.abs(models[1].cubic).max()


def test_compression_beyond_buckling_is_an_error():
    rigidity = MODULUS * THICKNESS**3 / (12 * (1 - 0.16**2))
    critical = 14.681970642 * rigidity / RADIUS**2  # j_11^2: buckling of a clamped disc
    for factor, stable in ((0.99, True), (1.01, False)):
        tension = Tension(x=-factor * critical, y=-factor * critical)
        scene = attrs.evolve(drum(1.0, 1), tension=tension)
        if stable:
            assert reduce_scene(scene).frequency[0] > 0
        else:
            with pytest.raises(SolverError, match="not stable"):
                reduce_scene(scene)


def test_more_modes_than_the_mesh_can_give_is_an_error():
    scene = attrs.evolve(paper_drum(60), accuracy=Accuracy(degree=2, mesh_size=RADIUS / 2))
    with pytest.raises(SolverError, match="60 modes asked for"):
        reduce_scene(scene)


def test_modes_of_unequal_frequency_are_no_pair_though_both_are_nearest_to_one_harmonic():
    """Tensions 20 : 1; modes 11 and 14 both look like f31c.

    Provenance: Ritz' method with (1 - r^2) r^p P_k^(2, p)(1 - 2 r^2) cos, sin p theta; total
    degrees 34 and 44 agree to 5e-13.
    """
    scene = attrs.evolve(
        paper_drum(15),
        plate=Plate("10 nm", "membrane"),
        tension=Tension(0.3, 0.015),
    )
    model = reduce_scene(scene)
    assert model.frequency[[10, 13]] == pytest.approx([27.341695e6, 31.020128e6], rel=2e-8)
    size = np.sqrt(np.diag(model.stiffness))
    coupling = model.stiffness / np.outer(size, size) - np.eye(15)
    assert np.abs(coupling).max() < 1e-10


def test_coupled_modes_are_an_error():
    stiffness = np.array([[1.0, 0.1], [0.1, 4.0]])
    check_uncoupled(np.diag(np.diag(stiffness)), ["f01", "f02"])
    with pytest.raises(SolverError, match=r"modes 1 \(f01\) and 2 \(f02\) are coupled by 5.0e-02"):
        check_uncoupled(stiffness, ["f01", "f02"])
