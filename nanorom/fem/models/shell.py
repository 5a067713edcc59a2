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

import attrs
import numpy as np
import ufl
from dolfinx import fem

from nanorom.fem.mesh.mesh import Domain
from nanorom.fem.solvers import compat
from nanorom.fem.symmetry import Mirrors

SHEAR_FACTOR = 5 / 6
LOWEST_DEGREE = 4


@attrs.frozen
class ShellStiffness:
    """What a shell resists with, in the film's units.

    pre_tension : membrane force along x, y and z that the undeformed shell bears.
    """

    youngs_modulus: float = 1.0
    poisson_ratio: float = 0.0
    thickness: float = 1.0
    pre_tension: tuple[float, float, float] = (0.0, 0.0, 0.0)


@attrs.frozen(eq=False, kw_only=True)
class Shell:
    """Energies and load forms of a shell on a surface mesh in space. Never changed.

    domain : surface mesh (gdim 3) with cells of any order, and its tagged boundary; degree : of
    displacement and director; stiffness : what its forms are made for; space, state : displacement
    and change of the director, six components, the unknown of its static problem; directors,
    director : unit normals; deflections : space of the displacement along the undeformed director:
    with it a shell has what `quadrature` and the naming and drawing of modes ask of a film.
    """

    domain: Domain
    degree: int
    stiffness: ShellStiffness
    space: Any
    state: Any
    directors: Any
    director: Any
    deflections: Any
    mirrors: Mirrors = Mirrors()
    _constants: dict[str, Any] = attrs.field(init=False)

    @_constants.default
    def _made(self) -> dict[str, Any]:
        numbers = attrs.asdict(self.stiffness).items()
        return {name: fem.Constant(self.mesh, np.array(value)) for name, value in numbers}

    @classmethod
    def on(
        cls,
        domain: Domain,
        degree: int,
        stiffness: ShellStiffness | None = None,
        director: Callable[[np.ndarray], np.ndarray] | None = None,
    ) -> Shell:
        """The shell on a domain. Collective.

        director : unit normals (n, 3) at points (n, 3), or None for the average normal of the cells
        that meet in a node.
        """
        space = compat.lagrange_space(domain.mesh, degree, 6)
        directors = compat.lagrange_space(domain.mesh, degree, 3)
        normal = fem.Function(directors)
        if director is None:
            normal.x.array[:] = averaged_normals(domain, degree, directors).ravel()
        else:
            normals = director(directors.tabulate_dof_coordinates())
            normal.x.array[:] = np.ascontiguousarray(normals).ravel()
        return cls(
            domain=domain,
            degree=degree,
            stiffness=stiffness or ShellStiffness(),
            space=space,
            state=fem.Function(space),
            directors=directors,
            director=normal,
            deflections=compat.lagrange_space(domain.mesh, degree, 1),
        )

    @property
    def mesh(self) -> Any:
        """Of the mid-surface."""
        return self.domain.mesh

    @property
    def u(self) -> Any:
        """Displacement (UFL) of the state."""
        return split(self.state)[0]

    @property
    def delta(self) -> Any:
        """Change of the director (UFL) of the state."""
        return split(self.state)[1]

    @property
    def stretching_degree(self) -> int:
        """Quadrature degree of the modes' integrals, as of a plate."""
        return 2 * self.degree + 2

    @property
    def is_flat(self) -> bool:
        """The mid-surface lies in the plane z = 0. Collective."""
        return is_flat(self.domain)

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
        e, nu, h, tension = self._constants.values()

        def stored(a: Any) -> Any:
            return ((1 - nu) * ufl.inner(a, a) + nu * ufl.tr(a) ** 2) / (1 - nu**2)

        density = stored(membrane) + h**2 / 12 * stored(curvature) + stretch**2
        density += SHEAR_FACTOR / (2 * (1 + nu)) * ufl.inner(shear, shear)
        pre_stress = sum(tension[i] * membrane[i, i] for i in range(3))
        return (0.5 * e * h * density + pre_stress) * self.dx()

    def kinetic_energy(self, state: Any) -> Any:
        """Of a velocity, per mass per area: translation, and rotation of the directors."""
        u, delta = split(state)
        turning = self._constants["thickness"] ** 2 / 12 * ufl.inner(delta, delta)
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


def is_flat(domain: Domain) -> bool:
    """A surface lies in the plane z = 0. Collective."""
    height = np.abs(domain.mesh.geometry.x[:, 2]).max(initial=0.0)
    return domain.comm.allreduce(float(height)) == 0.0


def averaged_normals(domain: Domain, degree: int, directors: Any) -> np.ndarray:
    """Normals (n, 3) of the cells that meet in a node of a space, averaged. Collective."""
    mesh, total = domain.mesh, fem.Function(directors)
    reference = np.asarray(compat.reference_element(degree).points)
    nodes = mesh.geometry.x[compat.cell_nodes(mesh)]
    order = compat.degree_of(nodes.shape[1])
    basis = compat.reference_element(order, equispaced=True).tabulate(1, reference)
    basis = np.asarray(basis).reshape(3, len(reference), -1)
    sides = np.einsum("kqn,cnd->kcqd", basis[1:], nodes, optimize=True)
    sums = np.zeros((len(total.x.array) // 3, 3))
    n_owned = mesh.topology.index_map(2).size_local
    np.add.at(sums, compat.cell_dofs(directors)[:n_owned], np.cross(*sides)[:n_owned])
    total.x.array[:] = sums.ravel()
    compat.scatter_reverse_add(total)
    total.x.scatter_forward()
    normals = total.x.array.reshape(-1, 3)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)
