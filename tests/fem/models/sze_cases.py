"""The nonlinear shell benchmarks of Sze, Liu and Lo (2004), doi:10.1016/j.finel.2003.11.001.

Each case gives a problem, its load factor's range and what is observed; TABLES hold the published
load-deflection values (their converged results, tables 1, 2, 4, 5 and 6), load relative to the
largest first.
"""

import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI

from nanorom.fem.mesh import mesh
from nanorom.fem.mesh.shapes import Grid
from nanorom.fem.models.shell import Shell, ShellStiffness
from nanorom.fem.solvers import compat
from nanorom.fem.statics.problem import StaticProblem

COMM = MPI.COMM_WORLD


def strip(place, n_x, n_y, order):
    """Unit square (s, t), each from 0 to 1, placed in space."""
    square = Grid(*(tuple(np.linspace(0.0, 1.0, n + 1)) for n in (n_x, n_y)))
    return mesh.build(COMM, square, order, place=lambda x: place(*x.T))


def held(shell, side, components):
    """Degrees of freedom of some components on a side."""
    facets = shell.domain.facets_of([side])
    nodes = fem.locate_dofs_topological(shell.space, 1, facets)
    return (6 * nodes[:, None] + np.array(components)).ravel()


def node_at(shell, point):
    x = shell.space.tabulate_dof_coordinates()
    distance = np.linalg.norm(x - point, axis=1)
    assert distance.min() < 1e-9
    return int(distance.argmin())


def observe(shell, dofs):
    """Displacement components (node, component, sign) of the current state."""
    return [sign * shell.state.x.array[6 * node + c] for node, c, sign in dofs]


def edge(shell, side):
    facets = shell.domain.facets_of([side])
    return compat.facet_measures(shell.mesh, [facets], {"quadrature_degree": 2 * shell.degree})[0]


def cantilever(length, degree, n):
    domain = strip(lambda s, t: np.column_stack([length * s, t, 0 * s]), n, 1, 1)
    shell = Shell.on(domain, degree, ShellStiffness(1.2e6, 0.0, 0.1))
    tip = node_at(shell, (length, 0, 0))
    return shell, held(shell, "left", range(6)), [(tip, 0, -1), (tip, 2, 1)]


def end_shear(degree=4, n=8):
    """3.1: cantilever under end shear, largest force 4."""
    shell, fixed, observed = cantilever(10.0, degree, n)
    force = ufl.TestFunction(shell.space)[2] * edge(shell, "right")
    return shell, StaticProblem(shell.state, shell.energy(), force, fixed=fixed), 4.0, observed


def end_moment(degree=4, n=8):
    """3.2: cantilever rolled up by an end moment, largest 50 pi/3."""
    shell, fixed, observed = cantilever(12.0, degree, n)
    normal = ufl.as_vector([0.0, 0.0, 1.0])
    director = normal + shell.delta
    turn = ufl.cross(ufl.as_vector([0.0, -1.0, 0.0]), director)
    test = ufl.TestFunction(shell.space)
    couple = sum(turn[i] * test[3 + i] for i in range(3)) * edge(shell, "right")
    problem = StaticProblem(shell.state, shell.energy(), couple, fixed=fixed, symmetric=False)
    return shell, problem, 50 * np.pi / 3, observed


def slit_annulus(degree=4, n=16):
    """3.3: annular plate slit along a radius, one lip lifted, largest line force 0.8."""

    def place(s, t):
        r, angle = 6 + 4 * t, 2 * np.pi * s
        return np.column_stack([r * np.cos(angle), r * np.sin(angle), 0 * s])

    shell = Shell.on(strip(place, n, 1, degree), degree, ShellStiffness(21e6, 0.0, 0.03))
    force = ufl.TestFunction(shell.space)[2] * edge(shell, "right")
    fixed = held(shell, "left", range(6))
    problem = StaticProblem(shell.state, shell.energy(), force, fixed=fixed)
    free = fem.locate_dofs_topological(shell.space, 1, shell.domain.facets_of(["right"]))
    r = np.linalg.norm(shell.space.tabulate_dof_coordinates()[free], axis=1)
    observed = [(free[r.argmin()], 2, 1), (free[r.argmax()], 2, 1)]
    return shell, problem, 0.8, observed


def point_force(shell, entries):
    load = np.zeros(len(shell.state.x.array))
    for node, component, force in entries:
        load[6 * node + component] = force
    return load


def hemisphere(degree=4, n=4):
    """3.4: hemisphere with an 18 degree hole, alternating radial forces, largest 400."""
    radius = 10.0

    def place(s, t):
        azimuth, height = np.pi / 2 * s, np.radians(72) * t
        return radius * np.column_stack(
            [np.cos(height) * np.cos(azimuth), np.cos(height) * np.sin(azimuth), np.sin(height)]
        )

    stiffness = ShellStiffness(6.825e7, 0.3, 0.04)
    shell = Shell.on(strip(place, n, n, degree), degree, stiffness, lambda x: x / radius)
    a, b = node_at(shell, (radius, 0, 0)), node_at(shell, (0, radius, 0))
    fixed = np.concatenate([held(shell, "left", (1, 4)), held(shell, "right", (0, 3)), [6 * a + 2]])
    nodal = point_force(shell, [(a, 0, 0.5), (b, 1, -0.5)])
    problem = StaticProblem(shell.state, shell.energy(), nodal_load=nodal, fixed=fixed)
    return shell, problem, 400.0, [(a, 0, 1), (b, 1, -1)]


