"""Manifolds of all degrees of freedom: those of all modes where a modal system is turned."""

import attrs
import numpy as np
import pytest
import scipy.sparse as sp

import nanorom
from nanorom.continuation import ModalSystem
from nanorom.errors import ModelError
from nanorom.rom.manifold.direct import fields
from nanorom.rom.manifold.projection import near, project
from tests.rom.manifold.systems import random_system

ROUND_OFF = 1e-8  # relative
SEEDS = (0, 1, 2)
NEARLY = 3e-8  # relative
MODES = 9  # more than a manifold of order 3 has fields


@attrs.frozen(eq=False)
class Turned:
    """A modal system of unit mass in coordinates without meaning, as `FullSystem`."""

    shapes: np.ndarray  # of the modes
    mass: sp.csr_matrix
    stiffness: sp.csr_matrix
    a: np.ndarray
    b: np.ndarray

    @classmethod
    def of(cls, system, seed):
        turn = np.random.default_rng(seed).standard_normal(system.stiffness.shape)
        turn += 4 * np.eye(len(turn))
        a = np.einsum("rjk,ra,jb,kc->abc", system.quadratic, *[turn] * 3, optimize=True)
        b = np.einsum("rjkl,ra,jb,kc,ld->abcd", system.cubic, *[turn] * 4, optimize=True)
        both = (sp.csr_matrix(turn.T @ m @ turn) for m in (system.mass, system.stiffness))
        return cls(np.linalg.inv(turn), *both, a, b)

    @property
    def size(self):
        return len(self.a)

    def quadratic(self, u, v):
        return np.einsum("abc,bp,cp->ap", self.a, u, v)

    def cubic(self, u, v, w):
        return np.einsum("abcd,bp,cp,dp->ap", self.b, u, v, w, optimize=True)

    def pair_products(self, vectors, pairs):
        first, second = (vectors[:, each] for each in pairs.T)
        pulled = np.einsum("abcd,ap,bp->cdp", self.b, first, second, optimize=True)
        return 2 * np.einsum("cdp,cq,dq->pq", pulled, first, second, optimize=True)


def reduced(found, masters, order, quality=1e9):
    system = ModalSystem(
        damping=np.diag(np.sqrt(found.squares) / quality),
        stiffness=np.diag(found.squares),
        quadratic=found.quadratic,
        cubic=found.cubic,
    )
    return nanorom.manifold(system, list(range(1, masters + 1)), order)


@pytest.mark.parametrize("masters", [1, 2])
@pytest.mark.parametrize("seed", SEEDS)
def test_the_manifold_on_its_fields_is_that_of_all_modes(seed, masters):
    system, order = random_system(seed, MODES, quadratic=0.5), 3
    whole = Turned.of(system, seed)
    shapes, squares = whole.shapes[:, :masters], np.diag(system.stiffness)[:masters]
    found = fields(whole, shapes, squares, order)
    projected = project(whole, shapes, squares, found)
    if masters == 1:
        assert len(projected.squares) == 5 < MODES  # its fields are four
    known = nanorom.manifold(system, list(range(1, masters + 1)), order)
    # the dynamics that all degrees of freedom have, in the units of those of the modes
    powers = known.conservative.monomials.powers.sum(axis=1)[:, None]
    unit = known.equations.amplitude ** (powers - 1) / known.equations.frequency
    own = known.conservative.dynamics
    assert np.abs(found.dynamics * unit - own.imag).max() < ROUND_OFF * np.abs(own).max()
    small = reduced(projected, masters, order)
    x = np.array([0.02, 0.05])
    assert small.backbone(x)[0] == pytest.approx(known.backbone(x)[0], rel=ROUND_OFF)


def test_fields_of_any_style_lie_in_the_same_space():
    system, order = random_system(5, MODES, quadratic=0.5), 3
    whole = Turned.of(system, 5)
    shapes, squares = whole.shapes[:, :1], np.diag(system.stiffness)[:1]
    projected = project(whole, shapes, squares, fields(whole, shapes, squares, order))
    undamped = attrs.evolve(system, damping=1e-12 * np.eye(MODES))
    shape = nanorom.manifold(undamped, [1], order, "graph").expansion.shape
    modal = nanorom.manifold(undamped, [1], order, "graph").equations.basis.shapes @ shape.T
    u = whole.shapes @ modal.real  # of all degrees of freedom
    momenta = whole.mass @ projected.vectors
    assert np.abs(u - projected.vectors @ (momenta.T @ u)).max() < ROUND_OFF * np.abs(u).max()


def test_modes_are_refined_together():
    system = random_system(2, MODES)
    whole = Turned.of(system, 2)
    start = whole.shapes[:, :2] + 0.01 * whole.shapes[:, 4:6]
    squares = np.diag(system.stiffness)[:2]
    shapes, values = near(whole, start, 1.01 * squares)
    assert values == pytest.approx(squares, rel=ROUND_OFF)
    assert shapes == pytest.approx(whole.shapes[:, :2], abs=1e-6)


def test_a_slave_in_resonance_is_told():
    system = random_system(1, 4)
    stiffness = np.diag(system.stiffness).copy()
    stiffness[2] = 4 * stiffness[0]
    whole = Turned.of(attrs.evolve(system, stiffness=np.diag(stiffness)), 1)
    with pytest.raises(ModelError, match="masters: another mode is in resonance"):
        fields(whole, whole.shapes[:, :1], stiffness[:1], 3)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_slave_in_resonance_that_nothing_drives_stays_at_rest(seed):
    system, order = random_system(seed, 5, quadratic=0.5), 5
    stiffness = np.diag(system.stiffness).copy()
    stiffness[2] = 9 * stiffness[0]
    quadratic, cubic = np.array(system.quadratic), np.array(system.cubic)
    for tensor in (quadratic, cubic):
        for axis in range(tensor.ndim):
            np.moveaxis(tensor, axis, 0)[2] = 0.0
    system = attrs.evolve(system, stiffness=np.diag(stiffness), quadratic=quadratic, cubic=cubic)
    whole = Turned.of(system, seed)
    found = fields(whole, whole.shapes[:, :1], stiffness[:1], order)
    small = reduced(project(whole, whole.shapes[:, :1], stiffness[:1], found), 1, order)
    others = np.array([0, 1, 3, 4])
    left = attrs.evolve(
        system,
        mass=np.eye(4),
        **{
            name: getattr(system, name)[np.ix_(*(others,) * getattr(system, name).ndim)]
            for name in ("damping", "stiffness", "quadratic", "cubic", "cubic_damping", "direct")
        },
        parametric=system.parametric[np.ix_(others, others)],
    )
    x = np.array([0.02, 0.05])
    known = nanorom.manifold(left, [1], order).backbone(x)[0]
    assert small.backbone(x)[0] == pytest.approx(known, rel=ROUND_OFF)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_slave_that_nearly_resonates_hides_no_other_field(seed):
    system, order = random_system(seed, MODES, quadratic=0.5), 5
    stiffness = np.diag(system.stiffness).copy()
    stiffness[2] = 25 * (1 + NEARLY) * stiffness[0]
    system = attrs.evolve(system, stiffness=np.diag(stiffness))
    whole = Turned.of(system, seed)
    shapes, squares = whole.shapes[:, :1], stiffness[:1]
    small = reduced(project(whole, shapes, squares, fields(whole, shapes, squares, order)), 1, 3)
    x = np.array([0.01, 0.02])
    known = nanorom.manifold(system, [1], 3).backbone(x)[0]
    assert small.backbone(x)[0] == pytest.approx(known, rel=ROUND_OFF)
