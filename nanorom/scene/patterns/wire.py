"""A current in a magnetic field: the magnetomotive drive of conducting strings and films."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from nanorom.errors import SceneError
from nanorom.scene import fields as v
from nanorom.scene.patterns.pattern import DirectPattern, Force, Operator, VirtualWork
from nanorom.scene.units import wrong

WIRE_KEY = "drive.wire"
PANELS = 32  # of each straight part, with Gauss points: shapes are smooth within cells
POINTS = 4

Path = tuple[tuple[float, float], ...]


def _read_path(value: Any) -> Path:
    if not v.is_list(value) or len(value) < 2:
        raise wrong(WIRE_KEY, value, 'two places or more, such as [["-1 um", 0], ["1 um", 0]]')
    path = tuple(v.read_place(each, f"{WIRE_KEY}[{n}]") for n, each in enumerate(value, 1))
    if any(start == end for start, end in zip(path, path[1:])):
        raise SceneError(f"{WIRE_KEY}: found one place twice in a row; allowed: places apart")
    return path


@attrs.frozen
class Wire(DirectPattern):
    """A current along a wire on the film, its level in A, in a magnetic field.

    The field, in T, lies in the film's plane and across the wire: each metre of it feels a newton
    across the plane per tesla and ampere, J_r = field int phi_r ds.  wire : places (x, y) in m
    that straight parts join.
    """

    name = "magnetomotive"
    unit = "A"

    field: float = attrs.field(
        metadata=v.quantity("drive.field", "T", about="magnetic field in the plane, across a wire")
    )
    wire: Path = attrs.field(
        metadata=v.custom(
            WIRE_KEY,
            _read_path,
            allowed="a list of two places or more",
            about="x and y of the places that the straight parts of a wire join",
            unit="m",
        )
    )

    def force(self, work: VirtualWork[Force, Operator]) -> Force:
        inside, weight = np.polynomial.legendre.leggauss(POINTS)
        along = ((np.arange(PANELS)[:, None] + 0.5 * (inside + 1)) / PANELS).ravel()
        share = np.tile(0.5 * weight / PANELS, PANELS)
        places = np.array(self.wire)
        parts = list(zip(places, places[1:]))
        points = np.concatenate([a + along[:, None] * (b - a) for a, b in parts])
        lengths = np.concatenate([np.linalg.norm(b - a) * share for a, b in parts])
        return work.points(points, self.field * lengths, WIRE_KEY)
