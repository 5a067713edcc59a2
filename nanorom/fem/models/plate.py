"""Von Karman plate and membrane: one energy, everything else is its derivatives.

    Pi = int 1/2 E:C:E + N0:E + 1/2 kappa:D:kappa,
    E = sym grad u + 1/2 grad w (x) grad w + sym(grad w0 (x) grad w),   kappa = grad grad w

with the in-plane displacement u, the deflection w (PHYSICS of the paper's step I) and the initial
shape w0 (Marguerre 1938).  About a state in equilibrium (u_s, w_s) the film is the same model with
the shape w0 + w_s and the membrane force N0 + C:E(u_s, w_s), and the terms linear in (u, w)
balance the load; in a flat film under constant tension between supports they vanish.

Kirchhoff bending on Lagrange elements is made consistent and coercive by C0 interior penalty
(Engel et al. 2002, doi:10.1016/S0045-7825(02)00286-4) with the local penalty of Bringmann,
Carstensen and Streitberger (2023, doi:10.1515/jnma-2022-0117), which leaves no constant to tune.

Everything is non-dimensional: lengths in the scene's length, membrane stiffness in E h, tension
and bending stiffness in the scene's scale of tension.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import attrs
import numpy as np
import ufl
from dolfinx import fem
from ufl.geometry import FacetJacobianDeterminant

from nanorom.fem.fields.holding import Holding
from nanorom.fem.mesh.mesh import Domain
from nanorom.fem.models.added_mass import PointMass
from nanorom.fem.models.edges import Constants, Edges
from nanorom.fem.models.patchwork import Patchwork
from nanorom.fem.models.state import State, Stiffness
from nanorom.fem.solvers import compat, forms
from nanorom.fem.solvers.multigrid import Solvers
from nanorom.fem.symmetry import Mirrors, Parity, line

COERCIVITY = 2.0  # factor a > 1 of the penalty; the margin covers curved cells


def stress(strain: Any, law: Any) -> Any:
    """Tensor that a law (3, 3) gives a symmetric one: membrane force per E h, moment per D."""
    found = law * ufl.as_vector([strain[0, 0], strain[1, 1], 2 * strain[0, 1]])
    return ufl.as_matrix([[found[0], found[2]], [found[2], found[1]]])


def membrane_strain(u: Any, w: Any, shape: Any = None) -> Any:
    """Von Karman strain of in-plane displacement u and deflection w of a film of some shape."""
    slope = ufl.grad(w)
    strain = ufl.sym(ufl.grad(u)) + 0.5 * ufl.outer(slope, slope)
    return strain if shape is None else strain + ufl.sym(ufl.outer(ufl.grad(shape), slope))


@attrs.frozen(eq=False, kw_only=True)
class Plate:
    """Function spaces and energies of a plate or membrane about one state. Never changed.

    domain : the mesh and its tagged boundary; mirrors : axes at which it is cut, integrals are over
    the part that is meshed; degree : of the deflection and of the in-plane displacement; bending :
    with bending stiffness (plate) or without (membrane); held, clamped : local facets where w = 0
    and where w_n = 0; holding : where and how supports hold u; deflections, in_plane : spaces of w
    and u; w, u : functions that forms are written in, whose values belong to who assembles; edges :
    integration over them; solvers : make what solves on the degrees of freedom; stiffness, state :
    what the forms are made for; masses : added to that of the film; patchwork : what the film is
    cell by cell, by the stiffness, None where it is one.
    """

    domain: Domain
    mirrors: Mirrors
    degree: int
    bending: bool
    held: np.ndarray
    holding: Holding
    clamped: np.ndarray
    deflections: Any
    in_plane: Any
    w: Any
    u: Any
    edges: Edges
    solvers: Solvers
    stiffness: Stiffness
    state: State
    masses: Sequence[PointMass] = ()
    patchwork: Patchwork | None = None
    _constants: Constants = attrs.field(init=False)

    @_constants.default
    def _made(self) -> Constants:
        return Constants.of(self.domain.mesh, self.stiffness, self.state, self.patchwork)

    @classmethod
    def on(
        cls,
        domain: Domain,
        degree: int,
        clamped: Sequence[str] = (),
        pinned: Sequence[str] = (),
        stiffness: Stiffness | None = None,
        state: State | None = None,
        bending: bool | None = None,
        mirrors: Mirrors | None = None,
        solvers: Solvers | None = None,
        in_plane: Mapping[str, str] | None = None,
        masses: Sequence[PointMass] = (),
    ) -> Plate:
        """The plate on a domain. Collective.

        clamped, pinned : names of the boundary curves where the film is clamped or simply
        supported; on both w = 0, and u = 0.  Where the stiffness has springs u = 0, and w = 0 where
        the transverse one is None.  All other curves are free.  bending : None for that of the
        stiffness.  in_plane : names of boundary curves -> how u is held there instead: "fixed",
        "normal" (across the curve), "tangential" (along it) or "free".
        """
        mesh, stiffness = domain.mesh, stiffness or Stiffness()
        mirrors = mirrors or Mirrors()
        springs, yielding = stiffness.springs, stiffness.in_plane
        rigid = [name for name, (transverse, _) in springs.items() if transverse is None]
        deflections, plane = domain.once(
            ("spaces", degree),
            lambda: (
                compat.lagrange_space(mesh, degree),
                compat.lagrange_space(mesh, degree, components=2),
            ),
        )
        edge = domain.facets_of(list(clamped))
        kinds = dict.fromkeys([*clamped, *pinned, *springs], "fixed") | dict(in_plane or {})
        return cls(
            domain=domain,
            mirrors=mirrors,
            degree=degree,
            bending=stiffness.bending > 0 if bending is None else bending,
            held=domain.facets_of([*clamped, *pinned, *rigid]),
            holding=domain.once(
                ("holding", degree, *sorted(kinds.items()), *sorted(yielding.items())),
                lambda: Holding.of(domain, degree, plane, kinds, yielding),
            ),
            clamped=edge,
            deflections=deflections,
            in_plane=plane,
            w=fem.Function(deflections),
            u=fem.Function(plane),
            edges=Edges.of(domain, edge, mirrors, stiffness, 2 * degree),
            solvers=solvers or Solvers(),
            stiffness=stiffness,
            state=state or State(),
            masses=masses,
        )

    def about(self, state: State) -> Plate:
        """The plate about another state."""
        return attrs.evolve(self, state=state)

    def resisting(self, stiffness: Stiffness) -> Plate:
        """The plate with another stiffness, the same edges elastic."""
        return attrs.evolve(self, stiffness=stiffness)

    @property
    def uniform(self) -> bool:
        """The film obeys one equation everywhere: flat, under a constant tension, all of one."""
        return self.state.uniform and self.patchwork is None

    def law_in(self, cells: np.ndarray) -> np.ndarray:
        """Membrane force (3, 3) of (xx, yy, 2 xy), where it differs (c, 3, 3) in local cells."""
        if self.patchwork is None:
            return self.stiffness.stretching * np.array(self.stiffness.law)
        return self.stiffness.stretching * self.patchwork.law[self.patchwork.which[cells]]

    def shape_of(self, height: Callable[[np.ndarray], np.ndarray]) -> Any:
        """Deflection (Function) whose nodes (n, 2) have a height (n,)."""
        shape = fem.Function(self.deflections)
        shape.x.array[:] = height(self.deflections.tabulate_dof_coordinates()[:, :2])
        return shape

    def on_mirror(self, axis: str) -> np.ndarray:
        """Local facets on the mirror of an axis."""
        return self.domain.facets_of([line(axis)])

    def odd_facets(self, parity: Parity) -> np.ndarray:
        """Local facets on which a deflection of a parity vanishes: rigid supports, odd mirrors."""
        odd = [line(axis) for axis, p in zip(self.mirrors.axes, parity) if p]
        return np.union1d(self.held, self.domain.facets_of(odd)).astype(np.int32)

    # -- energies -------------------------------------------------------------------------------

    def dx(self, degree: int) -> Any:
        """Integration over the film, exact for polynomials of a degree on straight cells."""
        return ufl.dx(self.domain.mesh, metadata={"quadrature_degree": degree})

    @property
    def stretching_degree(self) -> int:
        """Quadrature degree for products of four slopes; beyond 2 k + 2 nothing is gained."""
        return max(2 * self.degree, min(4 * (self.degree - 1), 2 * self.degree + 2))

    def stretching_energy(self, u: Any, w: Any) -> Any:
        """1/2 int E:C:E, quadratic in u and quartic in w."""
        strain = membrane_strain(u, w, self.state.shape)
        return self._stored(strain) * self.dx(self.stretching_degree) + self._yielding(u)

    def tangent_energy(self, u: Any, w: Any) -> Any:
        """The part of the stretching energy that is quadratic in (u, w)."""
        strain = ufl.sym(ufl.grad(u))
        if self.state.shape is not None:
            strain = strain + ufl.sym(ufl.outer(ufl.grad(self.state.shape), ufl.grad(w)))
        return self._stored(strain) * self.dx(self.stretching_degree) + self._yielding(u)

    def _yielding(self, u: Any) -> Any:
        """Energy of the edges that are elastic in the plane; 0 where there are none."""
        normal, energy = ufl.FacetNormal(self.domain.mesh), 0
        for stiffness, edge in zip(self._constants.in_plane, self.edges.in_plane):
            across = ufl.dot(u, normal)
            along = u[1] * normal[0] - u[0] * normal[1]
            density = stiffness[0] * across**2 + stiffness[1] * along**2
            energy = energy + 0.5 * self._constants.stretching * density * edge
        return energy

    def attraction_energy(self, w: Any) -> Any:
        """Energy of the attraction to the gates beyond second order in w."""
        assert self.state.attraction is not None
        gate = self.state.attraction.on(self.domain.mesh)
        height = 0.0 if self.state.shape is None else self.state.shape
        rise = gate.potential(height + w) - gate.potential(height)
        density = rise - gate.pressure(height) * w - 0.5 * gate.stiffness(height) * w**2
        return -density * self.dx(self.stretching_degree)

    def tension_energy(self, w: Any) -> Any:
        """1/2 int N0:(grad w (x) grad w)."""
        x, y, xy = self._constants.tension_x, self._constants.tension_y, self._constants.shear
        density = x * w.dx(0) ** 2 + y * w.dx(1) ** 2 + 2 * xy * w.dx(0) * w.dx(1)
        energy = 0.5 * density * self.dx(2 * self.degree)
        if self.state.prestress is None:
            return energy
        slope = ufl.grad(w)
        density = ufl.inner(self.state.prestress, ufl.outer(slope, slope))
        return energy + 0.5 * density * self.dx(self.stretching_degree)

    def preload_energy(self, u: Any, w: Any) -> Any:
        """int N0:E as far as it is linear in (u, w)."""
        strain = ufl.sym(ufl.grad(u))
        if self.state.shape is not None:
            strain = strain + ufl.sym(ufl.outer(ufl.grad(self.state.shape), ufl.grad(w)))
        return ufl.inner(self.membrane_force(), strain) * self.dx(self.stretching_degree)

    def membrane_force(self) -> Any:
        """Tensor N0 of the state."""
        x, y, xy = self._constants.tension_x, self._constants.tension_y, self._constants.shear
        force = ufl.as_matrix([[x, xy], [xy, y]])
        return force if self.state.prestress is None else force + self.state.prestress

    def stretching_force(self, u: Any, w: Any) -> Any:
        """Membrane force C:E of a displacement, in the unit of the tension."""
        strain = membrane_strain(u, w, self.state.shape)
        return self._constants.stretching * stress(strain, self._constants.law)

    def _stored(self, strain: Any) -> Any:
        """1/2 E:C:E of a strain."""
        density = ufl.inner(strain, stress(strain, self._constants.law))
        return 0.5 * self._constants.stretching * density

    def bending_energy(self, w: Any) -> Any:
        """C0-interior-penalty energy of Kirchhoff bending, clamped edges included."""
        inside = ufl.dS(self.domain.mesh, metadata={"quadrature_degree": 2 * self.degree})
        slope, moment, penalty = self._slope(w), self._normal_moment(w), self._penalty()
        kink = slope("+") + slope("-")
        average = 0.5 * (moment("+") + moment("-"))
        bulk = 0.5 * ufl.inner(self._moment(w), ufl.grad(ufl.grad(w))) * self.dx(2 * self.degree)
        interior = (-average * kink + 0.5 * (penalty("+") + penalty("-")) * kink**2) * inside
        return self._constants.bending * (bulk + interior) + self._clamping(w, self.edges.clamped)

    def mirror_energy(self, w: Any, even: Sequence[Any]) -> Any:
        """Nitsche terms that hold the slope across a mirror at zero where w is even about it.

        even : `switches`, one per mirror.
        """
        terms = zip(even, self.edges.mirrors)
        return sum((switch * self._clamping(w, edge) for switch, edge in terms), 0)

    def switches(self) -> list[Any]:
        """A constant for each mirror: 1 where deflections are even about it, else 0."""
        return [fem.Constant(self.domain.mesh, 0.0) for _ in self.mirrors.axes]

    def _clamping(self, w: Any, edge: Any) -> Any:
        slope = self._slope(w)
        density = -self._normal_moment(w) * slope + 2 * self._penalty() * slope**2
        return self._constants.bending * density * edge

    def spring_energy(self, w: Any) -> Any:
        """Energy of the elastic edges; 0 where there are none."""
        energy = 0
        for stiffness, edge in zip(self._constants.springs, self.edges.elastic):
            density = stiffness[0] * w**2
            if self.bending:
                density = density + stiffness[1] * self._slope(w) ** 2
            energy = energy + 0.5 * density * edge
        return energy

    def _moment(self, w: Any) -> Any:
        """Bending moments per bending stiffness."""
        return stress(ufl.grad(ufl.grad(w)), self._constants.bending_law)

    def _normal_moment(self, w: Any) -> Any:
        normal = ufl.FacetNormal(self.domain.mesh)
        return ufl.dot(normal, ufl.dot(self._moment(w), normal))

    def _slope(self, w: Any) -> Any:
        return ufl.dot(ufl.grad(w), ufl.FacetNormal(self.domain.mesh))

    def _penalty(self) -> Any:
        """3 a k (k - 1) / 8 per side of an interior facet, times h_E/|T| = 2 |J_E|/|J_T|.

        A boundary facet takes four times that.
        """
        mesh = self.domain.mesh
        facet_by_area = FacetJacobianDeterminant(mesh) / abs(ufl.JacobianDeterminant(mesh))
        factor = COERCIVITY * 0.75 * self.degree * (self.degree - 1)
        return factor * self._constants.stiffest * facet_by_area

    def linear_energy(self, w: Any) -> Any:
        """Energy of tension, bending and springs about an equilibrium, quadratic in w."""
        energy = self.tension_energy(w)
        if self.bending:
            energy = energy + self.bending_energy(w)
        if self.stiffness.springs:
            energy = energy + self.spring_energy(w)
        if self.state.attraction is not None:
            gate = self.state.attraction.on(self.domain.mesh)
            softening = gate.stiffness(0.0 if self.state.shape is None else self.state.shape)
            energy = energy - 0.5 * softening * w**2 * self.dx(self.stretching_degree)
        return energy

    # -- their derivatives ----------------------------------------------------------------------

    def compiled(self, write: Callable[..., Any], switches: Sequence[Any] = ()) -> Any:
        """Form that one of the plate's own methods writes, ready to be assembled. Collective.

        switches : what the method takes.
        """
        if not self.uniform:
            return compat.form(write(*switches))
        mesh = self.domain.mesh
        element = self.degree, compat.cell_nodes(mesh).shape[1], mesh.geometry.dim
        elastic = len(self.edges.elastic), len(self.edges.in_plane)
        kind = write.__name__, *element, self.bending, self.mirrors.axes, *elastic
        return forms.compiled(kind, lambda: write(*switches), self.operands(switches))

    def operands(self, switches: Sequence[Any] = ()) -> forms.Operands:
        """What the plate's forms are about."""
        return forms.Operands(
            [self.deflections, self.in_plane],
            [self.w, self.u],
            [*self._constants.all, *switches],
            self.edges.clamped.subdomain_data(),
        )

    def stiffness_form(self) -> Any:
        """Transverse stiffness K: second derivative of the linear energy."""
        first = ufl.derivative(self.linear_energy(self.w), self.w)
        return ufl.derivative(first, self.w)

    def mirror_form(self, *even: Any) -> Any:
        """Second derivative of the mirrors' energy."""
        first = ufl.derivative(self.mirror_energy(self.w, even), self.w)
        return ufl.derivative(first, self.w)

    def linear_force_form(self, *even: Any) -> Any:
        """Force of the linear energy and of the mirrors on the deflection `w`."""
        energy = self.linear_energy(self.w)
        if self.bending:
            energy = energy + self.mirror_energy(self.w, even)
        return ufl.derivative(energy, self.w)

    def mass_form(self) -> Any:
        """Transverse mass per rho h."""
        trial, test = ufl.TrialFunction(self.deflections), ufl.TestFunction(self.deflections)
        density = self._constants.density
        product = trial * test if density is None else density * trial * test
        return product * self.dx(2 * self.degree)

    def in_plane_form(self) -> Any:
        """In-plane stiffness: second derivative of the stretching energy in u, whatever w."""
        energy = self.stretching_energy(self.u, self.w)
        return ufl.derivative(ufl.derivative(energy, self.u), self.u)

    def plane_spring_form(self) -> Any:
        """The part of that which elastic edges have."""
        return ufl.derivative(ufl.derivative(self._yielding(self.u), self.u), self.u)

    def curvature_form(self, w: Any) -> Any:
        """2 D int kappa:kappa |grad w|^2, the cubic coefficient of bending without stretching."""
        slope = ufl.grad(w)
        density = ufl.inner(self._moment(w), ufl.grad(ufl.grad(w))) * ufl.inner(slope, slope)
        return 2 * self._constants.bending * density * self.dx(self.stretching_degree)
