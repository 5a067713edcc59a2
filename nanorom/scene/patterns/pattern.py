"""What a drive pattern tells of itself, and the kinds of force that there are.

A pattern says its name, the unit of its level and its keys in [drive], and belongs to one of the
kinds below.  The kind is all that finite elements (`nanorom.fem.output.patterns`) and stored models
(`nanorom.rom.patterns`) look at: a new pattern of a known kind is one file and one row of the
table, a new kind one more function in each of the two.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import attrs

from nanorom.types import Array


@attrs.frozen
class Pattern(ABC):
    """A pattern of modal forces per unit of a drive's level."""

    name: ClassVar[str]
    unit: ClassVar[str]  # of the level

    @classmethod
    def keys(cls) -> tuple[str, ...]:
        """Keys of [drive] that it needs beside the level: its attributes."""
        return tuple(field.name for field in attrs.fields(cls))


@attrs.frozen
class DirectPattern(Pattern):
    """J (L,) in N per unit of the level: the virtual work on each mode."""


@attrs.frozen
class Uniform(DirectPattern):
    """One newton per square metre everywhere, per unit of the level: J_r = int phi_r dA."""


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


@attrs.frozen
class Concentrated(DirectPattern):
    """One newton at a place, per unit of the level: J_r = phi_r there."""

    position: tuple[float, float]  # (x, y) in m


@attrs.frozen
class ParametricPattern(Pattern):
    """P (L, L) in N/m per unit of the level; the modal force is P q."""


@attrs.frozen
class Stretch(ParametricPattern):
    """A change of tension of 1 N/m in all directions: P_rs = -int grad phi_r . grad phi_s dA."""


@attrs.frozen
class Proportional(ParametricPattern):
    """The direct pattern times the amplitude: P = diag(J)."""
