"""Static load cases of a flat film, many at once, class by class.

The membrane force of a prescribed deflection is quadratic in it and the in-plane equilibrium
linear in the displacement, so that everything STEP asks for is one trilinear form,

    T_r(w1, w2, w3) = int N(w1, w2):(grad phi_r (x) grad w3),
    N(w1, w2) = C:(sym(grad w1 (x) grad w2) + sym grad u),   u in equilibrium with N,

with eta_r(w) = 1/2 T_r(w, w, w) and its derivative along v: 1/2 T_r(w, w, v) + T_r(w, v, w).
Where mirrors cut the film, fields are kept by parity: the in-plane problem of each class is solved
by itself, for all load cases together.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from nanorom.fem.fields import membrane, quadrature
from nanorom.fem.modes.eigen import Modes
from nanorom.fem.solvers import algebra, groups
from nanorom.fem.symmetry import Parity, product_parity
from nanorom.fem.tensors import inplane, lateral
from nanorom.fem.tensors.equilibrium import Equilibrium
from nanorom.fem.tensors.inplane import InPlane

REFINED = 1e-11  # residual beyond which displacements are solved for again; tensors then err by
# a tenth of it
MOST_COLUMNS = 64  # load cases solved together
MOST_APART = 1  # numbers of two modes whose product is looked at by itself

ByParity = dict[Parity, np.ndarray]


class FlatCases:
    """Nonlinear static equilibrium of a flat film under prescribed deflections w = Phi q."""

    odd = True  # the force of -w is minus that of w: a film without curvature does not tell sides
    polynomial = True
    most_columns = MOST_COLUMNS

    def __init__(self, modes: Modes, in_plane: str = "free") -> None:
        self.modes, self.plate = modes, modes.plate
        self._stiffness = modes.modal_stiffness()
        self._members = {
            p: np.array([i for i, own in enumerate(modes.parities) if own == p])
            for p in sorted(set(modes.parities))
        }
        self._equilibria: dict[Parity, Equilibrium] = {}
        self._assembled = None
        if in_plane == "free":
            self._assembled = algebra.assemble(self.plate.compiled(self.plate.in_plane_form))
        self.displacement: ByParity = {}

    @property
    def parities(self) -> list[Parity]:
        """Classes of symmetry of the modes."""
        return self.modes.parities

    @property
    def key(self) -> str:
        """Tells modes and mesh from those of other cases."""
        return self.modes.key

    def nonlinear_force(self, q: np.ndarray) -> np.ndarray:
        """eta (L, m) = Phi^T (F_T - K X_c) at modal amplitudes q (L, m). Collective."""
        total = 0.5 * self.trilinear(q, q, q) + self._stiffness @ q
        return total - self._stiffness @ q

    def in_plane(self, amplitude: float) -> InPlane:
        """What is known of the displacements, errors relative to the largest energy of a mode.

        It does not depend on the amplitude.  Collective.
        """
        n = len(self.modes.parities)
        largest, found = 0.0, []
        equilibria = self._equilibria if lateral.is_slender(self.plate) else {}
        for first in range(0, n, MOST_COLUMNS):
            own = np.eye(n)[:, first : first + MOST_COLUMNS]
            for apart in range(min(n, MOST_APART + 1)):  # products of two modes move more slowly
                other = np.eye(n, k=apart)[:, first : first + MOST_COLUMNS]
                force = self._trilinear(own, other, own)
                largest = max(largest, np.abs(np.diag(force[first:])).max())
                found += [
                    inplane.known(self.plate, moved, p, equilibria.get(p))
                    for p, moved in self.displacement.items()
                ]
        return InPlane.of_parts(found, largest)

    def tangents(self, q: np.ndarray) -> np.ndarray:
        """d eta_r/d q_l (m, L, L) at states q (L, m). Collective."""
        n, m = q.shape
        state, direction = np.repeat(q, n, axis=1), np.tile(np.eye(n), m)
        columns = 0.5 * self.trilinear(state, state, direction)
        columns += self.trilinear(state, direction, state)
        return columns.reshape(n, m, n).transpose(1, 0, 2)

    def trilinear(self, q1: np.ndarray, q2: np.ndarray, q3: np.ndarray) -> np.ndarray:
        """T_r (L, m) of amplitudes (L, m), columns of equal classes together. Collective."""
        blocks = list(self._blocks(q1, q2, q3))

        def work(own: Sequence[int]) -> dict[int, np.ndarray]:
            return {i: self._trilinear(*(q[:, blocks[i]] for q in (q1, q2, q3))) for i in own}

        result = np.empty_like(q1)
        for i, found in groups.shared(self.plate.domain.across, range(len(blocks)), work).items():
            result[:, blocks[i]] = found
        return result

    def _blocks(self, *amplitudes: np.ndarray) -> Iterator[np.ndarray]:
        """Columns in which the same classes move, at most `MOST_COLUMNS` at a time.

        Every group of ranks has its share of them.
        """
        n_groups = self.plate.domain.across.size
        moving = [
            tuple(bool(q[own, i].any()) for q in amplitudes for own in self._members.values())
            for i in range(amplitudes[0].shape[1])
        ]
        for kind in sorted(set(moving)):
            columns = np.array([i for i, own in enumerate(moving) if own == kind])
            size = min(MOST_COLUMNS, -(-len(columns) // n_groups))
            for first in range(0, len(columns), size):
                yield columns[first : first + size]

    def _trilinear(self, q1: np.ndarray, q2: np.ndarray, q3: np.ndarray) -> np.ndarray:
        """T_r (L, m) of columns in which the same classes move."""
        plate, m = self.plate, q1.shape[1]
        self.displacement = {}
        self.displacement = {p: self._solved(p, load) for p, load in self._loads(q1, q2).items()}
        solved = [self._equilibria[p] for p in self.displacement if p in self._equilibria]
        if max((equilibrium.residual for equilibrium in solved), default=0.0) > REFINED:
            # a film much stiffer in one direction: what is left of the strains is a small
            # difference, and the residual is found from it rather than from the displacement
            for parity, load in self._loads(q1, q2).items():
                self.displacement[parity] += self._solved(parity, load, again=True)
        result = np.zeros_like(q1)
        for field in quadrature.fields(plate, columns=12 * m):
            slopes = self._mode_slopes(field)
            third = _moved(slopes, q3)
            for parity, strain in _strains(_moved(slopes, q1), _moved(slopes, q2)).items():
                strain = strain + membrane.strain(plate, field, self.displacement[parity])
                force = membrane.force(plate, field, strain) * field.weights[..., None]
                for own, (x, y) in third.items():
                    target = product_parity(own, parity)
                    if target in slopes:
                        traction = np.stack(
                            [force[0] * x + force[2] * y, force[2] * x + force[1] * y]
                        )
                        slope, members = slopes[target]
                        rows = slope.reshape(-1, len(members))
                        result[members] += rows.T @ traction.reshape(len(rows), m)
        return plate.mirrors.copies * plate.domain.comm.allreduce(result)

    def _loads(self, q1: np.ndarray, q2: np.ndarray) -> ByParity:
        """In-plane loads (local dofs, m) of the strains at the displacement that there is."""
        loads: ByParity = {}
        for field in quadrature.fields(self.plate, columns=12 * q1.shape[1]):
            slopes = self._mode_slopes(field)
            for parity, strain in _strains(_moved(slopes, q1), _moved(slopes, q2)).items():
                if parity in self.displacement:
                    strain = strain + membrane.strain(self.plate, field, self.displacement[parity])
                force = membrane.force(self.plate, field, strain) * field.weights[..., None]
                load = loads.setdefault(parity, membrane.no_load(self.plate, q1.shape[1]))
                membrane.add_load(self.plate, field, force, load)
        if self.plate.stiffness.in_plane:
            for parity in self.displacement:
                force = membrane.spring_force(self.plate, self.displacement[parity])
                loads[parity][: len(force)] += force
        return loads

    def _mode_slopes(self, field: quadrature.CellFields) -> dict[Parity, tuple]:
        """By class: slopes (2, c, q, L_c) of its modes, and their numbers."""
        slope = np.moveaxis(field.gradient(self.modes.shapes), 2, 0)
        return {p: (np.ascontiguousarray(slope[..., own]), own) for p, own in self._members.items()}

    def _solved(self, parity: Parity, load: np.ndarray, again: bool = False) -> np.ndarray:
        """Displacement (local dofs, m) in equilibrium with a load. Collective."""
        if self._assembled is None:
            return np.zeros_like(load)
        if parity not in self._equilibria:
            self._equilibria[parity] = Equilibrium(self.plate, self._assembled, parity)
        load = membrane.summed(self.plate, load)
        equilibrium = self._equilibria[parity]
        if again:
            return equilibrium.correction(load)
        block = equilibrium.free.taken(load)

        def residual(u: np.ndarray | None) -> np.ndarray:
            return block if u is None else block + equilibrium.product(u)

        return equilibrium.solve(residual)


def _moved(slopes: dict[Parity, tuple], q: np.ndarray) -> ByParity:
    """Slopes (2, c, q, m) of the deflections Phi q, by class; classes at rest are left out."""
    return {p: slope @ q[own] for p, (slope, own) in slopes.items() if q[own].any()}


def _strains(first: ByParity, second: ByParity) -> ByParity:
    """sym(grad w1 (x) grad w2), components (3, c, q, m), by the parity of the product."""
    found: ByParity = {}
    for p1, slope1 in first.items():
        for p2, slope2 in second.items():
            product = membrane.slope_product(slope1, slope2)
            parity = product_parity(p1, p2)
            found[parity] = found[parity] + product if parity in found else product
    return found
