"""What a film's modes pull their edges with, out of the plane."""

from __future__ import annotations

import attrs
import numpy as np
import ufl
from dolfinx import fem
from petsc4py import PETSc

from nanorom.fem.models.operators import LinearForce
from nanorom.fem.models.plate import Plate
from nanorom.fem.modes.eigen import Modes
from nanorom.fem.solvers import algebra, compat
from nanorom.fem.symmetry import Parity


def squares(modes: Modes) -> np.ndarray:
    """int V^2 ds (L,) over all held edges, V per length of the edge and scaled. Collective.

    V = T w_n - Q_n - M_ns,s is what is left of K phi - omega^2 M phi at an edge's degrees of
    freedom, which no derivative of the shape comes near to in accuracy (Carey, Chow and Seager
    1985, doi:10.1016/0045-7825(85)90074-5); an elastic edge gives it, too, once its stiffness
    against deflection is left out of K.
    """
    plate = modes.plate
    springs = plate.stiffness.springs
    loose = {name: (None if k is None else 0.0, turn) for name, (k, turn) in springs.items()}
    natural = plate.resisting(attrs.evolve(plate.stiffness, springs=loose))
    force = LinearForce.of(natural)
    facets = np.union1d(plate.held, plate.domain.facets_of(list(springs))).astype(np.int32)
    product = _product(plate, facets)
    found = np.zeros(modes.shapes.shape[1])
    for parity in sorted(set(modes.parities)):  # collective: in one order on every rank
        own = [i for i, each in enumerate(modes.parities) if each == parity]
        free = _edge(plate, facets, parity)
        owned = modes.shapes[: modes.n_owned, own]
        left = force(parity, modes.shapes[:, own])
        left -= modes.eigenvalues[own] * algebra.multiply(modes.mass, owned)
        left = free.taken(left)
        solver = algebra.Factorization(free.restrict(product), "nanorom_edge_", "mass of the edge")
        found[own] = np.sum(left * solver.solve(left), axis=0)
        solver.reset()
    return np.asarray(plate.mirrors.copies * plate.domain.comm.allreduce(found))


def _product(plate: Plate, facets: np.ndarray) -> PETSc.Mat:
    """int v w ds over some facets, on all degrees of freedom. Collective."""
    (edge,) = compat.facet_measures(
        plate.domain.mesh, [facets], {"quadrature_degree": 2 * plate.degree}
    )
    trial, test = ufl.TrialFunction(plate.deflections), ufl.TestFunction(plate.deflections)
    return algebra.assemble(compat.form(trial * test * edge))


def _edge(plate: Plate, facets: np.ndarray, parity: Parity) -> algebra.FreeDofs:
    """Degrees of freedom on some facets that a class of symmetry lets move."""
    space = plate.deflections
    at = fem.locate_dofs_topological(space, 1, facets)
    mirrored = np.setdiff1d(plate.odd_facets(parity), plate.held).astype(np.int32)
    still = fem.locate_dofs_topological(space, 1, mirrored)
    index_map = space.dofmap.index_map
    every = np.arange(index_map.size_local + index_map.num_ghosts)
    return algebra.FreeDofs(space, np.setdiff1d(every, np.setdiff1d(at, still)))
