"""Solids: exact polynomials, rigid motions, bars, and what Timoshenko's beam has."""

import numpy as np
import pytest
from mpi4py import MPI

from nanorom.fem.mesh import mesh
from nanorom.fem.mesh.shapes import Grid
from nanorom.fem.mesh.volumes import Thick
from nanorom.fem.models.solid import Solid
from nanorom.fem.models.solid_system import SolidSystem
from nanorom.fem.modes import solid as solids
from nanorom.fem.solvers import compat

ROUNDING = 1e-12  # of the largest entry
BAR = 1e-6  # axial frequencies of a bar by degree 4


def block(x=3, y=1, z=1, sides=(1.0, 0.3, 0.2), held=("left",), degree=3, nu=0.3, **given):
    """A block of some cells along each side."""
    lines = [tuple(np.linspace(-s / 2, s / 2, n + 1)) for s, n in zip(sides, (x, y))]
    domain = mesh.build(MPI.COMM_SELF, Thick(Grid(*lines), sides[2], z), 1)
    return Solid.on(domain, degree, nu, held, **given)


def random_columns(solid, seed, count=1, size=1e-2):
    return size * np.random.default_rng(seed).normal(size=(solid.free.size, count))


def test_the_force_is_a_cubic_polynomial_of_symmetric_parts():
    solid = block(stress=(0.1, -0.05, 0.0))
    a, b, c, d = (random_columns(solid, seed) for seed in range(4))
    parts = solid.linear(a) + solid.quadratic(a, a) + solid.cubic(a, a, a)
    assert np.abs(solid.force(a) - parts).max() < ROUNDING * np.abs(parts).max()
    pairs = [w.T @ solid.quadratic(u, v) for u, v, w in ((a, b, c), (c, b, a), (a, c, b))]
    assert np.ptp(pairs) < ROUNDING * np.abs(pairs).max()
    four = ((a, b, c, d), (d, b, c, a), (b, d, a, c))
    triples = [w.T @ solid.cubic(u, v, t) for u, v, t, w in four]
    assert np.ptp(triples) < ROUNDING * np.abs(triples).max()


def test_forces_of_complex_columns_are_multilinear():
    solid = block(degree=2)
    system = SolidSystem.of(solid)
    a, b = (random_columns(solid, seed, 2) for seed in (1, 2))
    mixed = a + 1j * b
    found = system.quadratic(mixed, mixed)
    expected = solid.quadratic(a, a) - solid.quadratic(b, b) + 2j * solid.quadratic(a, b)
    assert np.abs(found - expected).max() < ROUNDING * np.abs(expected).max()
    pulled = system.stiffness @ a
    assert np.abs(pulled - solid.linear(a)).max() < ROUNDING * np.abs(pulled).max()


def test_rigid_motions_of_any_size_take_no_force():
    solid = block(held=())
    points = solid.space.tabulate_dof_coordinates()
    turn, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    turn *= np.linalg.det(turn)  # no mirror
    moved = points @ turn.T + [0.3, -1.0, 2.0] - points
    force = solid.force(moved.reshape(-1, 1))
    stretched = solid.force((0.1 * points).reshape(-1, 1))
    assert np.abs(force).max() < ROUNDING * np.abs(stretched).max()


def test_a_bar_without_poissons_ratio_has_its_axial_frequencies():
    solid = block(x=4, sides=(1.0, 0.4, 0.3), degree=4, nu=0.0)
    modes = solids.solve(solid, 12)
    axial = np.sqrt(modes.eigenvalues[modes.axes == 0])
    exact = (np.arange(1, 3) - 0.5) * np.pi
    for frequency in exact:  # of modes that move along x, among those that only mostly do
        assert np.abs(axial / frequency - 1).min() < BAR


@pytest.mark.parametrize("seed", range(3))
def test_a_twisted_pair_of_a_square_rod_is_turned_to_the_axes(seed):
    ratio = np.random.default_rng(seed).uniform(0.05, 0.15)
    modes = solids.solve(block(x=4, sides=(1.0, ratio, ratio), degree=4), 2).take(np.arange(2))
    assert sorted(modes.names) == ["y1", "z1"]
    own = modes.solid.free.local % 3
    for i, axis in enumerate(modes.axes):
        other = 3 - axis  # y and z are 1 and 2
        assert np.abs(modes.shapes[own == other, i]).max() < 0.05


def test_peaks_are_those_of_the_polynomials_between_the_nodes():
    modes = solids.solve(block(x=2, held=("left", "right"), degree=4), 1).take(np.arange(1))
    fine = solids._lattice(60)
    solid = modes.solid
    whole = solid.free.extended(modes.shapes).reshape(-1, 3)
    basis = np.asarray(compat.reference_element(4, dimension=3).tabulate(0, fine))
    local = whole[compat.cell_dofs(solid.space)][..., modes.axes[0]]
    values = basis.reshape(len(fine), -1) @ local.T
    assert values.max() == pytest.approx(1.0, abs=1e-4)
    assert values.max() < 1 + 1e-9
