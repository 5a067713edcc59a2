"""What a drive pattern tells of itself, and the kinds of force that there are.

A pattern is a class that says its name, the unit of its level, its keys in [drive] (its fields, as
those of any section) and what it does to a film, in terms of the virtual work of simple forces
(`VirtualWork`).  Whatever a film is known by (polynomials of its modes, their drawings, all its
basis functions) gives that work; nothing asks which pattern it has.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar, Generic, TypeVar

import attrs
import numpy as np

from nanorom.errors import SceneError
from nanorom.scene import fields as v
from nanorom.scene.units import place_with_unit, with_unit, wrong
from nanorom.types import Array

Force = TypeVar("Force")
Operator = TypeVar("Operator")


MISSED = 1e-6  # of what acts near the centre of a pattern: a tail of it that touches the film
NO_GATE = (
    "drive.voltage: the film has no gate, or its drive is not known here; allowed for a model that "
    "was reduced with load.voltage (it may be 0) and load.gap, or [[load.gate]]"
)
NO_MASS = "drive: the mass that a shaken frame drags along is not known here"


class Absent(SceneError):
    """A film, or what is known of it, has no such force."""


class VirtualWork(ABC, Generic[Force, Operator]):
    """What simple forces do to a film: on L modes a Force is (L,) and an Operator (L, L)."""

    @abstractmethod
    def uniform(self, pressure: float = 1.0) -> Force:
        """Of a pressure in Pa everywhere: int pressure phi dA."""

    @abstractmethod
    def areal(self, pattern: Areal) -> Force:
        """Of a force per area that varies: int density phi dA."""

    @abstractmethod
    def points(self, places: Array, weights: Array, key: str) -> Force:
        """Of forces (n,) in N at places (n, 2) in m: sum of weights phi there.

        Raises SceneError by the key of one that is off the film.
        """

    def inertia(self, acceleration: float = 1.0) -> Force:
        """Of the frame's acceleration in m/s^2: -int acceleration m phi dA, m the mass per area."""
        raise Absent(NO_MASS)

    @abstractmethod
    def stretch(self, tension: float = 1.0) -> Operator:
        """Of a change of tension in N/m in all directions: -int tension grad phi . grad phi dA."""

    @abstractmethod
    def proportional(self, force: Force) -> Operator:
        """Of a force on each mode that its amplitude multiplies: diag(force)."""

    def attraction(self, gate: int = 1) -> Force:
        """Of one of the gates at 1 V^2 of half its square: int eps0/(g - h)^2 phi dA."""
        raise Absent(NO_GATE)

    def softening(self, gate: int = 1) -> Operator:
        """Of the same, its change with the deflection: int 2 eps0/(g - h)^3 phi phi dA."""
        raise Absent(NO_GATE)


POSITION_KEY = "drive.position"


def _read_position(value: Any) -> tuple[float, ...]:
    position = v.read_quantities(value, "m", POSITION_KEY)
    if len(position) != 2:
        raise wrong(POSITION_KEY, position, 'x and y such as ["1 um", "0 um"]')
    return position


POSITION = v.custom(
    POSITION_KEY,
    _read_position,
    allowed="a list of two",
    about="x and y of a spot's centre or of a point",
    unit="m",
)


@attrs.frozen
class Pattern(ABC):
    """A pattern of modal forces per unit of a drive's level."""

    name: ClassVar[str]
    unit: ClassVar[str]  # of the level

    @classmethod
    def keys(cls) -> tuple[str, ...]:
        """Keys of [drive] that it has beside the level: its attributes."""
        return tuple(field.name for field in attrs.fields(cls))

    @classmethod
    def needs(cls) -> tuple[str, ...]:
        """Those of its keys that have to be given."""
        return tuple(f.name for f in attrs.fields(cls) if f.default is attrs.NOTHING)

    @classmethod
    def aimed(cls) -> bool:
        """It has keys; only a pattern that has none is one and the same in every drive."""
        return bool(cls.keys())


@attrs.frozen
class DirectPattern(Pattern):
    """J (L,) in N per unit of the level: the virtual work on each mode."""

    @abstractmethod
    def force(self, work: VirtualWork[Force, Operator]) -> Force:
        """J on what does the work; raises SceneError for a place beside the film, or Absent."""


@attrs.frozen
class Uniform(DirectPattern):
    """One newton per square metre everywhere, per unit of the level: J_r = int phi_r dA."""

    def force(self, work: VirtualWork[Force, Operator]) -> Force:
        return work.uniform()


@attrs.frozen
class Areal(DirectPattern):
    """A force per area that varies over the film: J_r = int density phi_r dA."""

    @property
    @abstractmethod
    def centre(self) -> tuple[float, float]:
        """Where it acts, (x, y) in m."""

    @property
    @abstractmethod
    def size(self) -> float:
        """Length in m over which it varies: quadrature resolves it."""

    @property
    @abstractmethod
    def reach(self) -> float:
        """Distance from the centre in m beyond which there is nothing to integrate."""

    @abstractmethod
    def density(self, points: Array) -> Array:
        """Force per area (n,) in N/m^2 per unit of the level at points (n, 2) in m."""

    def check_meets(self, whole: float) -> None:
        """Raise SceneError if next to nothing of it is on the film.

        whole : int density dA over the film, in N per unit of the level.
        """
        there = float(self.density(np.array([self.centre]))[0])
        if abs(whole) < MISSED * abs(there) * self.size**2:
            raise SceneError(
                f"{POSITION_KEY}: found {place_with_unit(self.centre)}, with no film within about "
                f"{with_unit(self.size, 'm', 6)}; allowed: a place on the film"
            )

    def force(self, work: VirtualWork[Force, Operator]) -> Force:
        return work.areal(self)


@attrs.frozen
class Concentrated(DirectPattern):
    """One newton at a place, per unit of the level: J_r = phi_r there."""

    position: tuple[float, float] = attrs.field(metadata=POSITION)  # (x, y) in m

    def force(self, work: VirtualWork[Force, Operator]) -> Force:
        return work.points(np.array([self.position]), np.ones(1), POSITION_KEY)


@attrs.frozen
class ParametricPattern(Pattern):
    """P (L, L) in N/m per unit of the level; the modal force is P q."""

    @abstractmethod
    def stiffness(self, work: VirtualWork[Force, Operator], force: Force) -> Operator:
        """P on what does the work, beside a direct pattern with its force at level 1; or Absent."""

    @classmethod
    def beside(cls, force: Array) -> Array | None:
        """P that goes with a direct J (L,) alone; None for one that stands for itself."""
        return None


@attrs.frozen
class Stretch(ParametricPattern):
    """A change of tension of 1 N/m in all directions: P_rs = -int grad phi_r . grad phi_s dA."""

    def stiffness(self, work: VirtualWork[Force, Operator], force: Force) -> Operator:
        return work.stretch()


@attrs.frozen
class Proportional(ParametricPattern):
    """The direct pattern times the amplitude: P = diag(J)."""

    def stiffness(self, work: VirtualWork[Force, Operator], force: Force) -> Operator:
        return work.proportional(force)

    @classmethod
    def beside(cls, force: Array) -> Array:
        """diag(J) (L, L) in N/m, of J (L,) in N."""
        return np.diag(force)
