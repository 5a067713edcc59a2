"""The tensioned drum in bare DOLFINx: plain loops of assemble and solve.

What a competent user writes from the tutorials: gmsh's mesh, C0 interior penalty with a textbook
constant, SLEPc, one assembled right-hand side and one back-substitution per pair of modes, one
assembled vector per entry of the tensor.  Nothing of nanorom's finite-element half is used but the
shims that hide DOLFINx's versions.
"""

from __future__ import annotations

from typing import Any

import dolfinx
import numpy as np
import ufl
from dolfinx import fem
from dolfinx.fem import petsc
from mpi4py import MPI
from petsc4py import PETSc
from slepc4py import SLEPc

from nanorom.exact import polar
from nanorom.fem.mesh import vetting
from nanorom.fem.solvers import compat
from nanorom.types import Array

PENALTY = 8.0  # times k (k - 1)/h, as in the tutorials on the biharmonic equation


def solve(
    kappa: float,
    nu: float,
    diameters: list[int],
    count: int,
    degree: int,
    size: float,
    order: int,
) -> tuple[int, Array, Array]:
    """Dofs, omega R^2 sqrt(rho h/D) (L,) and the tensor (L, L, L, L) in E h/R^2.

    diameters: nodal diameters of the modes in order, the last pair whole; order: of the cells' map.
    """
    mesh = disc(size, order)
    space = compat.lagrange_space(mesh, degree)
    mesh.topology.create_connectivity(1, 2)
    edge = dolfinx.mesh.exterior_facet_indices(mesh.topology)
    omega, shapes = _modes(space, edge, kappa, nu, degree, len(diameters))
    mixing = polar.unique(diameters, lambda points: _evaluate(mesh, shapes, points))
    values = np.column_stack([shape.x.array for shape in shapes]) @ mixing
    for shape, column in zip(shapes, values.T):
        shape.x.array[:] = column
    dofs = space.dofmap.index_map.size_global
    tensor = _tensor(mesh, edge, shapes[:count], nu, degree)
    compat.free_memory(MPI.COMM_SELF, mesh.comm)
    return dofs, omega[:count], tensor


def disc(size: float, order: int) -> Any:
    """Unit disc from gmsh, its cells of the order that gmsh gives them."""
    gmsh = vetting.gmsh()

    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    circle = gmsh.model.occ.addDisk(0, 0, 0, 1, 1)
    gmsh.model.occ.synchronize()
    gmsh.model.addPhysicalGroup(2, [circle], 1)
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.option.setNumber("Mesh.MeshSizeMin", size)
    gmsh.model.mesh.generate(2)
    gmsh.model.mesh.setOrder(order)
    mesh = compat.mesh_from_gmsh(MPI.COMM_SELF)
    gmsh.finalize()
    return mesh


def _modes(
    space: Any, edge: Array, kappa: float, nu: float, degree: int, count: int
) -> tuple[Array, list[Any]]:
    """Frequencies and the lowest modes."""
    mesh = space.mesh
    w, v = ufl.TrialFunction(space), ufl.TestFunction(space)
    n, h = ufl.FacetNormal(mesh), 2 * ufl.Circumradius(mesh)
    if mesh.geometry.cmap.degree > 1:
        h = ufl.sqrt(abs(ufl.JacobianDeterminant(mesh)))
    dx = ufl.dx(metadata={"quadrature_degree": 2 * degree})
    inside = ufl.dS(metadata={"quadrature_degree": 2 * degree})
    outside = ufl.ds(metadata={"quadrature_degree": 2 * degree})

    def moment(f: Any) -> Any:
        hesse = ufl.grad(ufl.grad(f))
        return (1 - nu) * hesse + nu * ufl.tr(hesse) * ufl.Identity(2)

    def normal_moment(f: Any) -> Any:
        return ufl.dot(n, ufl.dot(moment(f), n))

    def slope(f: Any) -> Any:
        return ufl.dot(ufl.grad(f), n)

    penalty = PENALTY * degree * (degree - 1) / h
    k = ufl.inner(moment(w), ufl.grad(ufl.grad(v))) * dx
    k += kappa * ufl.dot(ufl.grad(w), ufl.grad(v)) * dx
    jump_w, jump_v = slope(w)("+") + slope(w)("-"), slope(v)("+") + slope(v)("-")
    k += ufl.avg(penalty) * jump_w * jump_v * inside
    k -= ufl.avg(normal_moment(w)) * jump_v * inside + ufl.avg(normal_moment(v)) * jump_w * inside
    k += (penalty * slope(w) * slope(v)) * outside
    k -= (normal_moment(w) * slope(v) + normal_moment(v) * slope(w)) * outside
    fixed = fem.locate_dofs_topological(space, 1, edge)
    bc = fem.dirichletbc(0.0, fixed, space)
    stiffness = petsc.assemble_matrix(fem.form(k), bcs=[bc])
    stiffness.assemble()
    mass = petsc.assemble_matrix(fem.form(w * v * dx), [bc], 0.0)  # zero on its diagonal there
    mass.assemble()
    solver = SLEPc.EPS().create(mesh.comm)
    solver.setOperators(stiffness, mass)
    solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
    solver.setDimensions(count)
    solver.setTarget(0.0)
    transform = solver.getST()
    transform.setType("sinvert")
    _use_mumps(transform.getKSP())
    solver.setTolerances(1e-12)
    solver.solve()
    shapes, values = [], []
    vector = stiffness.createVecRight()
    for i in range(count):
        values.append(solver.getEigenpair(i, vector).real)
        shape = fem.Function(space)
        shape.x.array[:] = vector.array
        shapes.append(shape)
    return np.sqrt(values), shapes


