"""Linear dynamics of one class of symmetry: stiffness, mass, damping, and its lowest modes.

The modes are those that are named, each with its own quality factor, and more that are not: as
many as have frequencies that harmonics of the drive may meet.  What is beyond them follows
statically.  All of it is damped: a mode outside the model by the quality factor of the model's
highest, what is beyond the last mode by a stiffness-proportional damping that gives that mode the
same.
"""

from __future__ import annotations

from collections.abc import Callable

import attrs
import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from nanorom.errors import SolverError
from nanorom.types import Array
from nanorom.verification.factors import Factors
from nanorom.verification.film import Tables

Flexibility = Callable[[Array], Array]

DENSE = 900  # unknowns up to which all eigenvectors are computed at once faster than a few
EIGEN_TOLERANCE = 1e-10  # of a basis in which a preconditioner is written


@attrs.frozen(eq=False)
class ClassDynamics:
    """M w'' + C w' + K w of one class, film-scaled, on free degrees of freedom (n,).

    stiffness, mass : (n, n) of tension and bending, without linear stretching; static : solves
    with all linear stiffness; modes (n, m) of unit mass, values (m,) their squared frequencies,
    rates (m,) their damping rates; loss : rate of damping by stiffness of what is beyond them;
    viscous : (n, n) what a viscoelastic material adds to the damping, None if there is none.
    """

    stiffness: sp.csr_matrix
    mass: sp.csr_matrix
    static: Factors
    extra: int
    modes: Array
    values: Array
    rates: Array
    loss: float
    viscous: sp.csr_matrix | None = None
    momenta: Array = attrs.field(init=False)

    def __attrs_post_init__(self) -> None:
        object.__setattr__(self, "momenta", self.mass @ self.modes)

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return int(self.mass.shape[0])

    def flexibility(self, columns: Array) -> Array:
        """Static deflections (n, m) under forces (n, m), linear stretching included."""
        padded = np.zeros((self.size + self.extra, columns.shape[1]))
        padded[: self.size] = columns
        return self.static.solve(padded)[: self.size]

    def damping(self, columns: Array) -> Array:
        """C (n, m) of velocities (n, m)."""
        amplitudes = self.momenta.T @ columns
        force = self.momenta @ ((self.rates - self.loss * self.values)[:, None] * amplitudes)
        force += self.loss * (self.stiffness @ columns)
        if self.viscous is not None:
            force += self.viscous @ columns
        return np.asarray(force)

    def rest(self, columns: Array) -> Array:
        """Static deflections (n, m) under forces (n, m) that have nothing of the modes."""
        if self.modes.shape[1] == self.size:
            return np.zeros_like(columns)
        found = self.flexibility(columns - self.momenta @ (self.modes.T @ columns))
        return np.asarray(found - self.modes @ (self.momenta.T @ found))


def lowest(
    mass: sp.csr_matrix, flexibility: Flexibility, count: int, stiffness: sp.csr_matrix | None
) -> tuple[Array, Array]:
    """The ``count`` lowest squared frequencies (m,) and modes (n, m) of unit mass, or all.

    ``flexibility`` undoes all linear stiffness; ``stiffness`` (n, n) where that is a matrix.
    """
    n = mass.shape[0]
    if stiffness is not None and n <= DENSE:
        last = min(count, n) - 1
        found = sl.eigh(stiffness.toarray(), mass.toarray(), subset_by_index=(0, last))
        return found[0], found[1]
    inverse = spl.LinearOperator((n, n), matvec=lambda x: flexibility(x.reshape(n, 1))[:, 0])
    try:
        values, vectors = spl.eigsh(
            mass,  # of the stiffness the size alone is asked for
            k=min(count, n - 2),
            M=mass,
            sigma=0.0,
            OPinv=inverse,
            tol=EIGEN_TOLERANCE,
            v0=np.ones(n),
        )
    except spl.ArpackError as error:
        raise SolverError(f"modes outside the model were not found: {error}") from error
    order = np.argsort(values)
    return values[order], vectors[:, order]


