"""What everything outside the modes adds to the cubic force of a film that tells its sides.

The modes pull on all of the film with a force quadratic in their amplitudes, A_jk q_j q_k, and what
lies outside them gives way by psi = -G A_jk q_j q_k, with G the film's compliance less that of the
modes.  As far as that follows at once (its own frequencies are far above those of the products of
modes) it takes the energy 1/2 A_jk G A_lm q_j q_k q_l q_m away, which is a further cubic force,

    B_rjkl = -2 sym(A_rj G A_kl),    G = K^-1 - sum_rs phi_r (Phi^T K Phi)^-1_rs phi_s^T,

and that is all to third order (implicit condensation: Hollkamp and Gordon 2008,
doi:10.1016/j.jsv.2008.04.035).  K couples the deflection with the in-plane displacement, and A_jk
is the force on the deflection v once the plane has found its equilibrium, as in `direct`,

    A_jk(v) = 1/2 int N_jk:(grad w0 (x) grad v) + N_0j:(grad phi_k (x) grad v)
                    + N_0k:(grad phi_j (x) grad v) - W''' phi_j phi_k v,

with N_jk the membrane force of a pair, w0 the shape of the film and W the potential of a gate.
"""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np
from mpi4py import MPI
from petsc4py import PETSc
from scipy.sparse import csr_matrix

from nanorom.fem.fields import membrane, quadrature
from nanorom.fem.models.coupled import Film
from nanorom.fem.modes import coupled
from nanorom.fem.modes.eigen import Modes
from nanorom.fem.solvers import algebra, groups
from nanorom.fem.symmetry import Parity, product_parity
from nanorom.fem.tensors.direct import pairs_by_parity
from nanorom.rom import tensors

MATTERS = 1e-3  # of the largest response: slower parts of smaller ones are not told of


@attrs.frozen(eq=False)
class Outside:
    """The response of all that lies outside the modes.

    cubic: (L, L, L, L), the force that it adds; eigenvalue: squared frequency of the slowest
    response to a product of modes (Rayleigh's quotient, from above), infinite if there is none;
    own: (L,), the same of the response to the square of each mode, if that is known.
    """

    cubic: np.ndarray
    eigenvalue: float = np.inf
    own: np.ndarray = attrs.field(factory=lambda: np.empty(0))


class PairForces:
    """The forces A_jk on the deflection, gathered from the membrane forces of pairs.

    It takes what `direct.stretching_products` tells of every pair of the modes and, as the last of
    the shapes, the film's own.

    Attributes
    ----------
    pairs : (p, 2) of modes, by the parity of their product.
    loads : (local dofs, p) for the pairs of each parity, once `gathered`.
    """

    def __init__(self, modes: Modes) -> None:
        self._modes = modes
        self.pairs = pairs_by_parity(modes.parities)
        self._column = {
            tuple(pair): i for members in self.pairs.values() for i, pair in enumerate(members)
        }
        dofs = len(modes.shapes)
        self.loads = {parity: np.zeros((dofs, len(p))) for parity, p in self.pairs.items()}

    def __call__(
        self,
        field: quadrature.CellFields,
        slope: np.ndarray,
        members: np.ndarray,
        force: np.ndarray,
    ) -> None:
        """Take weighted membrane forces (3, c, q, p) of pairs (p, 2) of shapes in some cells.

        slope : (2, c, q, L + 1) of all shapes.
        """
        n = len(self._modes.parities)
        own = members[:, 1] < n
        tractions = {
            parity: np.zeros((*slope.shape[:3], len(p))) for parity, p in self.pairs.items()
        }
        for i in np.flatnonzero(own):
            j, k = (int(mode) for mode in members[i])
            self._add(tractions, (j, k), force[..., i], slope[..., n])
        for i in np.flatnonzero(~own & (members[:, 0] < n)):
            j = int(members[i, 0])
            for k in range(n):
                share = 2.0 if k == j else 1.0
                pair = (min(j, k), max(j, k))
                self._add(tractions, pair, share * force[..., i], slope[..., k])
        for parity, traction in tractions.items():
            if traction.any():
                _scatter(field, traction, self.loads[parity])

    def _add(
        self,
        tractions: dict[Parity, np.ndarray],
        pair: tuple[int, int],
        force: np.ndarray,
        slope: np.ndarray,
    ) -> None:
        (xx, yy, xy), (x, y) = force, slope
        parities = self._modes.parities
        target = tractions[product_parity(parities[pair[0]], parities[pair[1]])]
        column = self._column[pair]
        target[0, ..., column] += 0.5 * (xx * x + xy * y)
        target[1, ..., column] += 0.5 * (xy * x + yy * y)

    def gathered(self) -> dict[Parity, np.ndarray]:
        """The forces (local dofs, p) summed over all cells and groups, the gate's too. Collective.

        To be asked for once.
        """
        plate = self._modes.plate
        if plate.state.attraction is not None:
            self._add_attraction()
        for parity, load in self.loads.items():
            plate.domain.across.Allreduce(MPI.IN_PLACE, load)  # each group has had its own pairs
            self.loads[parity] = membrane.summed_over_ranks(plate.deflections, load)
        return self.loads

    def _add_attraction(self) -> None:
        """The third derivative of the gates' potential, which softens the film further."""
        plate = self._modes.plate
        attraction, shape = plate.state.attraction, plate.state.shape
        assert attraction is not None
        height_of = shape.x.array[:, None]
        across = plate.domain.across
        for field in quadrature.fields(plate, columns=2 * len(self._column)):
            height = field.value(height_of)[..., 0]
            third = attraction.derivative(3, height, field.cells) * field.weights / across.size
            value = field.value(self._modes.shapes)
            for parity, (j, k) in ((p, m.T) for p, m in self.pairs.items()):
                density = -0.5 * third[..., None] * value[..., j] * value[..., k]
                local = np.einsum("qn,cqp->cnp", field.values, density, optimize=True)
                _spread(field, local, self.loads[parity])