def _use_mumps(solver: Any) -> None:
    solver.setType("preonly")
    solver.getPC().setType("cholesky")
    solver.getPC().setFactorSolverType("mumps")


def _tensor(mesh: Any, edge: Array, shapes: list[Any], nu: float, degree: int) -> Array:
    """Symmetric tensor by one static problem per pair and one assembled vector per triple."""
    plane = compat.lagrange_space(mesh, degree, components=2)
    u, v = ufl.TrialFunction(plane), ufl.TestFunction(plane)
    dx = ufl.dx(metadata={"quadrature_degree": 3 * degree})

    def stress(strain: Any) -> Any:
        return ((1 - nu) * strain + nu * ufl.tr(strain) * ufl.Identity(2)) / (1 - nu**2)

    zero = fem.Function(plane)
    bc = fem.dirichletbc(zero, fem.locate_dofs_topological(plane, 1, edge))
    energy = ufl.inner(stress(ufl.sym(ufl.grad(u))), ufl.sym(ufl.grad(v))) * dx
    matrix = petsc.assemble_matrix(fem.form(energy), bcs=[bc])
    matrix.assemble()
    solver = PETSc.KSP().create(mesh.comm)
    solver.setOperators(matrix)
    _use_mumps(solver)
    space = shapes[0].function_space
    first, second, third = (fem.Function(space) for _ in range(3))
    displacement = fem.Function(plane)
    strain = ufl.sym(ufl.outer(ufl.grad(first), ufl.grad(second)))
    load = fem.form(-ufl.inner(stress(strain), ufl.sym(ufl.grad(v))) * dx)
    force = stress(ufl.sym(ufl.grad(displacement)) + strain)
    test = ufl.TestFunction(space)
    reaction = fem.form(0.5 * ufl.inner(force, ufl.outer(ufl.grad(third), ufl.grad(test))) * dx)
    count = len(shapes)
    basis = np.column_stack([shape.x.array for shape in shapes])
    tensor = np.zeros((count,) * 4)
    x = matrix.createVecRight()
    for j in range(count):
        first.x.array[:] = shapes[j].x.array
        for k in range(j, count):
            second.x.array[:] = shapes[k].x.array
            right = petsc.assemble_vector(load)
            petsc.set_bc(right, [bc])
            solver.solve(right, x)
            displacement.x.array[:] = x.array
            for l in range(count):
                third.x.array[:] = shapes[l].x.array
                vector = petsc.assemble_vector(reaction)
                tensor[:, l, j, k] = tensor[:, l, k, j] = basis.T @ vector.array
    swapped = tensor.transpose(0, 2, 1, 3) + tensor.transpose(0, 3, 2, 1)
    return (tensor + swapped) / 3


def _evaluate(mesh: Any, shapes: list[Any], points: Array) -> Array:
    """Values (L, m) of functions at points (m, 2)."""
    x = np.column_stack([points, np.zeros(len(points))])
    hits = compat.cells_with(mesh, x)
    values = np.zeros((len(shapes), len(x)))
    # a mesh of straight cells does not cover the disc
    inside = np.array([len(hits.links(i)) > 0 for i in range(len(x))])
    cells = np.array([hits.links(i)[0] for i in np.flatnonzero(inside)], dtype=np.int32)
    for i, shape in enumerate(shapes):
        values[i, inside] = shape.eval(x[inside], cells)[:, 0]
    return values
