"""Solids of St. Venant-Kirchhoff's material: forces exactly cubic in the displacement.

    E = eps(u) + 1/2 S(u, u),  eps(u) = sym grad u,  S(u, v) = sym(grad u^T grad v),
    Pi = int 1/2 E:C:E + N0:E,

with a uniform stress N0 that the undeformed solid bears.  The force is the sum of the multilinear

    K(u; w)       = int C eps(u):eps(w) + N0:S(u, w),
    Q(u, v; w)    = 1/2 int C S(u, v):eps(w) + C eps(u):S(v, w) + C eps(v):S(u, w),
    T(u, v, t; w) = 1/6 int C S(u, v):S(t, w) + C S(v, t):S(u, w) + C S(u, t):S(v, w),

at equal arguments; all are symmetric, as they derive from one energy.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import attrs
import numpy as np
import ufl
from dolfinx import fem
from petsc4py import PETSc

from nanorom.fem.fields.volume import Volume
from nanorom.fem.mesh.mesh import Domain
from nanorom.fem.solvers import algebra, compat

LOWEST_DEGREE, HIGHEST_DEGREE = 2, 4

Stress = Callable[[list[np.ndarray]], np.ndarray]  # gradients (c, q, 3, 3, m) of arguments -> P


@attrs.frozen(eq=False, slots=False)
class Solid:
    """A solid on a mesh of tetrahedra, by its modulus, density and length. Never changed.

    poisson_ratio; stress: (x, y, z) by the modulus, uniform, that it bears undeformed; space: of
    its displacements; free: what its supports leave free; all vectors are columns on the owned free
    degrees of freedom (n, m), real or complex.
    """

    domain: Domain
    degree: int
    poisson_ratio: float
    stress: tuple[float, float, float]
    space: Any
    free: algebra.FreeDofs

    @classmethod
    def on(
        cls,
        domain: Domain,
        degree: int,
        poisson_ratio: float,
        held: Sequence[str],
        stress: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> Solid:
        """The solid on a domain, held at the faces of some names. Collective."""
        space = compat.lagrange_space(domain.mesh, degree, 3)
        facets = domain.facets_of(list(held))
        nodes = fem.locate_dofs_topological(space, 2, facets)
        fixed = (3 * nodes[:, None] + np.arange(3)).ravel()
        return cls(domain, degree, poisson_ratio, stress, space, algebra.FreeDofs(space, fixed))

    # -- matrices -------------------------------------------------------------------------------

    @cached_property
    def stiffness(self) -> PETSc.Mat:
        """Of the free degrees of freedom. Collective."""
        u, w = ufl.TrialFunction(self.space), ufl.TestFunction(self.space)
        stress = ufl.diag(fem.Constant(self.domain.mesh, np.array(self.stress)))
        lame = fem.Constant(self.domain.mesh, np.array(lame_of(self.poisson_ratio)))
        strain = ufl.sym(ufl.grad(u))
        pull = lame[0] * ufl.tr(strain) * ufl.Identity(3) + 2 * lame[1] * strain
        form = ufl.inner(pull + ufl.grad(u) * stress, ufl.grad(w)) * self._dx(2 * self.degree - 2)
        return self._assembled(form)

    @cached_property
    def mass(self) -> PETSc.Mat:
        """The same. Collective."""
        u, w = ufl.TrialFunction(self.space), ufl.TestFunction(self.space)
        return self._assembled(ufl.inner(u, w) * self._dx(2 * self.degree))

    def stretched(self, along: Sequence[int]) -> PETSc.Mat:
        """int sum_d du/dx_d . dw/dx_d over some directions, as `stiffness`. Collective."""
        u, w = ufl.TrialFunction(self.space), ufl.TestFunction(self.space)
        form = sum(ufl.inner(u.dx(axis), w.dx(axis)) for axis in along)
        return self._assembled(form * self._dx(2 * self.degree - 2))

    def weights(self, axis: int) -> np.ndarray:
        """int w along an axis, of the owned free degrees of freedom (n,). Collective."""
        test = ufl.TestFunction(self.space)[axis]
        return algebra.assemble_vector(compat.form(test * self._dx(self.degree)))[self.free.local]

    def pull(self, stress: Sequence[float]) -> np.ndarray:
        """int N:grad w (n,) of a uniform stress along x, y and z. Collective."""
        test = ufl.TestFunction(self.space)
        along = fem.Constant(self.domain.mesh, np.array(stress))
        form = ufl.inner(ufl.diag(along), ufl.grad(test)) * self._dx(self.degree)
        return algebra.assemble_vector(compat.form(form))[self.free.local]

    def _dx(self, degree: int) -> Any:
        curved = 0 if self._straight else 2
        return ufl.dx(self.domain.mesh, metadata={"quadrature_degree": degree + curved})

    @property
    def _straight(self) -> bool:
        return compat.cell_nodes(self.domain.mesh).shape[1] == 4

    def _assembled(self, form: Any) -> PETSc.Mat:
        whole = algebra.assemble(compat.form(form))
        found = self.free.restrict(whole)
        whole.destroy()
        return found

    # -- forces ---------------------------------------------------------------------------------

    @cached_property
    def _volume(self) -> Volume:
        degree = 4 * (self.degree - 1) + (0 if self._straight else 2)
        return Volume.of(self.space, self.degree, degree)

    def pulled(self, strain: np.ndarray) -> np.ndarray:
        """C:E (..., 3, 3, m) of strains alike."""
        first, second = lame_of(self.poisson_ratio)
        found = 2 * second * strain
        trace = first * np.einsum("...iim->...m", strain)
        for i in range(3):
            found[..., i, i, :] += trace
        return found

    def linear(self, u: np.ndarray) -> np.ndarray:
        """K(u), to more digits than the entries of the matrix have. Collective."""
        borne = np.array(self.stress)[:, None]

        def stress(gradients: list[np.ndarray]) -> np.ndarray:
            h = gradients[0]
            return self.pulled(_sym(h)) + h * borne

        return self._work(stress, u)

    def quadratic(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Q(u, v) of each column of both. Collective."""

        def stress(gradients: list[np.ndarray]) -> np.ndarray:
            g, h = gradients
            found = self.pulled(_product(g, h))
            found += _times(h, self.pulled(_sym(g)))
            found += _times(g, self.pulled(_sym(h)))
            return 0.5 * found

        return self._work(stress, u, v)

    def cubic(self, u: np.ndarray, v: np.ndarray, t: np.ndarray) -> np.ndarray:
        """T(u, v, t) of each column of the three. Collective."""

        def stress(gradients: list[np.ndarray]) -> np.ndarray:
            f, g, h = gradients
            found = _times(h, self.pulled(_product(f, g)))
            found += _times(f, self.pulled(_product(g, h)))
            found += _times(g, self.pulled(_product(f, h)))
            return found / 6

        return self._work(stress, u, v, t)

    def force(self, u: np.ndarray) -> np.ndarray:
        """K(u) + Q(u, u) + T(u, u, u) at once. Collective."""
        borne = np.array(self.stress)[:, None]

        def stress(gradients: list[np.ndarray]) -> np.ndarray:
            h = gradients[0]
            pull = self.pulled(_sym(h) + 0.5 * _product(h, h))
            return pull + h * borne + _times(h, pull)

        return self._work(stress, u)

    def beyond(self, u: np.ndarray) -> np.ndarray:
        """Q(u, u) + T(u, u, u) at once. Collective."""

        def stress(gradients: list[np.ndarray]) -> np.ndarray:
            h = gradients[0]
            bent = self.pulled(0.5 * _product(h, h))
            return bent + _times(h, self.pulled(_sym(h)) + bent)

        return self._work(stress, u)

    def along(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """2 Q(u, v) + 3 T(u, u, v), the derivative of `beyond` along v. Collective."""

        def stress(gradients: list[np.ndarray]) -> np.ndarray:
            h, g = gradients
            turned = self.pulled(_product(h, g))
            borne = self.pulled(_sym(h) + 0.5 * _product(h, h))
            return turned + _times(h, self.pulled(_sym(g)) + turned) + _times(g, borne)

        return self._work(stress, u, v)

    def pair_products(self, u: np.ndarray, pairs: np.ndarray) -> np.ndarray:
        """int S_jk:C:S_lm (p, p) of pairs (p, 2) of columns. Collective."""
        fields = self._nodal(u)
        found = np.zeros((len(pairs), len(pairs)))
        for cells in self._volume.chunks(9 * (u.shape[1] + 2 * len(pairs))):
            h = cells.gradient(fields)
            strain = _product(h[..., pairs[:, 0]], h[..., pairs[:, 1]])
            pull = self.pulled(strain) * cells.weights[..., None, None, None]
            found += pull.reshape(-1, len(pairs)).T @ strain.reshape(-1, len(pairs))
        return self.domain.comm.allreduce(found)

    def slopes(self, u: np.ndarray, along: Sequence[int]) -> np.ndarray:
        """int sum_d du/dx_d . dv/dx_d (m, m) of columns, over some directions. Collective."""
        fields = self._nodal(u)
        found = np.zeros((u.shape[1],) * 2)
        for cells in self._volume.chunks(9 * u.shape[1]):
            h = cells.gradient(fields)[:, :, :, list(along)]
            weighted = h * cells.weights[..., None, None, None]
            found += weighted.reshape(-1, u.shape[1]).T @ h.reshape(-1, u.shape[1])
        return self.domain.comm.allreduce(found)

    def _work(self, stress: Stress, *columns: np.ndarray) -> np.ndarray:
        """int P : grad w on the free degrees of freedom. Collective."""
        fields = [self._nodal(each) for each in columns]
        kind = np.result_type(*columns)
        n, m = len(fields[0]), columns[0].shape[1]
        forces = np.zeros((n, 3, m), dtype=kind)
        for cells in self._volume.chunks(9 * m * (len(fields) + 2)):
            gradients = [cells.gradient(each) for each in fields]
            cells.add_work(stress(gradients), forces)
        forces = forces.reshape(3 * n, m)
        if np.iscomplexobj(forces):
            return self.free.summed(forces.real) + 1j * self.free.summed(forces.imag)
        return self.free.summed(forces)

    def _nodal(self, columns: np.ndarray) -> np.ndarray:
        """Displacements (local nodes, 3, m) of columns."""
        if np.iscomplexobj(columns):
            return self._nodal(columns.real) + 1j * self._nodal(columns.imag)
        whole = self.free.extended(np.ascontiguousarray(columns))
        return whole.reshape(len(whole) // 3, 3, -1)


def lame_of(poisson_ratio: float) -> tuple[float, float]:
    """Lame's constants by the modulus."""
    nu = poisson_ratio
    return nu / ((1 + nu) * (1 - 2 * nu)), 1 / (2 * (1 + nu))


def _sym(gradient: np.ndarray) -> np.ndarray:
    return 0.5 * (gradient + gradient.swapaxes(-3, -2))


def _product(g: np.ndarray, h: np.ndarray) -> np.ndarray:
    """S = sym(g^T h) (c, q, 3, 3, m)."""
    found = np.zeros(np.broadcast_shapes(g.shape, h.shape), dtype=np.result_type(g, h))
    for i in range(3):
        found += g[:, :, i, :, None] * h[:, :, i, None]
    return _sym(found)


def _times(gradient: np.ndarray, stress: np.ndarray) -> np.ndarray:
    """(c, q, 3, 3, m) h T."""
    found = np.zeros(stress.shape, dtype=np.result_type(gradient, stress))
    for i in range(3):
        found += gradient[..., i, None, :] * stress[:, :, i, None]
    return found
