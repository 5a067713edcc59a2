"""A shell's equations of motion on one rank: matrices and multilinear forces of all that moves.

With the placement's derivatives and the director as one field G = (F_1, F_2, d_1, d_2, d) along two
unit tangents, every strain of `shell` is half a symmetric bilinear map at equal arguments, less its
value undeformed, e = 1/2 S(G, G) - e_0.  About a static state, G0 with stress s0,

    e = e(G0) + S(G0, x) + 1/2 S(x, x) ,

so that the force is cubic in the displacement and the change of the director x:

    K(x; w)       = int C S(G0, x):S(G0, w) + s0:S(x, w),
    Q(x, y; w)    = 1/2 int C S(x, y):S(G0, w) + C S(G0, x):S(y, w) + C S(G0, y):S(x, w),
    T(x, y, z; w) = 1/6 int C S(x, y):S(z, w) + C S(y, z):S(x, w) + C S(x, z):S(y, w).

A pressure p that follows the shell adds -p/2 int (x_1 x y_2 + y_1 x x_2) . w to Q; it derives from
a potential where every edge is held.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import attrs
import basix
import numpy as np
import scipy.sparse as sp
import ufl
from petsc4py import PETSc

from nanorom.errors import SolverError
from nanorom.fem.fields import quadrature
from nanorom.fem.models.shell import SHEAR_FACTOR, Shell
from nanorom.fem.solvers import algebra, compat

CHUNK_ENTRIES = 2_000_000  # numbers that one array of a chunk of cells may have
STRAINS = 9  # two stretches and a shear, of the surface and of its curvature; two shears; thickness


@attrs.frozen(eq=False)
class Turned:
    """What the strains of a field consist of: derivatives along both tangents, and its director.

    u1, u2, d1, d2, d : (c, q, 3, m) each.
    """

    u1: np.ndarray
    u2: np.ndarray
    d1: np.ndarray
    d2: np.ndarray
    d: np.ndarray

    def plus(self, other: Turned) -> Turned:
        """The sum of two fields."""
        mine, theirs = (attrs.astuple(each, recurse=False) for each in (self, other))
        return Turned(*(a + b for a, b in zip(mine, theirs)))


@attrs.frozen(eq=False)
class Cells:
    """Some cells of a shell: basis along both tangents, static state, and what it bears.

    gradients (c, 2 q, n), values (q, n), weights (c, q), dofs (c, n): of the scalar basis; state:
    G0, one column; stress (9, c, q, 1): s0.
    """

    gradients: np.ndarray
    values: np.ndarray
    weights: np.ndarray
    dofs: np.ndarray
    state: Turned
    stress: np.ndarray

    def field(self, nodal: np.ndarray) -> Turned:
        """Of displacements and directors (nodes, 6, m)."""
        c, q = self.weights.shape
        local = nodal[self.dofs].reshape(c, self.dofs.shape[1], -1)
        slopes = np.matmul(self.gradients, local).reshape(c, 2, q, *nodal.shape[1:])
        values = np.matmul(self.values, local).reshape(c, q, *nodal.shape[1:])
        x, y = slopes[:, 0], slopes[:, 1]
        return Turned(x[:, :, :3], y[:, :, :3], x[:, :, 3:], y[:, :, 3:], values[:, :, 3:])

    def add_work(self, pull: Turned, push: np.ndarray | None, forces: np.ndarray) -> None:
        """Add the work of forces on all parts of a field to (nodes, 6, m); push: on u itself."""
        c, q, _, m = pull.d.shape
        n = self.dofs.shape[1]
        slopes = np.empty((c, 2, q, 6, m), dtype=pull.u1.dtype)
        slopes[:, 0, :, :3], slopes[:, 1, :, :3] = pull.u1, pull.u2
        slopes[:, 0, :, 3:], slopes[:, 1, :, 3:] = pull.d1, pull.d2
        values = np.zeros((c, q, 6, m), dtype=pull.u1.dtype)
        values[:, :, 3:] = pull.d
        if push is not None:
            values[:, :, :3] = push
        weights = self.weights[:, None, :, None, None]
        slopes *= weights
        values *= weights[:, 0]
        local = np.matmul(self.gradients.transpose(0, 2, 1), slopes.reshape(c, 2 * q, 6 * m))
        local += np.matmul(self.values.T, values.reshape(c, q, 6 * m))
        rows, place = np.unique(self.dofs.ravel(), return_inverse=True)
        gather = sp.csr_matrix((np.ones(c * n), (place, np.arange(c * n))), (len(rows), c * n))
        forces[rows] += (gather @ local.reshape(c * n, -1)).reshape(len(rows), 6, m)


@attrs.frozen(eq=False)
class ShellSystem:
    """`rom.manifold.full.FullSystem` of a shell about its static state, by its own units.

    mass, stiffness (n, n) on free degrees of freedom; free: their rows; nodes: all of them;
    stiffening: of the nine strains; pressure: that follows it.
    """

    mass: sp.csr_matrix
    stiffness: sp.csr_matrix
    free: np.ndarray
    nodes: int
    cells: Cells
    law: np.ndarray
    pressure: float

    @classmethod
    def of(
        cls, shell: Shell, free: np.ndarray, stiffness: PETSc.Mat, pressure: float = 0.0
    ) -> ShellSystem:
        """About the state that the shell has, with its stiffness on free rows (n,).

        Raises SolverError on several ranks.
        """
        if shell.domain.comm.size > 1:
            raise SolverError("all of a shell's motion is solved for on one rank")
        mass = _curvature(shell, shell.kinetic_energy(shell.state))
        law = _law(shell)
        return cls(
            mass=mass[free][:, free],
            stiffness=algebra.as_csr(stiffness),
            free=free,
            nodes=len(shell.state.x.array) // 6,
            cells=_tabulated(shell, law),
            law=law,
            pressure=pressure,
        )

    @property
    def size(self) -> int:
        """Number of free degrees of freedom n."""
        return len(self.free)

    def quadratic(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Q(u, v) (n, p) of columns of both, real or complex."""

        def force(cells: Cells, x: Turned, y: Turned) -> tuple[Turned, np.ndarray | None]:
            still = cells.state
            found = pulled(self._stress(strain(x, y)), still)
            found = found.plus(pulled(self._stress(strain(still, x)), y))
            found = found.plus(pulled(self._stress(strain(still, y)), x))
            push = self._push(x, y)
            half = Turned(*(0.5 * part for part in attrs.astuple(found, recurse=False)))
            return half, push

        return self._work(force, u, v)

    def cubic(self, u: np.ndarray, v: np.ndarray, w: np.ndarray) -> np.ndarray:
        """T(u, v, w) (n, p) of columns of the three, real or complex."""

        def force(cells: Cells, x: Turned, y: Turned, z: Turned) -> tuple[Turned, None]:
            found = pulled(self._stress(strain(x, y)) / 6, z)
            found = found.plus(pulled(self._stress(strain(y, z)) / 6, x))
            return found.plus(pulled(self._stress(strain(x, z)) / 6, y)), None

        return self._work(force, u, v, w)

    def linear(self, u: np.ndarray) -> np.ndarray:
        """K u (n, p)."""
        return np.asarray(self.stiffness @ u)

    def force(self, u: np.ndarray) -> np.ndarray:
        """Q(u, u) + T(u, u, u) (n, p)."""

        def force(cells: Cells, x: Turned) -> tuple[Turned, np.ndarray | None]:
            bent = 0.5 * self._stress(strain(x, x))
            pull = pulled(bent, cells.state)
            pull = pull.plus(pulled(self._stress(strain(cells.state, x)) + bent, x))
            return pull, self._push(x, x)

        return self._work(force, u)

    def along(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """2 Q(u, v) + 3 T(u, u, v) (n, p)."""

        def force(cells: Cells, x: Turned, y: Turned) -> tuple[Turned, np.ndarray | None]:
            still = cells.state
            cross = self._stress(strain(x, y))
            found = pulled(cross, still)
            found = found.plus(pulled(self._stress(strain(still, y)) + cross, x))
            borne = self._stress(strain(still, x) + 0.5 * strain(x, x))
            push = self._push(x, y)
            return found.plus(pulled(borne, y)), None if push is None else 2 * push

        return self._work(force, u, v)

    def pair_products(self, shapes: np.ndarray, pairs: np.ndarray) -> np.ndarray:
        """int S_jk:C S_lm (p, p) of pairs (p, 2) of shapes (n, k)."""
        found = np.zeros((len(pairs),) * 2)
        nodal = self._nodal(shapes)
        j, k = pairs.T
        for cells in self._chunks(STRAINS * (shapes.shape[1] + 4 * len(pairs))):
            field = cells.field(nodal)
            parts = attrs.astuple(field, recurse=False)
            own = strain(*(Turned(*(part[..., each] for part in parts)) for each in (j, k)))
            stress = self._stress(own) * cells.weights[..., None]
            found += stress.reshape(-1, len(pairs)).T @ own.reshape(-1, len(pairs))
        return found

    # -- parts ----------------------------------------------------------------------------------

    def _stress(self, strains: np.ndarray) -> np.ndarray:
        return np.tensordot(self.law, strains, axes=1)

    def _push(self, x: Turned, y: Turned) -> np.ndarray | None:
        if self.pressure == 0.0:
            return None
        area = _cross(x.u1, y.u2) + _cross(y.u1, x.u2)
        return -0.5 * self.pressure * area

    def _work(
        self, force: Callable[..., tuple[Turned, np.ndarray | None]], *columns: np.ndarray
    ) -> np.ndarray:
        """Forces (n, p) that a field's parts do work against."""
        fields = [self._nodal(each) for each in columns]
        found = np.zeros(fields[0].shape, dtype=np.result_type(*columns))
        for cells in self._chunks(15 * found.shape[2] * (len(fields) + 1)):
            cells.add_work(*force(cells, *(cells.field(each) for each in fields)), found)
        return np.asarray(found.reshape(6 * self.nodes, -1)[self.free])

    def _nodal(self, columns: np.ndarray) -> np.ndarray:
        """(nodes, 6, m) of free degrees of freedom (n, m)."""
        whole = np.zeros((6 * self.nodes, columns.shape[1]), dtype=columns.dtype)
        whole[self.free] = columns
        return whole.reshape(self.nodes, 6, -1)

    def _chunks(self, columns: int) -> Iterator[Cells]:
        """Some cells at a time, for that many numbers at every point."""
        whole = self.cells
        step = max(1, CHUNK_ENTRIES // (whole.weights.shape[1] * columns))
        for first in range(0, len(whole.weights), step):
            own = slice(first, first + step)
            state = attrs.astuple(whole.state, recurse=False)
            yield Cells(
                whole.gradients[own],
                whole.values,
                whole.weights[own],
                whole.dofs[own],
                Turned(*(part[own] for part in state)),
                whole.stress[:, own],
            )


def lifted(shell: Shell, free: np.ndarray) -> np.ndarray:
    """int w_z (n,) of displacements w, on free degrees of freedom."""
    form = ufl.TestFunction(shell.space)[2] * shell.dx()
    return np.asarray(algebra.assemble_vector(compat.form(form))[free])


def stiffened(shell: Shell, free: np.ndarray) -> sp.csr_matrix:
    """What a unit of tension in every direction adds to the stiffness (n, n)."""
    return _curvature(shell, shell.unit_tension_energy(shell.state))[free][:, free]


def strain(x: Turned, y: Turned) -> np.ndarray:
    """S(x, y) (9, c, q, m)."""
    found = np.stack(
        [
            _dot(x.u1, y.u1),
            _dot(x.u2, y.u2),
            _dot(x.u1, y.u2) + _dot(x.u2, y.u1),
            _dot(x.u1, y.d1) + _dot(x.d1, y.u1),
            _dot(x.u2, y.d2) + _dot(x.d2, y.u2),
            _dot(x.u1, y.d2) + _dot(x.d2, y.u1) + _dot(x.u2, y.d1) + _dot(x.d1, y.u2),
            _dot(x.u1, y.d) + _dot(x.d, y.u1),
            _dot(x.u2, y.d) + _dot(x.d, y.u2),
            _dot(x.d, y.d),
        ]
    )
    return found


def pulled(stress: np.ndarray, x: Turned) -> Turned:
    """The force s:S(x, .) on all parts of a field, of stresses (9, c, q, m)."""
    xx, yy, xy, bent_x, bent_y, twisted, shear_x, shear_y, thick = stress[:, :, :, None]
    return Turned(
        xx * x.u1 + xy * x.u2 + bent_x * x.d1 + twisted * x.d2 + shear_x * x.d,
        yy * x.u2 + xy * x.u1 + bent_y * x.d2 + twisted * x.d1 + shear_y * x.d,
        bent_x * x.u1 + twisted * x.u2,
        bent_y * x.u2 + twisted * x.u1,
        shear_x * x.u1 + shear_y * x.u2 + thick * x.d,
    )


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    found = a[:, :, 0] * b[:, :, 0]
    found += a[:, :, 1] * b[:, :, 1]
    found += a[:, :, 2] * b[:, :, 2]
    return found


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.cross(a, b, axis=2)


def _curvature(shell: Shell, energy: Any) -> sp.csr_matrix:
    """Second derivative of an energy of the state, on all degrees of freedom."""
    form = ufl.derivative(ufl.derivative(energy, shell.state), shell.state)
    return algebra.as_csr(algebra.assemble(compat.form(form)))


def _law(shell: Shell) -> np.ndarray:
    """Forces (9, 9) of the strains, all of the thickness."""
    given = shell.stiffness
    nu, h = given.poisson_ratio, given.thickness
    stretched = np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]]) / (1 - nu**2)
    law = np.zeros((STRAINS, STRAINS))
    law[:3, :3] = stretched
    law[3:6, 3:6] = h**2 / 12 * stretched
    law[6, 6] = law[7, 7] = SHEAR_FACTOR / (2 * (1 + nu))
    law[8, 8] = 1.0
    return given.youngs_modulus * h * law


