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
from petsc4py import PETSc

from nanorom.errors import SolverError
from nanorom.fem.fields import membrane, quadrature
from nanorom.fem.modes.eigen import Modes
from nanorom.fem.solvers import algebra, groups, multigrid
from nanorom.fem.symmetry import Parity, product_parity
from nanorom.fem.tensors import inplane
from nanorom.fem.tensors.inplane import InPlane

SNES_TOLERANCE = 1e-10  # in-plane residual relative to the load of the deflection
REFINED = 1e-11  # residual beyond which displacements are solved for again; tensors then err by
# a tenth of it
TINY = 1e-300
MOST_COLUMNS = 64  # load cases solved together
MOST_APART = 1  # numbers of two modes whose product is looked at by itself

ByParity = dict[Parity, np.ndarray]


class FlatCases:
    """Nonlinear static equilibrium of a flat film under prescribed deflections w = Phi q."""

    odd = True  # the force of -w is minus that of w: a film without curvature does not tell sides
    most_columns = MOST_COLUMNS

    def __init__(self, modes: Modes, in_plane: str = "free") -> None:
        self.modes, self.plate = modes, modes.plate
        self._stiffness = modes.modal_stiffness()
        self._members = {
            p: np.array([i for i, own in enumerate(modes.parities) if own == p])
            for p in sorted(set(modes.parities))
        }
        self._equilibria: dict[Parity, _Equilibrium] = {}
        self._assembled = None
        if in_plane == "free":
            self._assembled = algebra.assemble(self.plate.compiled(self.plate.in_plane_form))
        self.displacement: ByParity = {}

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
        for first in range(0, n, MOST_COLUMNS):
            own = np.eye(n)[:, first : first + MOST_COLUMNS]
            for apart in range(min(n, MOST_APART + 1)):  # products of two modes move more slowly
                other = np.eye(n, k=apart)[:, first : first + MOST_COLUMNS]
                force = self._trilinear(own, other, own)
                largest = max(largest, np.abs(np.diag(force[first:])).max())
                found += [inplane.known(self.plate, moved) for moved in self.displacement.values()]
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
                force = membrane.force(plate, strain) * field.weights[..., None]
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
                force = membrane.force(self.plate, strain) * field.weights[..., None]
                load = loads.setdefault(parity, membrane.no_load(self.plate, q1.shape[1]))
                membrane.add_load(self.plate, field, force, load)
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
            free = membrane.free_dofs(self.plate, parity)
            self._equilibria[parity] = _Equilibrium(free, self._assembled, self.plate.solvers)
        load = membrane.summed(self.plate, load)
        equilibrium = self._equilibria[parity]
        return equilibrium.correction(load) if again else equilibrium.solve(load)


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


class _Equilibrium:
    """SNES for the in-plane displacements of all load cases of a class as one block.

    The tangent is the same for every case and every state: it is factorised once.
    """

    def __init__(
        self, free: algebra.FreeDofs, stiffness: PETSc.Mat, solvers: multigrid.Solvers
    ) -> None:
        self.free = free
        self.residual = 0.0  # of the last solution, relative to its loads
        self._matrix = free.restrict(stiffness)
        self._solver = solvers.make(free, self._matrix, "nanorom_in_plane_", "in-plane stiffness")

    def correction(self, loads: np.ndarray) -> np.ndarray:
        """Small displacements (local dofs, m) that undo what loads are left. Collective."""
        return self.free.extended(-self._solver.solve(loads[self.free.local]))

    def solve(self, loads: np.ndarray) -> np.ndarray:
        """Displacements (local dofs, m) in equilibrium with loads (local dofs, m). Collective.

        Raises SolverError if SNES does not converge.
        """
        block = loads[self.free.local]
        x = PETSc.Vec().createMPI((block.size, None), comm=self.free.comm)
        snes = PETSc.SNES().create(self.free.comm)
        snes.setOptionsPrefix("nanorom_step_")
        f = x.duplicate()
        sizes = ((block.size, None), (block.size, None))
        jacobian = PETSc.Mat().createPython(sizes, comm=self.free.comm)
        jacobian.setPythonContext(self)
        jacobian.setUp()
        self._shape = block.shape

        def function(_: PETSc.SNES, x: PETSc.Vec, f: PETSc.Vec) -> None:
            f.array[:] = block.ravel()
            if x.norm() > 0:  # not where it starts
                f.array[:] += self._product(x).ravel()

        snes.setFunction(function, f)
        snes.setJacobian(lambda *_: None, jacobian)
        solver = snes.getKSP()
        solver.setType("preonly")
        solver.getPC().setType("python")
        solver.getPC().setPythonContext(self)
        snes.setTolerances(rtol=SNES_TOLERANCE, atol=0.0, stol=0.0, max_it=5)
        options = PETSc.Options("nanorom_step_")
        if not options.hasName("snes_linesearch_type"):
            options["snes_linesearch_type"] = "basic"  # of a linear problem the whole step is right
        snes.setFromOptions()
        snes.solve(None, x)
        if snes.getConvergedReason() <= 0 and snes.getFunctionNorm() > 0:
            raise SolverError(
                f"static load cases did not converge: SNES reason {snes.getConvergedReason()} "
                f"at residual {snes.getFunctionNorm():.1e}; check the mesh for degenerate cells"
            )
        f.array[:] = block.ravel()
        self.residual = snes.getFunctionNorm() / max(f.norm(), TINY)
        return self.free.extended(x.array_r.reshape(self._shape))

    def _product(self, x: PETSc.Vec) -> np.ndarray:
        return algebra.multiply(self._matrix, x.array_r.reshape(self._shape))

    # what PETSc asks of a matrix and of a preconditioner written in Python

    def mult(self, _: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """y = A x for every load case."""
        y.array[:] = self._product(x).ravel()

    def apply(self, _: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """y = A^-1 x for every load case."""
        y.array[:] = self._solver.solve(x.array_r.reshape(self._shape)).ravel()
