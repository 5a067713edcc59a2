"""Regions said by layers: what is put on the film there, and what is etched off it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import attrs

from nanorom.errors import SceneError
from nanorom.scene import fields as v
from nanorom.scene import units
from nanorom.scene.film import Plate, Tension
from nanorom.scene.layers import Layer, Stack
from nanorom.scene.material import Material
from nanorom.scene.outlines import REGIONS
from nanorom.scene.region import Region
from nanorom.scene.units import with_unit

SIDES = ("top", "bottom")
FOLLOWS = tuple(field.name for field in attrs.fields(Region))


@attrs.frozen
class Bare:
    """The film that regions are parts of: its stack, and its tension (N/m) beside the stack's."""

    stack: Stack
    tension: Tension

    @classmethod
    def of(cls, stack: Stack | None, plate: Plate, material: Any, tension: Any) -> Bare | None:
        """Of a stack, or of one material; None where a crystal, or a D of its own, is no layer."""
        if stack is not None:
            return cls(stack, Tension(0.0, 0.0))
        if not isinstance(material, Material) or material.crystalline or material.bending:
            return None
        own = {name: getattr(material, name) for name in ("poisson_ratio", "density", "loss")}
        layer = Layer(plate.thickness, material.youngs_modulus, **own)
        pull = tension if isinstance(tension, Tension) else Tension(0.0, 0.0)
        return cls(Stack.of([layer]), pull)

    def with_(self, etched: float, added: Sequence[tuple[str, Layer]]) -> dict[str, Any]:
        """What a region is, by the keys of it; raises SceneError if nothing is left."""
        kept = _etched(self.stack.layers, etched)
        below = [layer for side, layer in added if side == "bottom"]
        above = [layer for side, layer in added if side == "top"]
        stack = Stack.of([*reversed(below), *kept, *above])
        film = stack.film()
        material, own = film["material"], film["tension"]
        share = 1 - etched / self.stack.thickness
        bottom = sum(layer.thickness for layer in below)
        bare = self.stack.film()["material"].loss
        share_of = (share * pull for pull in (self.tension.x, self.tension.y, self.tension.xy))
        return _keys(
            thickness=stack.thickness,
            youngs_modulus=material.youngs_modulus,
            poisson_ratio=material.poisson_ratio,
            density=material.density,
            bending=material.bending,
            bending_ratio=stack.bending_ratio,
            tension=tuple(a + b for a, b in zip(share_of, (own.x, own.y, 0.0))),
            loss=None if material.loss == bare else material.loss,
            offset=stack.neutral - bottom - self.stack.neutral,
        )


def _keys(**known: Any) -> dict[str, Any]:
    return known


def read_regions(tables: Iterable[Any], film: Bare | None) -> tuple[Region, ...]:
    """Regions of tables [[region]] on a film; raises SceneError."""
    return tuple(_read(table, film) for table in tables)


def _read(table: Any, film: Bare | None) -> Region:
    if not isinstance(table, Mapping) or "shape" not in table:
        raise SceneError(f"region.shape: missing; allowed: {' | '.join(REGIONS)}")
    cls = REGIONS[v.read_choice(table["shape"], "region.shape", REGIONS)]
    given = {key: value for key, value in table.items() if key != "shape"}
    etched, layers = given.pop("etched", None), given.pop("layer", None)
    if etched is not None or layers is not None:
        key = "region.etched" if etched is not None else "region.layer"
        for name in FOLLOWS:
            if name in given:
                raise SceneError(f"region.{name}: found beside {key}, of which it follows")
        if film is None:
            raise SceneError(
                f"{key}: found on a crystal or beside material.bending; allowed: keys "
                "of the region itself"
            )
        depth = 0.0 if etched is None else v.read_quantity(etched, "m", "region.etched", v.POSITIVE)
        given |= film.with_(depth, _layers(layers))
    return v.from_table(cls, "region", given)


def _layers(tables: Any) -> list[tuple[str, Layer]]:
    if tables is None:
        return []
    if not isinstance(tables, list):
        raise units.wrong("region.layer", tables, "tables [[region.layer]]")
    found = []
    for table in tables:
        given = dict(table) if isinstance(table, Mapping) else table
        side = "top"
        if isinstance(given, dict):
            side = v.read_choice(given.pop("side", "top"), "region.layer.side", SIDES)
        found.append((side, v.from_table(Layer, "region.layer", given)))
    return found


def _etched(layers: tuple[Layer, ...], depth: float) -> list[Layer]:
    """Layers that are left when so much is taken from the top."""
    whole = sum(layer.thickness for layer in layers)
    if not depth < whole:
        raise SceneError(
            f"region.etched: found {with_unit(depth, 'm', 6)}; allowed: less than the film's "
            f"thickness, {with_unit(whole, 'm', 6)}"
        )
    left = list(layers)
    while depth >= left[-1].thickness:
        depth -= left.pop().thickness
    if depth > 0:
        left[-1] = attrs.evolve(left[-1], thickness=left[-1].thickness - depth)
    return left