def _scatter(field: quadrature.CellFields, traction: np.ndarray, loads: np.ndarray) -> None:
    """Add int t . grad v of weighted tractions (2, c, q, p) to loads (local dofs, p)."""
    c, q, _, n = field.gradients.shape
    gradients = field.gradients.reshape(c, 2 * q, n).transpose(0, 2, 1)
    columns = np.stack([traction[0], traction[1]], axis=2).reshape(c, 2 * q, -1)
    _spread(field, np.matmul(gradients, columns), loads)


def _spread(field: quadrature.CellFields, local: np.ndarray, loads: np.ndarray) -> None:
    """Add what cells (c, n, p) have at their degrees of freedom."""
    rows, place = np.unique(field.dofs.ravel(), return_inverse=True)
    count = len(place)
    matrix = csr_matrix((np.ones(count), (place, np.arange(count))), (len(rows), count))
    loads[rows] += matrix @ local.reshape(count, -1)


def response(modes: Modes, forces: PairForces, stiffness: np.ndarray) -> Outside:
    """What the rest of the film adds to the modes. Collective.

    stiffness : (L, L) of the modes, all of it.
    """
    plate, n = modes.plate, len(modes.parities)
    loads = forces.gathered()
    film = Film(plate)

    def work(own: Sequence[Parity]) -> dict[Parity, tuple[np.ndarray, np.ndarray]]:
        totals = coupled.stiffnesses(film, own)
        return {p: _class_response(modes, film, totals[p], loads[p], p, stiffness) for p in own}

    found = groups.shared(plate.domain.across, list(loads), work)
    products, own = np.zeros((n,) * 4), np.full(n, np.inf)
    squares = []
    for parity, (energy, mass) in found.items():
        tensors.unpacked(energy, forces.pairs[parity], products)
        for i, (j, k) in enumerate(forces.pairs[parity]):
            if j == k and mass[i] > 0:
                own[j] = energy[i, i] / mass[i]
        squares.append(np.column_stack([energy.diagonal(), mass]))
    energy, mass = np.concatenate(squares).T
    slow = energy > MATTERS * max(energy.max(), np.finfo(float).tiny)
    eigenvalue = float((energy[slow] / mass[slow]).min()) if slow.any() else np.inf
    return Outside(tensors.paired(products), eigenvalue, own)


def _class_response(
    modes: Modes,
    film: Film,
    total: PETSc.Mat,
    load: np.ndarray,
    parity: Parity,
    stiffness: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """A_jk G A_lm (p, p) of the pairs of one parity, and the squares (p,) of their responses."""
    plate, n = modes.plate, modes.n_owned
    free = film.free_dofs(parity)
    matrix = free.restrict(total)
    solver = plate.solvers.make(free, matrix, "nanorom_outside_", "film's stiffness")
    response = np.empty_like(load)
    for first in range(0, load.shape[1], solver.columns):
        some = slice(first, first + solver.columns)
        states = film.deflections_to_states(load[:, some])
        response[:, some] = film.deflections(free.extended(solver.solve(free.taken(states))))
    solver.reset()
    matrix.destroy()
    comm, copies = plate.domain.comm, plate.mirrors.copies
    work = copies * comm.allreduce(load[:n].T @ modes.shapes[:n])
    work *= [other == parity for other in modes.parities]
    shares = np.linalg.solve(stiffness, work.T)
    response -= modes.shapes @ shares
    energy = copies * comm.allreduce(load[:n].T @ response[:n])
    mass = algebra.multiply(modes.mass, response[:n])
    square = copies * comm.allreduce(np.sum(response[:n] * mass, axis=0))
    return 0.5 * (energy + energy.T), square
