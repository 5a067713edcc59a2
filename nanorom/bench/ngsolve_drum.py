"""The tensioned drum in NGSolve: C0 interior penalty on curved cells, direct condensation.

An independent implementation as a careful user of NGSolve would write it; only quadrature-point
values leave the library, to be contracted by NumPy.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.sparse.linalg import LinearOperator, eigsh

from nanorom.exact import polar
from nanorom.types import Array


def available() -> bool:
    """Whether the wheel is installed."""
    from importlib.util import find_spec

    return find_spec("ngsolve") is not None


def solve(
    kappa: float, nu: float, diameters: list[int], count: int, degree: int, size: float
) -> tuple[int, Array, Array]:
    """Dofs, omega R^2 sqrt(rho h/D) (L,) and the tensor (L, L, L, L) in E h/R^2.

    diameters: nodal diameters of the modes in order, the last pair whole.
    """
    import ngsolve as ngs
    from netgen.geom2d import SplineGeometry

    geometry = SplineGeometry()
    geometry.AddCircle((0, 0), 1, bc="edge")
    mesh = ngs.Mesh(geometry.GenerateMesh(maxh=size))
    mesh.Curve(degree)
    space, shapes, omega = _modes(ngs, mesh, kappa, nu, degree, len(diameters))

    def evaluate(x: Array) -> Array:
        places = mesh(x[:, 0], x[:, 1])
        return np.array([np.ravel(shape(places)) for shape in shapes])

    mixing = polar.unique(diameters, evaluate)
    vectors = np.column_stack([shape.vec.FV().NumPy() for shape in shapes]) @ mixing
    for shape, vector in zip(shapes, vectors.T):
        shape.vec.FV().NumPy()[:] = vector
    return space.ndof, omega[:count], _tensor(ngs, mesh, shapes[:count], nu, degree)


def _modes(
    ngs: Any, mesh: Any, kappa: float, nu: float, degree: int, count: int
) -> tuple[Any, list[Any], Array]:
    """Space, the lowest modes and their frequencies."""
    space = ngs.H1(mesh, order=degree, dirichlet="edge", dgjumps=True)
    w, v = space.TnT()
    k = _stiffness(ngs, space, kappa, nu, degree)
    m = ngs.BilinearForm(space, symmetric=True)
    m += w * v * ngs.dx
    k.Assemble()
    m.Assemble()
    values, vectors = _lowest(space, k.mat, m.mat, count)
    free = np.array(list(space.FreeDofs()), dtype=bool)
    shapes = []
    for vector in vectors.T:
        shape = ngs.GridFunction(space)
        shape.vec.FV().NumPy()[free] = vector
        shapes.append(shape)
    return space, shapes, np.sqrt(values)


def _stiffness(ngs: Any, space: Any, kappa: float, nu: float, degree: int) -> Any:
    """Form of bending, by interior penalty, and of tension."""
    w, v = space.TnT()
    n, h = ngs.specialcf.normal(2), ngs.specialcf.mesh_size

    def moment(hesse: Any) -> Any:
        return (1 - nu) * hesse + nu * ngs.Trace(hesse) * ngs.Id(2)

    def normal_moment(hesse: Any) -> Any:
        return ngs.InnerProduct(moment(hesse) * n, n)

    def jump(f: Any) -> Any:
        return (ngs.grad(f) - ngs.grad(f.Other())) * n

    def average(f: Any) -> Any:
        hesse = f.Operator("hesse")
        return 0.5 * (normal_moment(hesse) + normal_moment(hesse.Other()))

    bent_w, bent_v = w.Operator("hesse"), v.Operator("hesse")
    penalty = 4.0 * degree * (degree - 1) / h
    inside, edge = ngs.dx(skeleton=True), ngs.ds(skeleton=True)
    k = ngs.BilinearForm(space, symmetric=True)
    k += (ngs.InnerProduct(moment(bent_w), bent_v) + kappa * ngs.grad(w) * ngs.grad(v)) * ngs.dx
    k += (penalty * jump(w) * jump(v) - average(w) * jump(v) - average(v) * jump(w)) * inside
    slope_w, slope_v = ngs.grad(w) * n, ngs.grad(v) * n
    k += (
        2 * penalty * slope_w * slope_v
        - normal_moment(bent_w) * slope_v
        - normal_moment(bent_v) * slope_w
    ) * edge
    return k


def _lowest(space: Any, k: Any, m: Any, count: int) -> tuple[Array, Array]:
    """Lowest eigenvalues and their vectors (free dofs, count), by shift-and-invert Lanczos."""
    free = np.array(list(space.FreeDofs()), dtype=bool)
    inverse = k.Inverse(space.FreeDofs(), inverse="sparsecholesky")
    x, y = k.CreateColVector(), k.CreateColVector()

    def apply(matrix: Any) -> LinearOperator:
        def matvec(values: Array) -> Array:
            full = x.FV().NumPy()
            full[:] = 0.0
            full[free] = np.ravel(values)
            y.data = matrix * x
            return np.array(y.FV().NumPy()[free])

        return LinearOperator((int(free.sum()),) * 2, matvec=matvec, dtype=float)

    values, vectors = eigsh(
        apply(k),
        count,
        apply(m),
        sigma=0.0,
        OPinv=apply(inverse),
        tol=0,
        ncv=3 * count,
        v0=np.ones(int(free.sum())),
    )
    order = np.argsort(values)
    return values[order], vectors[:, order]


def _tensor(ngs: Any, mesh: Any, shapes: list[Any], nu: float, degree: int) -> Array:
    """Direct condensation: one factorisation, one right-hand side per pair of modes."""
    count = len(shapes)
    plane = ngs.VectorH1(mesh, order=degree, dirichlet="edge")
    u, v = plane.TnT()

    def stress(strain: Any) -> Any:
        return ((1 - nu) * strain + nu * ngs.Trace(strain) * ngs.Id(2)) / (1 - nu**2)

    def strain_of(f: Any) -> Any:
        return 0.5 * (ngs.Grad(f) + ngs.Grad(f).trans)

    a = ngs.BilinearForm(plane, symmetric=True)
    a += ngs.InnerProduct(stress(strain_of(u)), strain_of(v)) * ngs.dx
    a.Assemble()
    inverse = a.mat.Inverse(plane.FreeDofs(), inverse="sparsecholesky")
    j, k = np.triu_indices(count)
    loads, solutions = [], []
    first, second = ngs.GridFunction(shapes[0].space), ngs.GridFunction(shapes[0].space)
    g, s = ngs.grad(first), ngs.grad(second)
    pair = 0.5 * (ngs.OuterProduct(g, s) + ngs.OuterProduct(s, g))
    form = ngs.LinearForm(plane)
    form += ngs.InnerProduct(stress(pair), strain_of(v)) * ngs.dx(bonus_intorder=degree)
    for one, two in zip(j, k):
        first.vec.data, second.vec.data = shapes[one].vec, shapes[two].vec
        form.Assemble()
        solution = form.vec.CreateVector()
        solution.data = inverse * form.vec
        loads.append(np.array(form.vec.FV().NumPy()))
        solutions.append(np.array(solution.FV().NumPy()))
    rule = ngs.IntegrationRule(ngs.ET.TRIG, 4 * (degree - 1))
    points = mesh.MapToAllElements(rule, ngs.VOL)
    volume = np.ravel(ngs.Det(ngs.specialcf.JacobianMatrix(2))(points))
    weights = np.abs(volume) * np.tile(rule.weights, len(volume) // len(rule.weights))
    slopes = np.array([ngs.grad(shape)(points) for shape in shapes])
    x, y = slopes[..., 0], slopes[..., 1]
    strain = np.stack([x[j] * x[k], y[j] * y[k], 0.5 * (x[j] * y[k] + y[j] * x[k])])
    xx, yy, xy = strain
    force = np.stack([xx + nu * yy, yy + nu * xx, 2 * (1 - nu) * xy]) * weights / (1 - nu**2)
    energy = np.einsum("apq,arq->pr", strain, force, optimize=True)
    energy -= np.array(loads) @ np.array(solutions).T
    products = np.zeros((count,) * 4)
    for a_, b_ in ((j, k), (k, j)):
        for c_, d_ in ((j, k), (k, j)):
            products[a_[:, None], b_[:, None], c_, d_] = energy
    swapped = products.transpose(0, 2, 1, 3) + products.transpose(0, 3, 2, 1)
    return np.asarray((products + swapped) / 6)
