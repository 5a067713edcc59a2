"""A film under one level of its drive, film-scaled, and the modal equations of its named modes."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from nanorom.continuation.drive import Drive as Term
from nanorom.continuation.drive import terms
from nanorom.continuation.system import ModalSystem
from nanorom.errors import SceneError
from nanorom.fem.symmetry import Parity
from nanorom.scene.drive import Drive
from nanorom.scene.waves import Harmonic
from nanorom.types import Array
from nanorom.verification.assembled import Film, on_free

COSINE = (Harmonic(1, direct=1.0, parametric=1.0),)  # the course of a drive that has no other


def check(drive: Drive) -> None:
    """Raise SceneError for a drive that full-order orbits do not know."""
    if drive.source is not None:
        raise SceneError(
            f"drive.{drive.source}: orbits of the film do not know it; allowed: levels of "
            "other patterns"
        )


class DrivenFilm:
    """A film, its drive's patterns and their course in time, and levels of them in SI units."""

    def __init__(self, film: Film, drive: Drive, direct: float, parametric: float) -> None:
        check(drive)
        self.film, self.drive = film, drive
        self.direct, self.parametric = direct, parametric
        self.harmonics = drive.harmonics or COSINE
        self._modulation: dict[Parity, Any] = {}

    def course(self, name: str) -> Array:
        """How the "direct" or the "parametric" drive goes in time, (2K + 1,) by the terms 1,
        cos(omega t), sin, cos(2 omega t), ... to the highest harmonic K of both.
        """
        factors = [
            Term(each.harmonic, each.phase, direct=[getattr(each, name)]) for each in self.harmonics
        ]
        return terms(factors, "direct", np.zeros(1))[0]

    @property
    def material_time(self) -> float:
        """Relaxation time of the material."""
        assert self.film.scene.damping is not None
        return self.film.scene.damping.material_time / self.film.units.time

    @cached_property
    def forces(self) -> dict[Parity, Array]:
        """Direct force (free,) on the classes that it drives."""
        if self.direct == 0.0 or not self.course("direct").any():
            return {}
        scale = self.direct / self.film.units.force
        found = on_free(self.film, self.drive.pattern.force(self.film.work))
        return {parity: scale * force for parity, force in found.items()}

    def modulation(self, parity: Parity) -> Any:
        """Operator (free, free) on what is modulated, None if nothing is."""
        if self.parametric == 0.0 or not self.course("parametric").any():
            return None
        if parity not in self._modulation:
            scale, work = self.parametric / self.film.units.stiffness, self.film.work
            stiffness = self.drive.modulation.stiffness(work, self.drive.pattern.force(work))
            self._modulation[parity] = scale * stiffness(parity)
        return self._modulation[parity]

    @cached_property
    def system(self) -> ModalSystem:
        """Modal equations of all named modes in coordinates of unit mass."""
        film, time = self.film, self.material_time
        count = len(film.parities)
        direct, parametric = np.zeros(count), np.zeros((count, count))
        for parity in film.classes:
            own, shapes = film.of_class(parity), film.shapes(parity)
            if parity in self.forces:
                direct[own] = shapes.T @ self.forces[parity]
            operator = self.modulation(parity)
            if operator is not None:
                parametric[np.ix_(own, own)] = -shapes.T @ (operator @ shapes)
        damping, viscous = np.diag(film.rates), time > 0
        if viscous:
            damping = damping + time * self._tensor("bending")
        if "squeezed" in film.modal:
            damping = damping + self._tensor("squeezed")
        return ModalSystem(
            stiffness=self._tensor("stiffness"),
            damping=damping,
            quadratic=self._tensor("quadratic"),
            cubic=self._tensor("cubic"),
            cubic_damping=time * self._tensor("stretching") if viscous else None,
            drives=[
                Term(
                    each.harmonic,
                    each.phase,
                    direct=each.direct * direct,
                    parametric=each.parametric * parametric,
                )
                for each in self.harmonics
            ],
        )

    def _tensor(self, name: str) -> Array:
        """A modal matrix or tensor in coordinates of unit mass."""
        array, scale = self.film.modal[name], self.film.scale
        for axis in range(array.ndim):
            array = array * scale.reshape([-1 if i == axis else 1 for i in range(array.ndim)])
        return np.asarray(array / (self.film.units.energy * self.film.copies))