def cylinder_pull_out(degree=4, n=6):
    """3.5: open-ended cylinder pulled apart at its middle, largest force 40 000."""
    radius, length = 4.953, 10.35

    def place(s, t):
        angle = np.pi / 2 * s  # from the loaded top to the side
        return np.column_stack([radius * np.sin(angle), length / 2 * t, radius * np.cos(angle)])

    def normal(x):
        return np.column_stack([x[:, 0], 0 * x[:, 0], x[:, 2]]) / radius

    stiffness = ShellStiffness(10.5e6, 0.3125, 0.094)
    shell = Shell.on(strip(place, n, n, degree), degree, stiffness, normal)
    fixed = np.concatenate(
        [
            held(shell, "left", (0, 3)),  # x = 0
            held(shell, "right", (2, 5)),  # z = 0
            held(shell, "bottom", (1, 4)),  # y = 0, the middle
        ]
    )
    a, b = node_at(shell, (0, 0, radius)), node_at(shell, (radius, 0, 0))
    c = node_at(shell, (radius, length / 2, 0))
    nodal = point_force(shell, [(a, 2, 0.25)])
    problem = StaticProblem(shell.state, shell.energy(), nodal_load=nodal, fixed=fixed)
    return shell, problem, 40_000.0, [(a, 2, 1), (b, 0, -1), (c, 0, -1)]


TABLES = {
    "end_shear": """
        0.05 0.026 0.663  0.1 0.103 1.309  0.15 0.224 1.922  0.2 0.381 2.493  0.25 0.563 3.015
        0.3 0.763 3.488  0.35 0.971 3.912  0.4 1.184 4.292  0.45 1.396 4.631  0.5 1.604 4.933
        0.55 1.807 5.202  0.6 2.002 5.444  0.65 2.190 5.660  0.7 2.370 5.855  0.75 2.541 6.031
        0.8 2.705 6.190  0.85 2.861 6.335  0.9 3.010 6.467  0.95 3.151 6.588  1.0 3.286 6.698""",
    "end_moment": """
        0.05 0.196 1.870  0.1 0.774 3.648  0.15 1.699 5.248  0.2 2.918 6.598  0.25 4.361 7.639
        0.3 5.945 8.333  0.35 7.585 8.664  0.4 9.194 8.637  0.45 10.688 8.281  0.5 12.000 7.639
        0.55 13.073 6.775  0.6 13.871 5.758  0.65 14.377 4.665  0.7 14.595 3.571
        0.75 14.546 2.546  0.8 14.270 1.650  0.85 13.818 0.926  0.9 13.247 0.405
        0.95 12.621 0.098  1.0 12.000 0.0""",
    "slit_annulus": """
        0.025 1.305 1.789  0.05 2.455 3.370  0.075 3.435 4.720  0.1 4.277 5.876
        0.125 5.007 6.872  0.15 5.649 7.736  0.2 6.725 9.160  0.25 7.602 10.288
        0.3 8.340 11.213  0.35 8.974 11.992  0.4 9.529 12.661  0.45 10.023 13.247
        0.5 10.468 13.768  0.55 10.876 14.240  0.6 11.257 14.674  0.65 11.620 15.081
        0.7 11.970 15.469  0.75 12.310 15.842  0.8 12.642 16.202  0.85 12.966 16.550
        0.9 13.282 16.886  0.95 13.590 17.212  1.0 13.891 17.528""",
    "hemisphere": """
        0.05 0.855 0.955  0.1 1.499 1.840  0.15 1.969 2.604  0.2 2.321 3.261  0.25 2.596 3.833
        0.3 2.819 4.339  0.35 3.002 4.790  0.4 3.158 5.196  0.45 3.291 5.565  0.5 3.406 5.902
        0.55 3.508 6.212  0.6 3.598 6.497  0.65 3.678 6.761  0.7 3.750 7.006  0.75 3.816 7.234
        0.8 3.875 7.448  0.85 3.929 7.647  0.9 3.979 7.835  0.95 4.025 8.011  1.0 4.067 8.178""",
    "cylinder_pull_out": """
        0.025 0.819 0.864 0.872  0.05 1.260 1.471 1.493  0.075 1.527 1.901 1.946
        0.1 1.707 2.217 2.293  0.15 1.936 2.641 2.792  0.2 2.079 2.904 3.106
        0.25 2.180 3.087 3.310  0.3 2.257 3.227 3.452  0.35 2.321 3.342 3.556
        0.4 2.376 3.443 3.632  0.45 2.425 3.539 3.688  0.5 2.473 3.653 3.718
        0.525 2.543 4.061 3.580  0.55 2.577 4.171 3.518  0.6 2.618 4.274 3.452
        0.65 2.648 4.338 3.410  0.7 2.672 4.385 3.378  0.75 2.692 4.423 3.353
        0.8 2.710 4.455 3.332  0.85 2.726 4.483 3.313  0.9 2.741 4.508 3.297
        0.95 2.755 4.530 3.283  1.0 2.768 4.551 3.269""",
}
CASES = {f.__name__: f for f in (end_shear, end_moment, slit_annulus, hemisphere)}
CASES["cylinder_pull_out"] = cylinder_pull_out


def table(name):
    """Published rows: load relative to the largest, then each displacement."""
    columns = 4 if name == "cylinder_pull_out" else 3
    return np.array(TABLES[name].split(), dtype=float).reshape(-1, columns)
