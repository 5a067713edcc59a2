"""The film's displacement (u, w) as one field.

The unit of displacement is such that stretching and tension have the same unit (the plate's
membrane stiffness stays 1), so a load is measured in tension x displacement / length^n.
"""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from nanorom.fem.fields import membrane
from nanorom.fem.models.gate import Attraction
from nanorom.fem.models.plate import Plate
from nanorom.fem.solvers import algebra, compat
from nanorom.fem.symmetry import Parity


@attrs.frozen(eq=False)
class Film:
    """A plate's in-plane displacement and deflection in one space of three components.

    state : the unknown of its static problems (Function); their current state are its values.
    """

    plate: Plate
    space: Any = attrs.field(init=False)
    state: Any = attrs.field(init=False)
    # the three spaces number the same nodes, each in its own order
    _node: np.ndarray = attrs.field(init=False)
    _in_plane_node: np.ndarray = attrs.field(init=False)

    @space.default
    def _three_components(self) -> Any:
        return compat.lagrange_space(self.plate.domain.mesh, self.plate.degree, components=3)

    @state.default
    def _at_rest(self) -> Any:
        return fem.Function(self.space)

    @_node.default
    def _of_deflections(self) -> np.ndarray:
        return self._nodes_in(self.plate.deflections)

    @_in_plane_node.default
    def _of_in_plane(self) -> np.ndarray:
        return self._nodes_in(self.plate.in_plane)

    def _nodes_in(self, space: Any) -> np.ndarray:
        """Local node of another space of this degree for every local node of the state."""
        found = np.empty(len(self.state.x.array) // 3, dtype=np.int64)
        found[compat.cell_dofs(self.space)] = compat.cell_dofs(space)
        return found

    @property
    def u(self) -> Any:
        """In-plane displacement (UFL)."""
        return ufl.as_vector([self.state[0], self.state[1]])

    @property
    def w(self) -> Any:
        """Deflection (UFL)."""
        return self.state[2]

    def stretching_energy(self) -> Any:
        """Energy of the displacement, tension and bending apart."""
        return self.plate.stretching_energy(self.u, self.w)

    def preload_energy(self) -> Any:
        """What is linear in the displacement: pre-stress that is not in equilibrium."""
        return self.plate.preload_energy(self.u, self.w)

    def free_dofs(self, parity: Parity) -> algebra.FreeDofs:
        """Degrees of freedom that neither supports nor mirrors hold at zero. Collective.

        A displacement has the parity of its deflection; the shape of the film is even.
        """
        plate, held = self.plate, membrane.constraints(self.plate, parity)
        node = np.empty_like(self._in_plane_node)
        node[self._in_plane_node] = np.arange(len(node))
        zero = fem.locate_dofs_topological(self.space, 1, plate.odd_facets(parity))
        fixed = [3 * node[nodes] + axis for axis, nodes in enumerate(held.fixed)]
        nodes, along = held.turned
        return algebra.FreeDofs(
            self.space, np.unique(np.concatenate([*fixed, 3 * zero + 2])), (node[nodes], along)
        )

    def embed(self, matrix: PETSc.Mat) -> PETSc.Mat:
        """A matrix of the plate's deflections as one of the film. Collective."""
        rows, columns = (s.dofmap.index_map for s in (self.plate.deflections, self.space))
        sizes = [[n * m.size_local, n * m.size_global] for n, m in ((1, rows), (3, columns))]
        inject = PETSc.Mat().createAIJ(sizes, nnz=1, comm=self.plate.domain.comm)
        owned = np.arange(columns.size_local, dtype=np.int32)
        row = rows.local_to_global(self._node[owned].astype(np.int32))
        column = 3 * columns.local_to_global(owned) + 2
        for i, j in zip(row, column):
            inject.setValue(int(i), int(j), 1.0)
        inject.assemble()
        return matrix.ptap(inject)

    def deflection(self) -> np.ndarray:
        """(local dofs,) of the deflection of the current state, numbered as the plate does."""
        w = np.empty(len(self._node))
        w[self._node] = self.state.x.array.reshape(-1, 3)[:, 2]
        return w

    def in_plane(self) -> np.ndarray:
        """(local dofs,) of the in-plane displacement of the current state, the same."""
        u = np.empty((len(self._node), 2))
        u[self._in_plane_node] = self.state.x.array.reshape(-1, 3)[:, :2]
        return u.ravel()

    def deflections_to_state(self, w: np.ndarray) -> np.ndarray:
        """(local dofs,) of a state that has a nodal vector (local plate dofs,) as deflection."""
        state = np.zeros((len(self._node), 3))
        state[:, 2] = w[self._node]
        return state.ravel()

    def deflections(self, states: np.ndarray) -> np.ndarray:
        """(local plate dofs, m) of the deflections of states (local dofs, m)."""
        w = np.empty((len(self._node), states.shape[1]))
        w[self._node] = states[2::3]
        return w

    def deflections_to_states(self, w: np.ndarray) -> np.ndarray:
        """(local dofs, m) of states with nodal vectors (local plate dofs, m) as deflections."""
        states = np.zeros((3 * len(self._node), w.shape[1]))
        states[2::3] = w[self._node]
        return states

    def about(self, attraction: Attraction | None = None) -> Plate:
        """The plate about the current state, in equilibrium with what attracts it. Collective."""
        plate, shape = self.plate, self.plate.state.shape
        u, w = fem.Function(plate.in_plane), fem.Function(plate.deflections)
        u.x.array[:], w.x.array[:] = self.in_plane(), self.deflection()
        force = plate.stretching_force(u, w)
        height = w.x.array if shape is None else w.x.array + shape.x.array
        shape = None
        if plate.domain.comm.allreduce(float(np.abs(height).max(initial=0.0)), op=MPI.MAX) > 0:
            shape = fem.Function(plate.deflections)
            shape.x.array[:] = height
        return plate.about(plate.state.moved(shape, force, attraction))
