"""Geometrically exact shell: mid-surface and director, one energy, rotations of any size.

The state is the displacement u of the mid-surface and the change delta of its director,

    phi = X + u,   d = D + delta,   F = grad phi,   P = grad X = I - N (x) N,
    E = 1/2 (F^T F - P),   K = sym(F^T grad d - P grad D),   gamma = F^T d - P D,
    Pi = int 1/2 [ E:C:E + h^2/12 K:C:K + 5/6 G h |gamma|^2 + E h (1/2 (d.d - D.D))^2 ],

with surface gradients and C the plane-stress stiffness of a St. Venant-Kirchhoff material (Simo and
Fox 1989, doi:10.1016/0045-7825(89)90002-9).  The director has three components instead of two
angles: its length is held by the last term (a thickness strain, Buechter and Ramm 1992), so that
no parametrisation of rotations can become singular and the energy is a polynomial of degree four.
Terms of the order (thickness x curvature)^2 are neglected, as in every such theory.  Locking is
overcome by degree: displacement and director are of the same degree, four or more.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import ufl
from dolfinx import fem

from nanorom.fem.mesh.mesh import Domain
from nanorom.fem.solvers import compat
from nanorom.fem.symmetry import Mirrors

SHEAR_FACTOR = 5 / 6
LOWEST_DEGREE = 4


class Shell:
    """Energies and load forms of a shell on a surface mesh in space.

    Parameters
    ----------
    domain : surface mesh (gdim 3) with cells of any order, and its tagged boundary.
    degree : of displacement and director.
    director : unit normals (n, 3) at points (n, 3), or None for the average normal of the cells
        that meet in a node.

    Attributes
    ----------
    state : displacement and change of the director, six components.
    deflections : space of the displacement along the undeformed director; with it a shell has what
        `quadrature` and the naming and drawing of modes ask of a film.
    pre_tension : membrane force along x, y and z that the undeformed shell bears.
    """

    mirrors = Mirrors()

    def __init__(
        self,
        domain: Domain,
        degree: int,
        director: Callable[[np.ndarray], np.ndarray] | None = None,
    ) -> None:
        self.domain = domain
        self.mesh = mesh = domain.mesh
        self.degree = degree
        self.space = compat.lagrange_space(mesh, degree, 6)
        self.state = fem.Function(self.space)
        self.u, self.delta = split(self.state)
        self.directors = compat.lagrange_space(mesh, degree, 3)
        self.director = fem.Function(self.directors)
        x = self.directors.tabulate_dof_coordinates()
        normals = director(x) if director is not None else self._averaged_normals()
        self.director.x.array[:] = np.ascontiguousarray(normals).ravel()
        self.youngs_modulus = fem.Constant(mesh, 1.0)
        self.nu = fem.Constant(mesh, 0.0)
        self.thickness = fem.Constant(mesh, 1.0)
        self.pre_tension = fem.Constant(mesh, np.zeros(3))
        self.deflections = compat.lagrange_space(mesh, degree, 1)

    @property
    def stretching_degree(self) -> int:
        """Quadrature degree of the modes' integrals, as of a plate."""
        return 2 * self.degree + 2

    @property
    def is_flat(self) -> bool:
        """The mid-surface lies in the plane z = 0. Collective."""
        height = np.abs(self.mesh.geometry.x[:, 2]).max(initial=0.0)
        return self.domain.comm.allreduce(float(height)) == 0.0

    def nodes_in(self, space: Any) -> np.ndarray:
        """Local node of another space of this degree for every local node of the state."""
        found = np.empty(len(self.state.x.array) // 6, dtype=np.int64)
        found[compat.cell_dofs(self.space)] = compat.cell_dofs(space)
        return found

    def normals(self) -> np.ndarray:
        """Directors (n, 3) at the nodes of the state."""
        return self.director.x.array.reshape(-1, 3)[self.nodes_in(self.directors)]

    def normal_displacement(self, states: np.ndarray) -> np.ndarray:
        """(local dofs, m) of the deflections of states (local dofs, m)."""
        u = states.reshape(len(states) // 6, 6, states.shape[1])[:, :3]  # a rank may have none
        w = np.empty((len(u), u.shape[2]))
        w[self.nodes_in(self.deflections)] = np.einsum("ni,nim->nm", self.normals(), u)
        return w

    def held(self, clamped: list[str], pinned: list[str]) -> np.ndarray:
        """Degrees of freedom (unrolled) at supports: all that is clamped, u of what is pinned."""
        fixed = [np.empty(0, dtype=np.int32)]
        for names, components in ((clamped, 6), (pinned, 3)):
            facets = self.domain.facets_of(names)
            nodes = fem.locate_dofs_topological(self.space, 1, facets)
            fixed.append((6 * nodes[:, None] + np.arange(components)).ravel())
        return np.unique(np.concatenate(fixed))

    def _averaged_normals(self) -> np.ndarray:
        """Normals of the cells that meet in a node, averaged. Collective."""
        reference = np.asarray(compat.reference_element(self.degree).points)
        nodes = self.mesh.geometry.x[compat.cell_nodes(self.mesh)]
        order = compat.degree_of(nodes.shape[1])
        basis = compat.reference_element(order, equispaced=True).tabulate(1, reference)
        basis = np.asarray(basis).reshape(3, len(reference), -1)
        sides = np.einsum("kqn,cnd->kcqd", basis[1:], nodes, optimize=True)
        total = np.zeros((len(self.director.x.array) // 3, 3))
        n_owned = self.mesh.topology.index_map(2).size_local
        np.add.at(total, compat.cell_dofs(self.directors)[:n_owned], np.cross(*sides)[:n_owned])
        self.director.x.array[:] = total.ravel()
        compat.scatter_reverse_add(self.director)
        self.director.x.scatter_forward()
        total = self.director.x.array.reshape(-1, 3)
        return total / np.linalg.norm(total, axis=1, keepdims=True)

    # -- kinematics -----------------------------------------------------------------------------

    def strains(self, u: Any, delta: Any) -> tuple[Any, Any, Any, Any]:
        """Membrane strain, curvature change, transverse shear and thickness strain."""
        # not grad(x), which UFL takes for the identity of space
        placement = ufl.Jacobian(self.mesh) * ufl.JacobianInverse(self.mesh)
        director = self.director
        deformed = placement + ufl.grad(u)
        turned = ufl.grad(director) + ufl.grad(delta)
        membrane = 0.5 * (deformed.T * deformed - placement.T * placement)
        curvature = ufl.sym(deformed.T * turned - placement.T * ufl.grad(director))
        shear = deformed.T * (director + delta) - placement.T * director
        stretch = ufl.inner(delta, director) + 0.5 * ufl.inner(delta, delta)
        return membrane, curvature, shear, stretch

    def energy(self, state: Any = None) -> Any:
        """Elastic energy of a state (the shell's own by default)."""
        u, delta = split(self.state if state is None else state)
        membrane, curvature, shear, stretch = self.strains(u, delta)
        e, nu, h = self.youngs_modulus, self.nu, self.thickness

        def stored(a: Any) -> Any:
            return ((1 - nu) * ufl.inner(a, a) + nu * ufl.tr(a) ** 2) / (1 - nu**2)

        density = stored(membrane) + h**2 / 12 * stored(curvature) + stretch**2
        density += SHEAR_FACTOR / (2 * (1 + nu)) * ufl.inner(shear, shear)
        pre_stress = sum(self.pre_tension[i] * membrane[i, i] for i in range(3))
        return (0.5 * e * h * density + pre_stress) * self.dx()

    def kinetic_energy(self, state: Any) -> Any:
        """Of a velocity, per mass per area: translation, and rotation of the directors."""
        u, delta = split(state)
        turning = self.thickness**2 / 12 * ufl.inner(delta, delta)
        return 0.5 * (ufl.inner(u, u) + turning) * self.dx()

    def unit_tension_energy(self, state: Any) -> Any:
        """Work of a membrane force of 1 in every direction."""
        membrane = self.strains(*split(state))[0]
        return ufl.tr(membrane) * self.dx()

    def follower_pressure(self) -> Any:
        """Load form of a unit pressure along the normal of the deformed mid-surface.

        n da = (g_1 x g_2) dxi with the deformed base vectors g; without a potential where an edge
        is free, so the problem is not symmetric there.
        """
        jacobian = ufl.Jacobian(self.mesh)
        moved = jacobian + ufl.grad(self.u) * jacobian
        before = ufl.cross(jacobian[:, 0], jacobian[:, 1])
        area = ufl.cross(moved[:, 0], moved[:, 1]) / ufl.sqrt(ufl.dot(before, before))
        test = ufl.TestFunction(self.space)
        return sum(area[i] * test[i] for i in range(3)) * self.dx()

    def dx(self) -> Any:
        """Integration over the mid-surface; more points than that gain nothing."""
        return ufl.dx(self.mesh, metadata={"quadrature_degree": 2 * self.degree + 2})


def split(state: Any) -> tuple[Any, Any]:
    """Displacement and change of director of a state."""
    return (
        ufl.as_vector([state[i] for i in range(3)]),
        ufl.as_vector([state[i] for i in range(3, 6)]),
    )
