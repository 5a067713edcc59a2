"""Stiffness of one class of symmetry, and the forces that an energy gives."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from petsc4py import PETSc

from nanorom.fem.models import added_mass
from nanorom.fem.models.plate import Plate
from nanorom.fem.solvers import algebra, compat
from nanorom.fem.symmetry import Parity


class Stiffness(Mapping[Parity, PETSc.Mat]):
    """Transverse stiffness on all degrees of freedom, by class of symmetry."""

    def __init__(self, matrices: Mapping[Parity, PETSc.Mat]) -> None:
        self._matrices = matrices

    def __getitem__(self, parity: Parity) -> PETSc.Mat:
        return self._matrices[parity]

    def __iter__(self) -> Iterator[Parity]:
        return iter(self._matrices)

    def __len__(self) -> int:
        return len(self._matrices)

    def diagonal(self, parity: Parity) -> np.ndarray:
        """Diagonal (owned dofs,) of a class's stiffness. Collective."""
        return np.asarray(self[parity].getDiagonal().array)


class ClassStiffness(Stiffness):
    """That of a film, each class's made when it is asked for. Collective.

    An even class has no slope across the mirror; a membrane needs no term for that.  The matrix of
    a class is made when it is asked for: all of them together are what fills the memory.  What is
    the same for all is kept too, unless memory is to be ``spared``.
    """

    def __init__(self, plate: Plate, spared: bool = False) -> None:
        self._form = plate.compiled(plate.stiffness_form)
        self._base = None if spared else algebra.assemble(self._form)
        self._axes = plate.mirrors.axes if plate.bending else ()
        self._classes = plate.mirrors.classes
        self._mirrored = {}
        even = plate.switches()
        form = plate.compiled(plate.mirror_form, even) if self._axes else None
        for axis in self._axes:
            switch(even, tuple(int(other != axis) for other in self._axes))
            self._mirrored[axis] = algebra.assemble(form)

    def __getitem__(self, parity: Parity) -> PETSc.Mat:
        even = [axis for axis, odd in zip(self._axes, parity) if not odd]
        if self._base is None:
            matrix = algebra.assemble(self._form)
        elif not even:
            return self._base
        else:
            matrix = self._base.copy()
        for axis in even:
            matrix.axpy(1.0, self._mirrored[axis], PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
        return matrix

    def diagonal(self, parity: Parity) -> np.ndarray:
        """Diagonal (owned dofs,) of a class's stiffness, without making its matrix. Collective."""
        if self._base is None:
            return super().diagonal(parity)
        even = [self._mirrored[axis] for axis, odd in zip(self._axes, parity) if not odd]
        return np.asarray(sum(part.getDiagonal().array for part in (self._base, *even)))

    def __iter__(self) -> Iterator[Parity]:
        return iter(self._classes)

    def __len__(self) -> int:
        return len(self._classes)


def mass(plate: Plate) -> PETSc.Mat:
    """Mass of the deflections on all degrees of freedom, masses on the film included. Collective.

    Raises SceneError if one of them lies off the film.
    """
    matrix = algebra.assemble(plate.compiled(plate.mass_form))
    if plate.masses:
        added_mass.add(matrix, plate, plate.masses)
    return matrix


def switch(even: Sequence[Any], parity: Parity) -> None:
    """Have a form's switches take deflections of one class of symmetry."""
    for constant, odd in zip(even, parity):
        constant.value = 1.0 - odd


def free_deflections(plate: Plate, parity: Parity) -> algebra.FreeDofs:
    """Degrees of freedom of the deflections of one class of symmetry."""
    odd = plate.odd_facets(parity)

    def made() -> algebra.FreeDofs:
        fixed = fem.locate_dofs_topological(plate.deflections, 1, odd)
        return algebra.FreeDofs(plate.deflections, fixed)

    return plate.domain.once(("free", plate.degree, odd.tobytes()), made)


Columns = Callable[[np.ndarray], np.ndarray]  # (owned rows, m) -> (owned rows, m)


class EnergyForce:
    """Gradient of an energy that is quadratic in a function, without an assembled matrix."""

    def __init__(self, function: Any, gradient: Any) -> None:
        self._function = function
        self._sum = fem.Function(function.function_space)
        dofmap = function.function_space.dofmap
        self._n_owned = dofmap.index_map.size_local * dofmap.index_map_bs
        self._gradient = gradient

    def __call__(self, columns: np.ndarray) -> np.ndarray:
        """Force (owned dofs, m) of displacements (local dofs, m). Collective."""
        values, total = self._function.x.array, self._sum.x.array
        kept = values.copy()
        forces = []
        for column in columns.T:
            values[:] = column
            total[:] = 0.0
            fem.assemble_vector(total, self._gradient)
            compat.scatter_reverse_add(self._sum)
            forces.append(total[: self._n_owned].copy())
        values[:] = kept
        return np.column_stack(forces)


class LinearForce:
    """Force of a film's quadratic energy on displacements of any class of symmetry."""

    def __init__(self, even: Sequence[Any], force: EnergyForce) -> None:
        self._even, self._force = even, force

    @classmethod
    def of(cls, plate: Plate) -> LinearForce:
        """That of tension, bending and attraction on the plate's deflections."""
        even = plate.switches()
        return cls(even, EnergyForce(plate.w, plate.compiled(plate.linear_force_form, even)))

    @classmethod
    def of_energy(cls, plate: Plate, function: Any, deflection: Any, energy: Any) -> LinearForce:
        """That of an energy quadratic in a function, of which the deflection is one (UFL)."""
        even = plate.switches()
        if plate.bending:
            energy = energy + plate.mirror_energy(deflection, even)
        return cls(even, EnergyForce(function, compat.form(ufl.derivative(energy, function))))

    def __call__(self, parity: Parity, columns: np.ndarray) -> np.ndarray:
        """Force (owned dofs, m) of displacements (local dofs, m) of one parity. Collective."""
        switch(self._even, parity)
        return self._force(columns)
