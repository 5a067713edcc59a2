"""What a fit can find of a film; each unknown is a class.

The stiffness T_x K_x + T_y K_y + D K_D and the mass rho h M depend on the film through four numbers
(T_x, T_y, D, rho h).  An unknown says what it sets in the film and how the four change with it; the
fit, the search and what is told of them ask no more.  What damps is seen by sweeps alone
(`measurement.device`).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import attrs
import numpy as np

from nanorom.errors import SceneError
from nanorom.scene.excitation import Damping
from nanorom.scene.film import Tension
from nanorom.scene.scene import Scene
from nanorom.types import Array

PAIR = ("tension_x", "tension_y")  # alike unless the film's shape or labels tell x from y


@attrs.frozen
class Film:
    """What the operators of a scene's film depend on.

    tension_x, tension_y: N/m; youngs_modulus: Pa; poisson_ratio; density: kg/m^3; thickness: m;
    bends: it is not a membrane; quality_factor, material_time (s): of its damping, as found.
    """

    tension_x: float
    tension_y: float
    youngs_modulus: float
    poisson_ratio: float
    density: float
    thickness: float
    bends: bool
    quality_factor: float | None = None
    material_time: float = 0.0

    @classmethod
    def of(cls, scene: Scene) -> Film:
        """The film of a scene."""
        material, bends, damping = scene.material, scene.plate.bends is not False, scene.damping
        quality = (damping.quality_factor if damping else None) or ()
        return cls(
            scene.tension.x,
            scene.tension.y,
            material.youngs_modulus,
            material.poisson_ratio,
            material.density,
            scene.plate.thickness,
            bends,
            None if damping is None or len(quality) != 1 else quality[0],
            0.0 if damping is None else damping.material_time,
        )

    @property
    def bending(self) -> float:
        """Bending stiffness D in N m; 0 for a membrane."""
        if not self.bends:
            return 0.0
        return self.youngs_modulus * self.thickness**3 / 12 / (1 - self.poisson_ratio**2)

    @property
    def operators(self) -> Array:
        """T_x, T_y in N/m, D in N m, rho h in kg/m^2 (4,)."""
        areal_mass = self.density * self.thickness
        return np.array([self.tension_x, self.tension_y, self.bending, areal_mass])

    def put_into(self, scene: Scene) -> Scene:
        """The scene with this film; raises SceneError where it allows no such value."""
        material = attrs.evolve(
            scene.material,
            youngs_modulus=self.youngs_modulus,
            poisson_ratio=self.poisson_ratio,
            density=self.density,
        )
        damping = scene.damping
        if self.quality_factor or self.material_time:
            damping = Damping(self.quality_factor, self.material_time)
        return scene.with_(
            tension=Tension(self.tension_x, self.tension_y),
            material=material,
            plate=attrs.evolve(scene.plate, thickness=self.thickness),
            damping=damping,
        )


class Unknown(ABC):
    """A number to be found, greater than 0.

    name, unit; sets: attributes of the film that it gives its value to; key: of the scene, by which
    the arrays of a model have exact derivatives, or "" where they have none.  stiffens: 1 if all of
    omega^2 goes with it together with the others of its kind, -1 if omega^2 goes with its inverse,
    else 0; bends: power with which D grows with it; pulls: whether it is a tension.
    bounds: values (low, high) beyond which the fit does not go.
    """

    name: ClassVar[str]
    unit: ClassVar[str]
    sets: ClassVar[tuple[str, ...]]
    key: ClassVar[str] = ""
    stiffens: ClassVar[int] = 0
    bends: ClassVar[int] = 0
    pulls: ClassVar[bool] = False
    bounds: ClassVar[tuple[float, float]] = (0.0, np.inf)

    def of(self, film: Film) -> float:
        """Its value in a film, in its unit."""
        return float(np.mean([getattr(film, name) for name in self.sets]))

    def put(self, film: Film, value: float) -> Film:
        """The film with another value of it, in its unit."""
        return attrs.evolve(film, **dict.fromkeys(self.sets, value))

    @abstractmethod
    def slope(self, film: Film) -> Array:
        """Derivatives (4,) of T_x, T_y, D, rho h with it, in SI units."""

    def check(self, film: Film) -> None:
        """Raise SceneError where the resonances of a film cannot depend on it."""
        if not self.slope(film).any():
            raise SceneError(f"unknowns: found {self.name}, on which no resonance depends here")


class IsotropicTension(Unknown):
    """The same tension along x and y."""

    name, unit, sets = "tension", "N/m", PAIR
    key = "tension"
    stiffens, pulls = 1, True

    def slope(self, film: Film) -> Array:
        return np.array([1.0, 1.0, 0.0, 0.0])


class TensionX(Unknown):
    """Tension along x."""

    name, unit, sets = PAIR[0], "N/m", PAIR[:1]
    key = "tension.x"
    stiffens, pulls = 1, True

    def slope(self, film: Film) -> Array:
        return np.array([1.0, 0.0, 0.0, 0.0])


class TensionY(Unknown):
    """Tension along y."""

    name, unit, sets = PAIR[1], "N/m", PAIR[1:]
    key = "tension.y"
    stiffens, pulls = 1, True

    def slope(self, film: Film) -> Array:
        return np.array([0.0, 1.0, 0.0, 0.0])


class YoungsModulus(Unknown):
    """Young's modulus, through the bending stiffness."""

    name, unit, sets = "youngs_modulus", "Pa", ("youngs_modulus",)
    key = "material.youngs_modulus"
    stiffens, bends = 1, 1

    def slope(self, film: Film) -> Array:
        return np.array([0.0, 0.0, self.put(film, 1.0).bending, 0.0])

    def check(self, film: Film) -> None:
        if not film.bends:
            raise SceneError(
                "unknowns: found youngs_modulus, but a membrane has no bending stiffness to find "
                'it from; use plate.model = "plate"'
            )


