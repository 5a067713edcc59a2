"""Means over a disc on the film: cell by cell where the mesh follows its rim, else on points."""

from __future__ import annotations

from typing import Any

import numpy as np
import ufl
from dolfinx import fem

from nanorom.fem.fields.surface import Surface
from nanorom.fem.solvers import compat

RESOLVED = 1e-8  # relative error of the area of a disc that cells fill without being cut


def rule(centre: np.ndarray, radius: float, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 2) and weights (n,), of sum 1, of the mean over a disc; its centre if that is all.

    Gauss points along the radius, equal angles.
    """
    if radius == 0:
        return np.asarray(centre, dtype=float)[None], np.ones(1)
    s, radial = np.polynomial.legendre.leggauss(order)
    r, radial = radius * (s + 1) / 2, radial * (s + 1) / 2
    angle = 2 * np.pi * np.arange(2 * order) / (2 * order)
    points = np.stack([np.outer(r, np.cos(angle)), np.outer(r, np.sin(angle))], axis=2)
    weights = np.repeat(radial / radial.sum(), 2 * order) / (2 * order)
    return np.asarray(centre) + points.reshape(-1, 2), weights


def density(plate: Surface, centre: np.ndarray, radius: float, dx: Any) -> Any:
    """1/(pi radius^2) on a disc, 0 beyond it (UFL); None where its rim cuts cells. Collective.

    dx : the measure that it will be integrated with.
    """
    if radius == 0:
        return None
    mesh = plate.domain.mesh
    at = ufl.SpatialCoordinate(mesh) - fem.Constant(mesh, np.asarray(centre, dtype=float))
    square, value = fem.Constant(mesh, float(radius) ** 2), fem.Constant(mesh, 1.0)
    inside = ufl.conditional(ufl.lt(ufl.inner(at, at), square), value, 0.0)
    area = plate.domain.comm.allreduce(fem.assemble_scalar(compat.form(inside * dx)))
    whole = np.pi * radius**2
    if abs(plate.mirrors.copies * area / whole - 1) >= RESOLVED:
        return None
    value.value = 1 / whole
    return inside