def _tabulated(shell: Shell, law: np.ndarray) -> Cells:
    """All cells, with the shell's current state as the static one."""
    degree = 2 * shell.degree + 2
    rule = basix.make_quadrature(basix.CellType.triangle, degree)
    points, weights = np.asarray(rule[0]), np.asarray(rule[1])
    own = np.arange(quadrature.owned_cells(shell))
    fields = quadrature.tabulate(shell, own, points, weights)
    along = _tangents(shell, own, points)
    c, q, _, n = fields.gradients.shape
    gradients = np.einsum("cqad,cqdn->caqn", along, fields.gradients, optimize=True)
    cells = Cells(
        gradients=np.ascontiguousarray(gradients.reshape(c, 2 * q, n)),
        values=fields.values,
        weights=fields.weights,
        dofs=compat.cell_dofs(shell.space)[own],
        state=Turned(*np.zeros((5, c, q, 3, 1))),
        stress=np.zeros((STRAINS, c, q, 1)),
    )
    before = np.zeros((len(shell.state.x.array) // 6, 6, 1))
    before[:, 3:, 0] = shell.normals()
    reference = cells.field(before)
    reference = attrs.evolve(reference, u1=along[:, :, 0, :, None], u2=along[:, :, 1, :, None])
    moved = reference.plus(cells.field(shell.state.x.array.reshape(-1, 6, 1)))
    borne = 0.5 * (strain(moved, moved) - strain(reference, reference))
    stress = np.tensordot(law, borne, axes=1)
    tension = np.array(shell.stiffness.pre_tension)
    first, second = along[:, :, 0], along[:, :, 1]
    for row, pair in enumerate(((first, first), (second, second), (first, second))):
        stress[row, ..., 0] += np.einsum("d,cqd,cqd->cq", tension, *pair)
    return attrs.evolve(cells, state=moved, stress=stress)


def _tangents(shell: Shell, cells: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Two unit tangents (c, q, 2, 3), turned as the cells' own."""
    _, jacobian = quadrature.map_cells(shell, cells, points)
    first, second = jacobian[..., 0], jacobian[..., 1]
    first = first / np.linalg.norm(first, axis=-1, keepdims=True)
    second = second - np.sum(first * second, axis=-1, keepdims=True) * first
    second = second / np.linalg.norm(second, axis=-1, keepdims=True)
    return np.stack([first, second], axis=2)