class Density(Unknown):
    """Density."""

    name, unit, sets = "density", "kg/m^3", ("density",)
    key = "material.density"
    stiffens = -1

    def slope(self, film: Film) -> Array:
        return np.array([0.0, 0.0, 0.0, film.thickness])


class Thickness(Unknown):
    """Thickness at a given tension (N/m): D goes with its cube, the mass with itself."""

    name, unit, sets = "thickness", "m", ("thickness",)
    key = "plate.thickness"
    bends = 3

    def slope(self, film: Film) -> Array:
        return np.array([0.0, 0.0, 3 * film.bending / film.thickness, film.density])


class QualityFactor(Unknown):
    """Quality factor of all modes, which no resonance frequency tells."""

    name, unit, sets = "quality_factor", "1", ("quality_factor",)
    key = "damping.quality_factor"

    def of(self, film: Film) -> float:
        return film.quality_factor or np.nan

    def slope(self, film: Film) -> Array:
        return np.zeros(4)


class MaterialTime(Unknown):
    """Relaxation time of a viscous material, the nonlinear damping of a film that stretches."""

    name, unit, sets = "material_time", "s", ("material_time",)
    key = "damping.material_time"

    def slope(self, film: Film) -> Array:
        return np.zeros(4)


_ALL = (
    IsotropicTension(),
    TensionX(),
    TensionY(),
    YoungsModulus(),
    Density(),
    Thickness(),
    QualityFactor(),
    MaterialTime(),
)
UNKNOWNS: dict[str, Unknown] = {unknown.name: unknown for unknown in _ALL}
USUAL = (*PAIR, "youngs_modulus")


def chosen(film: Film, names: tuple[str, ...]) -> tuple[Unknown, ...]:
    """The unknowns of these names in the order of the table; raises SceneError.

    They must exist, be apart, act on the film, determine it and start within their bounds.
    """
    for name in names:
        if name not in UNKNOWNS:
            raise SceneError(f"unknowns: found {name!r}; allowed: {', '.join(UNKNOWNS)}")
    found = tuple(unknown for name, unknown in UNKNOWNS.items() if name in names)
    if not found:
        raise SceneError(f"unknowns: found none; allowed: {', '.join(UNKNOWNS)}")
    for i, unknown in enumerate(found):
        for other in found[:i]:
            if set(unknown.sets) & set(other.sets):
                raise SceneError(
                    f"unknowns: found {other.name} beside {unknown.name}, which is a part of it; "
                    "give one of them"
                )
        unknown.check(film)
        low, high = unknown.bounds
        if not low <= unknown.of(film) <= high:
            raise SceneError(
                f"unknowns: {unknown.name} starts at {unknown.of(film):g} {unknown.unit} in the "
                f"scene; allowed: {low:g} to {high:g}"
            )
    if not _determined(film, found):
        told = ", ".join(unknown.name for unknown in found)
        raise SceneError(
            f"unknowns: found {told}; frequencies do not determine them together, as they depend "
            "on tension and bending stiffness by areal mass alone; leave one of them out"
        )
    return found


def _determined(film: Film, found: tuple[Unknown, ...]) -> bool:
    """Whether no change of the unknowns leaves T_x, T_y and D by rho h as they are."""
    acting = film.operators != 0
    slopes = np.array([unknown.slope(film) * unknown.of(film) for unknown in found])
    relative = slopes[:, acting] / film.operators[acting]
    return bool(np.linalg.matrix_rank(relative[:, :-1] - relative[:, -1:]) == len(found))
