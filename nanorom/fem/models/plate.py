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

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from ufl.geometry import FacetJacobianDeterminant

from nanorom.fem.fields import holding
from nanorom.fem.mesh.mesh import Domain
from nanorom.fem.models.gate import Attraction
from nanorom.fem.solvers import compat, forms
from nanorom.fem.solvers.multigrid import Solvers
from nanorom.fem.symmetry import Mirrors, Parity, line

COERCIVITY = 2.0  # factor a > 1 of the penalty; the margin covers curved cells


def membrane_stress(strain: Any, nu: Any) -> Any:
    """Membrane force C:E per E h of an isotropic film in plane stress."""
    return ((1 - nu) * strain + nu * ufl.tr(strain) * ufl.Identity(2)) / (1 - nu**2)


def membrane_strain(u: Any, w: Any, shape: Any = None) -> Any:
    """Von Karman strain of in-plane displacement u and deflection w of a film of some shape."""
    slope = ufl.grad(w)
    strain = ufl.sym(ufl.grad(u)) + 0.5 * ufl.outer(slope, slope)
    return strain if shape is None else strain + ufl.sym(ufl.outer(ufl.grad(shape), slope))


class Plate:
    """Function spaces and energies of a plate or membrane on a domain.

    Parameters
    ----------
    domain : the mesh and its tagged boundary.
    degree : of the deflection and of the in-plane displacement.
    clamped, pinned : names of the boundary curves where the film is clamped or simply supported;
        on both w = 0, and u = 0.
    springs : names of boundary curves -> transverse and rotational stiffness per length; there
        w = 0 where the transverse one is None, and u = 0.  All other curves are free.
    in_plane : names of boundary curves -> how u is held there instead: "fixed", "normal" (across
        the curve), "tangential" (along it), "free", or normal and tangential stiffness per length.
    bending : with bending stiffness (plate) or without (membrane).
    mirrors : axes at which the domain is cut; integrals are over the part that is meshed.

    Attributes
    ----------
    shape : initial deflection w0 (UFL or Function), None where the film is flat.
    prestress : membrane force (UFL tensor) in addition to the tension, None where there is none.
    operands : what its forms are about.
    solvers : make what solves on its degrees of freedom.
    attraction : to a gate, None where there is none.
    even : by mirror, 1 where deflections are even about it, else 0 (`set_parity`).
    """

    def __init__(
        self,
        domain: Domain,
        degree: int,
        clamped: list[str],
        pinned: list[str],
        bending: bool,
        mirrors: Mirrors | None = None,
        springs: Mapping[str, tuple[float | None, float]] | None = None,
        in_plane: Mapping[str, str | tuple[float, float]] | None = None,
    ) -> None:
        mesh = domain.mesh
        self.domain = domain
        self.mirrors = mirrors or Mirrors()
        self.degree = degree
        self.bending = bending
        springs = springs or {}
        rigid = [name for name, (transverse, _) in springs.items() if transverse is None]
        self.held = domain.facets_of([*clamped, *pinned, *rigid])
        kinds = dict.fromkeys([*clamped, *pinned, *springs], "fixed") | dict(in_plane or {})
        self.edges_in_plane = {
            kind: domain.facets_of([name for name, own in kinds.items() if own == kind])
            for kind in ("fixed", "normal", "tangential")
        }
        elastic = {name: own for name, own in kinds.items() if not isinstance(own, str)}
        self.clamped = domain.facets_of(clamped)
        self.deflections = compat.lagrange_space(mesh, degree)
        self.in_plane = compat.lagrange_space(mesh, degree, components=2)
        self.w = fem.Function(self.deflections)
        self.u = fem.Function(self.in_plane)
        self.tension_x = fem.Constant(mesh, 1.0)
        self.tension_y = fem.Constant(mesh, 1.0)
        self.tension_xy = fem.Constant(mesh, 0.0)
        self.bending_stiffness = fem.Constant(mesh, 0.0)
        self.nu = fem.Constant(mesh, 0.0)
        self.membrane_stiffness = fem.Constant(mesh, 1.0)
        self.springs = [
            (domain.facets_of([name]), fem.Constant(mesh, np.array([k or 0.0, turning])))
            for name, (k, turning) in springs.items()
        ]
        self.plane_springs = [
            (domain.facets_of([name]), fem.Constant(mesh, np.array(stiffness)))
            for name, stiffness in elastic.items()
        ]
        self.held_in_plane = holding.directions(self, self.in_plane, self.edges_in_plane)
        self.elastic_in_plane = np.zeros_like(self.held_in_plane)
        for facets, stiffness in self.plane_springs:
            some = zip(("normal", "tangential"), stiffness.value)
            self.elastic_in_plane += holding.directions(
                self, self.in_plane, {kind: facets for kind, value in some if value > 0}
            )
        self.even = {axis: fem.Constant(mesh, 0.0) for axis in self.mirrors.axes}
        groups = [self.clamped, *map(self.on_mirror, self.even)]
        groups += [facets for facets, _ in self.springs]
        self._clamped_edge, *others = compat.facet_measures(
            mesh,
            groups,
            {"quadrature_degree": 2 * degree},
            [facets for facets, _ in self.plane_springs],
        )
        self._mirror_edges = others[: len(self.even)]
        self._elastic_edges = others[len(self.even) : len(self.even) + len(self.springs)]
        self._plane_edges = others[len(self.even) + len(self.springs) :]
        constants = [self.tension_x, self.tension_y, self.tension_xy, self.nu]
        constants += [self.bending_stiffness, self.membrane_stiffness, *self.even.values()]
        self.operands = forms.Operands(
            [self.deflections, self.in_plane],
            [self.w, self.u],
            [*constants, *(stiffness for _, stiffness in (*self.springs, *self.plane_springs))],
            self._clamped_edge.subdomain_data(),
        )
        self.solvers = Solvers()
        self.shape: Any = None
        self.prestress: Any = None
        self.attraction: Attraction | None = None

    def on_mirror(self, axis: str) -> np.ndarray:
        """Local facets on the mirror of an axis."""
        return self.domain.facets_of([line(axis)])

    @property
    def elastic(self) -> bool:
        """Some edges are held elastically in the plane."""
        return bool(self.plane_springs)

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
        strain = membrane_strain(u, w, self.shape)
        density = ufl.inner(strain, membrane_stress(strain, self.nu))
        energy = 0.5 * self.membrane_stiffness * density * self.dx(self.stretching_degree)
        return energy + self.plane_spring_energy(u) if self.elastic else energy

    def tangent_energy(self, u: Any, w: Any) -> Any:
        """The part of the stretching energy that is quadratic in (u, w)."""
        strain = ufl.sym(ufl.grad(u))
        if self.shape is not None:
            strain = strain + ufl.sym(ufl.outer(ufl.grad(self.shape), ufl.grad(w)))
        density = ufl.inner(strain, membrane_stress(strain, self.nu))
        energy = 0.5 * self.membrane_stiffness * density * self.dx(self.stretching_degree)
        return energy + self.plane_spring_energy(u) if self.elastic else energy

    def plane_spring_energy(self, u: Any) -> Any:
        """Energy of the edges that are elastic in the plane, per length in E h."""
        normal, energy = ufl.FacetNormal(self.domain.mesh), 0
        for (_, stiffness), edge in zip(self.plane_springs, self._plane_edges):
            across = ufl.dot(u, normal)
            along = u[1] * normal[0] - u[0] * normal[1]
            density = stiffness[0] * across**2 + stiffness[1] * along**2
            energy = energy + 0.5 * self.membrane_stiffness * density * edge
        return energy

    def attraction_energy(self, w: Any) -> Any:
        """Energy of the attraction to the gate beyond second order in w."""
        assert self.attraction is not None
        gate = self.attraction.on(self.domain.mesh)
        height = 0.0 if self.shape is None else self.shape
        rise = gate.potential(height + w) - gate.potential(height)
        first = 0.5 * gate.strength / (gate.gap - height) ** 2
        density = rise - first * w - 0.5 * gate.stiffness(height) * w**2
        return -density * self.dx(self.stretching_degree)

    def tension_energy(self, w: Any) -> Any:
        """1/2 int N0:(grad w (x) grad w)."""
        density = self.tension_x * w.dx(0) ** 2 + self.tension_y * w.dx(1) ** 2
        density = density + 2 * self.tension_xy * w.dx(0) * w.dx(1)
        energy = 0.5 * density * self.dx(2 * self.degree)
        if self.prestress is None:
            return energy
        slope = ufl.grad(w)
        density = ufl.inner(self.prestress, ufl.outer(slope, slope))
        return energy + 0.5 * density * self.dx(self.stretching_degree)

    def preload_energy(self, u: Any, w: Any) -> Any:
        """int N0:E as far as it is linear in (u, w)."""
        force = ufl.as_matrix(
            [[self.tension_x, self.tension_xy], [self.tension_xy, self.tension_y]]
        )
        strain = ufl.sym(ufl.grad(u))
        if self.prestress is not None:
            force = force + self.prestress
        if self.shape is not None:
            strain = strain + ufl.sym(ufl.outer(ufl.grad(self.shape), ufl.grad(w)))
        return ufl.inner(force, strain) * self.dx(self.stretching_degree)

    def stretching_force(self, u: Any, w: Any) -> Any:
        """Membrane force C:E of a displacement, in the unit of the tension."""
        strain = membrane_strain(u, w, self.shape)
        return self.membrane_stiffness * membrane_stress(strain, self.nu)

    def bending_energy(self, w: Any) -> Any:
        """C0-interior-penalty energy of Kirchhoff bending, clamped edges included."""
        inside = ufl.dS(self.domain.mesh, metadata={"quadrature_degree": 2 * self.degree})
        slope, moment, penalty = self._slope(w), self._normal_moment(w), self._penalty()
        kink = slope("+") + slope("-")
        average = 0.5 * (moment("+") + moment("-"))
        bulk = 0.5 * ufl.inner(self._moment(w), ufl.grad(ufl.grad(w))) * self.dx(2 * self.degree)
        interior = (-average * kink + 0.5 * (penalty("+") + penalty("-")) * kink**2) * inside
        return self.bending_stiffness * (bulk + interior) + self._clamping(w, self._clamped_edge)

    def mirror_energy(self, w: Any) -> Any:
        """Nitsche terms that hold the slope across a mirror at zero where w is even about it."""
        terms = zip(self.even.values(), self._mirror_edges)
        return sum((even * self._clamping(w, edge) for even, edge in terms), 0)

    def _clamping(self, w: Any, edge: Any) -> Any:
        slope = self._slope(w)
        density = -self._normal_moment(w) * slope + 2 * self._penalty() * slope**2
        return self.bending_stiffness * density * edge

    def spring_energy(self, w: Any) -> Any:
        """Energy of the elastic edges; 0 where there are none."""
        energy = 0
        for (_, stiffness), edge in zip(self.springs, self._elastic_edges):
            density = stiffness[0] * w**2
            if self.bending:
                density = density + stiffness[1] * self._slope(w) ** 2
            energy = energy + 0.5 * density * edge
        return energy

    def _moment(self, w: Any) -> Any:
        """Bending moments per bending stiffness."""
        curvature = ufl.grad(ufl.grad(w))
        return (1 - self.nu) * curvature + self.nu * ufl.tr(curvature) * ufl.Identity(2)

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
        return COERCIVITY * 0.75 * self.degree * (self.degree - 1) * facet_by_area

    def linear_energy(self, w: Any) -> Any:
        """Energy of tension, bending and springs about an equilibrium, quadratic in w."""
        energy = self.tension_energy(w)
        if self.bending:
            energy = energy + self.bending_energy(w)
        if self.springs:
            energy = energy + self.spring_energy(w)
        if self.attraction is not None:
            gate = self.attraction.on(self.domain.mesh)
            softening = gate.stiffness(0.0 if self.shape is None else self.shape)
            energy = energy - 0.5 * softening * w**2 * self.dx(self.stretching_degree)
        return energy

    # -- their derivatives ----------------------------------------------------------------------

    def compiled(self, write: Callable[[], Any]) -> Any:
        """Form that one of the plate's own methods writes, ready to be assembled. Collective."""
        if self.shape is not None or self.prestress is not None or self.attraction is not None:
            return compat.form(write())
        mesh = self.domain.mesh
        element = self.degree, compat.cell_nodes(mesh).shape[1], mesh.geometry.dim
        edges = self.mirrors.axes, len(self.springs), len(self.plane_springs)
        return forms.compiled(
            (write.__name__, *element, self.bending, *edges), write, self.operands
        )

    def stiffness_form(self) -> Any:
        """Transverse stiffness K: second derivative of the linear energy."""
        first = ufl.derivative(self.linear_energy(self.w), self.w)
        return ufl.derivative(first, self.w)

    def mirror_form(self) -> Any:
        """Second derivative of the mirrors' energy."""
        first = ufl.derivative(self.mirror_energy(self.w), self.w)
        return ufl.derivative(first, self.w)

    def set_parity(self, parity: Parity) -> None:
        """Take deflections of one class of symmetry."""
        for even, odd in zip(self.even.values(), parity):
            even.value = 1.0 - odd

    def linear_force_form(self) -> Any:
        """Force of the linear energy and of the mirrors on the deflection `w`."""
        energy = self.linear_energy(self.w)
        if self.bending:
            energy = energy + self.mirror_energy(self.w)
        return ufl.derivative(energy, self.w)

    def mass_form(self) -> Any:
        """Transverse mass per rho h."""
        trial, test = ufl.TrialFunction(self.deflections), ufl.TestFunction(self.deflections)
        return trial * test * self.dx(2 * self.degree)

    def in_plane_form(self) -> Any:
        """In-plane stiffness: second derivative of the stretching energy in u, whatever w."""
        energy = self.stretching_energy(self.u, self.w)
        return ufl.derivative(ufl.derivative(energy, self.u), self.u)

    def plane_spring_form(self) -> Any:
        """The part of that which elastic edges have."""
        energy = self.plane_spring_energy(self.u)
        return ufl.derivative(ufl.derivative(energy, self.u), self.u)

    def curvature_form(self) -> Any:
        """2 D int kappa:kappa |grad w|^2, the cubic coefficient of bending without stretching."""
        slope, w = ufl.grad(self.w), self.w
        density = ufl.inner(self._moment(w), ufl.grad(ufl.grad(w))) * ufl.inner(slope, slope)
        return 2 * self.bending_stiffness * density * self.dx(self.stretching_degree)

    def tension_tensor(self) -> np.ndarray:
        """(2, 2) of the constant tension."""
        x, y, xy = (float(t.value) for t in (self.tension_x, self.tension_y, self.tension_xy))
        return np.array([[x, xy], [xy, y]])
