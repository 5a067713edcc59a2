"""Gates that attract a film from below or from above, each under all of it or under a patch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import attrs
import numpy as np

from nanorom.errors import SceneError
from nanorom.scene import fields as v
from nanorom.scene.outlines import REGIONS
from nanorom.scene.region import DrawnRegion, Region, overlap
from nanorom.scene.units import wrong

KEY = "load.gate"
PATCH = f"{KEY}.patch"
OUTLINE = 'a shape alone, such as { shape = "disc", radius = "1 um" }'
MOST = 50
TOUCH = 1e-9  # of a patch's size: outlines nearer than that touch
OTHER_SIDE = ("other than 0: negative on the film's other side", lambda x: x != 0)


def _patch(value: Any) -> Region:
    """A region that says nothing of the film; raises SceneError."""
    if isinstance(value, Mapping):
        if "shape" not in value:
            raise SceneError(f"{PATCH}.shape: missing; allowed: {' | '.join(REGIONS)}")
        kind = REGIONS[v.read_choice(value["shape"], f"{PATCH}.shape", REGIONS)]
        given = {key: each for key, each in value.items() if key != "shape"}
        try:
            value = v.from_table(kind, "region", given)
        except SceneError as error:
            raise SceneError(f"{PATCH}.{str(error).removeprefix('region.')}") from None
    if not isinstance(value, Region):
        raise wrong(PATCH, value, OUTLINE)
    for field in attrs.fields(Region):
        if getattr(value, field.name) != field.default:
            raise SceneError(
                f"{PATCH}.{field.name}: found; allowed: {OUTLINE}, as a gate is no part of the film"
            )
    return value


@attrs.frozen(field_transformer=v.readers)
class Gate:
    """A plane gate in parallel to the film, at a voltage against it; edge effects are left out.

    gap : in m from the flat film, towards positive w, negative on the other side; voltage : in V at
    rest; patch : outline within which it lies, None for all of the film.  Raises SceneError.
    """

    gap: float = attrs.field(
        converter=v.as_quantity,
        metadata=v.quantity(
            f"{KEY}.gap", "m", OTHER_SIDE, about="of the gate from the flat film, towards w > 0"
        ),
    )
    voltage: float = attrs.field(
        default=0.0,
        converter=v.as_quantity,
        metadata=v.quantity(f"{KEY}.voltage", "V", v.ANY, about="at rest, against the film"),
    )
    patch: Region | None = attrs.field(
        default=None,
        metadata=v.custom(
            PATCH, _patch, allowed=OUTLINE, about="where it lies; left out, under all of the film"
        ),
    )


def read_gates(value: Any) -> tuple[Gate, ...]:
    """Gates of tables [[load.gate]], or as they are; raises SceneError."""
    if isinstance(value, Gate):
        value = (value,)
    if isinstance(value, Mapping) or not v.is_list(value):
        raise wrong(KEY, value, f"tables [[{KEY}]]")
    if not 1 <= len(value) <= MOST:
        raise SceneError(f"{KEY}: found {len(value)} gates; allowed: 1 to {MOST}")
    gates = tuple(
        each if isinstance(each, Gate) else v.from_table(Gate, KEY, each) for each in value
    )
    for (i, first), (j, second) in combinations(enumerate(gates, 1), 2):
        if first.gap * second.gap > 0 and _meet(first.patch, second.patch):
            raise SceneError(
                f"{KEY}: found {i} and {j} on one another, of which one screens the other; "
                "allowed: gates that touch at most, or on both sides of the film"
            )
    return gates


def as_gates(value: Gate | Sequence[Gate] | None) -> tuple[Gate, ...] | None:
    """Gates, or None; what they may be given as, for type checkers."""
    return None if value is None else read_gates(value)


def _meet(first: Region | None, second: Region | None) -> bool:
    """Two patches have an area in common, as far as their outlines tell."""
    if first is None or second is None:
        return True
    if not (isinstance(first, DrawnRegion) and isinstance(second, DrawnRegion)):
        return first == second
    size = max(float(np.ptp(each.outline(), axis=0).max()) for each in (first, second))
    return overlap(first, second, TOUCH * size)
