"""Films of several layers: the uniform film that a stack is equal to. Sections [[layer]].

Laminate theory (Jones, Mechanics of Composite Materials, 1999, chapter 4) with extension A,
coupling B and bending D of layers in plane stress, about any plane.  Measured at the height where
the displacement has no coupling left, u - c grad w with c = B11/A11, the stack bends with
D11 - B11^2/A11.  With one Poisson's ratio that is the film itself; with several it is so where
every edge is clamped, as int kappa_xx kappa_yy - kappa_xy^2 vanishes there.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import attrs

from nanorom.errors import SceneError
from nanorom.scene import fields as v
from nanorom.scene import units
from nanorom.scene.film import Plate, Tension
from nanorom.scene.load import Load
from nanorom.scene.material import Material
from nanorom.scene.support import Kind

ALIKE = 1e-12  # of ratios and moments: rounding of their sums
MOST = 100


@attrs.frozen(field_transformer=v.readers)
class Layer:
    """One layer, isotropic; thickness in m, youngs_modulus and stress in Pa, density in kg/m^3.

    poisson_ratio : of its material; loss : E''/E' of its modulus.
    """

    thickness: float = attrs.field(
        converter=v.as_quantity, metadata=v.quantity("layer.thickness", "m", about="of the layer")
    )
    youngs_modulus: float = attrs.field(
        converter=v.as_quantity,
        metadata=v.quantity("layer.youngs_modulus", "Pa", about="Young's modulus E"),
    )
    poisson_ratio: float = attrs.field(
        converter=v.as_quantity,
        metadata=v.quantity("layer.poisson_ratio", "1", v.within(-1, 0.5), about="Poisson's ratio"),
    )
    density: float = attrs.field(
        converter=v.as_quantity, metadata=v.quantity("layer.density", "kg/m^3", about="density")
    )
    stress: float = attrs.field(
        default=0.0,
        converter=v.as_quantity,
        metadata=v.quantity(
            "layer.stress", "Pa", v.ANY, about="of the film in place, the same in every direction"
        ),
    )
    loss: float = attrs.field(
        default=0.0,
        converter=v.as_quantity,
        metadata=v.quantity(
            "layer.loss",
            "1",
            v.SHARE,
            about="E''/E' of its modulus",
        ),
    )

    @property
    def stiffness(self) -> float:
        """E/(1 - nu^2) in Pa."""
        return self.youngs_modulus / (1 - self.poisson_ratio**2)


@attrs.frozen
class Stack:
    """Layers from the bottom to the top, towards positive w."""

    layers: tuple[Layer, ...]

    @classmethod
    def of(cls, layers: Iterable[Layer]) -> Stack:
        """A stack; raises SceneError for none, or too many."""
        found = tuple(layers)
        if not 1 <= len(found) <= MOST:
            raise SceneError(f"layer: found {len(found)} layers; allowed: 1 to {MOST}")
        return cls(found)

    @classmethod
    def from_tables(cls, tables: Sequence[Any]) -> Stack:
        """Read [[layer]]; raises SceneError."""
        return cls.of(v.from_table(Layer, "layer", table) for table in tables)

    @classmethod
    def taken(cls, document: Mapping[str, Any]) -> tuple[Stack | None, dict[str, Any]]:
        """The stack of a scene's document, if it has one, and the rest; raises SceneError."""
        rest = dict(document)
        tables = rest.pop("layer", None)
        if tables is None:
            return None, rest
        if not isinstance(tables, list):
            raise units.wrong("layer", tables, "tables [[layer]]")
        for name in ("material", "tension"):
            if name in rest:
                raise SceneError(f"{name}: found beside [[layer]]; allowed: each layer has its own")
        return cls.from_tables(tables), rest

    def _sum(self, weight: Any, power: int = 0, about: float = 0.0) -> float:
        """int weight (z - about)^power dz over the stack, z from its bottom in m."""
        total, low = 0.0, -about
        for layer in self.layers:
            high = low + layer.thickness
            total += weight(layer) * (high ** (power + 1) - low ** (power + 1)) / (power + 1)
            low = high
        return total

    @property
    def neutral(self) -> float:
        """Height in m of the neutral plane above the bottom."""
        return self._sum(_stiffness, 1) / self._sum(_stiffness)

    @property
    def thickness(self) -> float:
        """In m."""
        return self._sum(lambda layer: 1.0)

    @property
    def bending_ratio(self) -> float:
        """Poisson's ratio of its bending about the neutral plane."""
        held = self._sum(lambda layer: layer.poisson_ratio * layer.stiffness, 2, self.neutral)
        return held / self._sum(_stiffness, 2, self.neutral)

    @property
    def moment(self) -> float:
        """Of the stress about the neutral plane in N: edges that are not clamped would bow."""
        return self._sum(lambda layer: layer.stress, 1, self.neutral)

    def film(self) -> dict[str, Any]:
        """Plate, material and tension of the uniform film, by their names in a scene."""
        h = self.thickness
        along = self._sum(_stiffness)
        nu = self._sum(lambda layer: layer.poisson_ratio * layer.stiffness) / along
        bending = self._sum(_stiffness, 2, self.neutral)
        lost = self._sum(lambda layer: layer.loss * layer.stiffness, 2, self.neutral)
        material = Material(
            youngs_modulus=along * (1 - nu**2) / h,
            poisson_ratio=nu,
            density=self._sum(lambda layer: layer.density) / h,
            bending=bending,
            loss=lost / bending,
        )
        tension = self._sum(lambda layer: layer.stress)
        return {"material": material, "tension": Tension(tension, tension)}

    def plate(self, table: Any) -> Plate:
        """[plate] with the stack's thickness; raises SceneError if it has one of its own."""
        if "thickness" in table:
            raise SceneError("plate.thickness: found beside [[layer]], whose sum it is")
        given = {"model": "plate", **table, "thickness": self.thickness}
        plate = v.from_table(Plate, "plate", given)
        if not (plate.rules.bends and plate.rules.planar):
            raise units.wrong("plate.model", plate.model, "plate beside [[layer]]")
        return plate

    def loaded(self, load: Load | None, kinds: Iterable[Kind]) -> Load | None:
        """A load and the moment of the stress, where it bows the film at edges that may turn.

        Raises SceneError where the load states a moment too.
        """
        if load is not None and load.moment is not None:
            raise SceneError("load.moment: found beside [[layer]], of whose stress it follows")
        size = self._sum(lambda layer: abs(layer.stress)) * self.thickness
        if all(kind == "clamped" for kind in kinds) or abs(self.moment) <= ALIKE * size:
            return load
        return Load(moment=self.moment) if load is None else attrs.evolve(load, moment=self.moment)

    def check(self, kinds: Iterable[Kind], parted: bool = False) -> None:
        """Raise SceneError for edges at which the uniform film is not the stack, of parts too."""
        if all(kind == "clamped" for kind in kinds) and not parted:
            return
        first = self.layers[0].poisson_ratio
        if any(abs(layer.poisson_ratio - first) > ALIKE for layer in self.layers):
            raise SceneError(
                "layer.poisson_ratio: found several beside an edge that is not clamped, or beside "
                "[[region]]; allowed there: one for all layers"
            )


def _stiffness(layer: Layer) -> float:
    return layer.stiffness