def beyond(dynamics: ClassDynamics, values: Array, modes: Array) -> tuple[Array, Array]:
    """Squared frequencies and modes, of the lowest of a class, without the named ones.

    ``dynamics`` has the named modes alone.  Of modes that are near each other some may be named:
    the others are those orthogonal to them.
    """
    named = modes.T @ dynamics.momenta
    rest = sl.qr(named)[0][:, named.shape[1] :]
    found, turned = np.linalg.eigh(rest.T @ (values[:, None] * rest))
    return found, modes @ (rest @ turned)


def stretching(
    tables: Tables, shape: Array, law: Array, free: np.ndarray, in_plane: np.ndarray, held: bool
) -> sp.csc_matrix:
    """Linear stretching of a film that is not flat: (w, u) on free unknowns, u unrolled.

    1/2 int E:C:E of E = sym grad u + sym(grad w0 (x) grad w); the prestress is in the stiffness.
    held : the in-plane displacement is zero, and has no unknowns.
    """
    c, q = tables.weights.shape
    n = tables.dofs.shape[1]
    gradients = tables.gradients.reshape(c, 2, q, n).transpose(0, 2, 1, 3)
    slope = tables.slope(shape[:, None])[..., 0].transpose(1, 2, 0)
    strain = np.zeros((c, q, 3, 3 * n))  # xx, yy, 2 xy of (w, u_x, u_y)
    x, y = gradients[:, :, 0], gradients[:, :, 1]
    s, t = slope[..., 0, None], slope[..., 1, None]
    strain[:, :, 0, :n], strain[:, :, 1, :n], strain[:, :, 2, :n] = s * x, t * y, s * y + t * x
    strain[:, :, 0, n : 2 * n], strain[:, :, 2, n : 2 * n] = x, y
    strain[:, :, 1, 2 * n :], strain[:, :, 2, 2 * n :] = y, x
    weighted = np.einsum("cq,ab,cqbn->cqan", tables.weights, law, strain, optimize=True)
    rows = strain.reshape(c, 3 * q, 3 * n).transpose(0, 2, 1)
    local = np.matmul(rows, weighted.reshape(c, 3 * q, 3 * n))
    place = np.concatenate(
        [tables.dofs, tables.nodes + 2 * tables.in_plane, tables.nodes + 2 * tables.in_plane + 1],
        axis=1,
    )
    row = np.repeat(place, 3 * n, axis=1).ravel()
    column = np.tile(place, (1, 3 * n)).ravel()
    size = 3 * tables.nodes
    whole = sp.csc_matrix((local.ravel(), (row, column)), (size, size))
    kept = free if held else np.concatenate([free, tables.nodes + in_plane])
    return whole[kept][:, kept]


def geometric(tables: Tables, force: Array, free: np.ndarray) -> sp.csr_matrix:
    """int N : grad w (x) grad v on free unknowns, of a membrane force N (3, c, q)."""
    c, q = tables.weights.shape
    n = tables.dofs.shape[1]
    gradients = tables.gradients.reshape(c, 2, q, n)
    xx, yy, xy = force * tables.weights
    pulled = np.empty_like(gradients)
    pulled[:, 0] = xx[..., None] * gradients[:, 0] + xy[..., None] * gradients[:, 1]
    pulled[:, 1] = xy[..., None] * gradients[:, 0] + yy[..., None] * gradients[:, 1]
    local = np.matmul(tables.transposed, pulled.reshape(c, 2 * q, n))
    row = np.repeat(tables.dofs, n, axis=1).ravel()
    column = np.tile(tables.dofs, (1, n)).ravel()
    size = (tables.nodes, tables.nodes)
    return sp.csr_matrix((local.ravel(), (row, column)), size)[free][:, free]
