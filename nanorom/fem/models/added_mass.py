"""Masses that sit on a film, in the mass matrix of its deflections.

A mass m at x adds m phi_i(x) phi_j(x): within the cell that holds it, where the matrix has entries
anyway.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np
import ufl
from petsc4py import PETSc

from nanorom.errors import SceneError, SolverError
from nanorom.fem.fields import discs
from nanorom.fem.fields.places import weighed
from nanorom.fem.solvers import algebra, compat

SAME = PETSc.Mat.Structure.SAME_NONZERO_PATTERN
ORDER = 4  # Gauss points along a disc's radius by degree: as cells are cut anywhere


@attrs.frozen
class PointMass:
    """A mass in the film's unit of it, spread evenly over a disc, at a point if its radius is 0."""

    value: float
    position: tuple[float, float]
    radius: float = 0.0


def add(matrix: PETSc.Mat, film: Any, masses: Sequence[PointMass]) -> None:
    """Add masses to the mass matrix of a film's deflections. Collective.

    Raises SceneError if a part of one lies off the film.
    """
    to_global = film.deflections.dofmap.index_map.local_to_global
    trial, test = ufl.TrialFunction(film.deflections), ufl.TestFunction(film.deflections)
    dx = film.dx(2 * film.degree)
    for number, mass in enumerate(masses, 1):
        centre = np.asarray(mass.position)
        density = discs.density(film, centre, mass.radius, dx)
        if density is not None:
            form = compat.form(density * trial * test * dx)
            matrix.axpy(mass.value, algebra.assemble(form), SAME)
            continue
        points, weights = discs.rule(centre, mass.radius, ORDER * film.degree)
        weights = mass.value * weights / film.mirrors.copies
        try:
            held = weighed(film, points, weights)
        except SolverError:
            raise SceneError(
                f"mass.position: found mass {number}, a part of which lies off the film; allowed: "
                "on the film, all of its disc of mass.radius"
            ) from None
        for dofs, values, weight in zip(*held):
            rows = to_global(dofs.astype(np.int32)).astype(PETSc.IntType)
            block = weight * np.outer(values, values)
            matrix.setValues(rows, rows, block, addv=PETSc.InsertMode.ADD_VALUES)
        matrix.assemble()
