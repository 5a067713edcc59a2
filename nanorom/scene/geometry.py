"""Shapes of films and the names of their sides."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import attrs

from nanorom.errors import SceneError
from nanorom.scene import fields as v
from nanorom.scene import units
from nanorom.scene.units import with_unit


@attrs.frozen(field_transformer=v.readers)
class Disc:
    """Circular film of a radius in m; its boundary is "edge"."""

    shape: ClassVar[str] = "disc"
    sides: ClassVar[tuple[str, ...]] = ("edge",)
    radius: float = attrs.field(
        converter=v.as_quantity, metadata=v.quantity("geometry.radius", "m", about="of the disc")
    )

    def holds(self, place: tuple[float, float], radius: float = 0.0) -> bool:
        """Whether a disc of a radius about a place is on the film; in m."""
        return math.hypot(*place) + radius <= self.radius


@attrs.frozen(field_transformer=v.readers)
class Rectangle:
    """Rectangular film, length along x and width along y, in m."""

    shape: ClassVar[str] = "rectangle"
    sides: ClassVar[tuple[str, ...]] = ("left", "right", "bottom", "top")
    length: float = attrs.field(
        converter=v.as_quantity, metadata=v.quantity("geometry.length", "m", about="along x")
    )
    width: float = attrs.field(
        converter=v.as_quantity,
        metadata=v.quantity("geometry.width", "m", about="along y; of a string at most its length"),
    )

    def holds(self, place: tuple[float, float], radius: float = 0.0) -> bool:
        """Whether a disc of a radius about a place is on the film; in m."""
        x, y = (abs(each) + radius for each in place)
        return 2 * x <= self.length and 2 * y <= self.width


@attrs.frozen(field_transformer=v.readers)
class String(Rectangle):
    """Narrow rectangle of length and width in m, length the larger.

    It is held at its short ends left and right unless the scene says otherwise.
    """

    shape: ClassVar[str] = "string"

    def __attrs_post_init__(self) -> None:
        if self.width > self.length:
            raise SceneError(
                f"geometry.width: found {with_unit(self.width, 'm', 6)}; allowed: at most the "
                f"length ({with_unit(self.length, 'm', 6)}) of a string"
            )


_DEFINED = re.compile(r'Name\s+"Parameters/(\w+)"')


def _parameters(value: Any) -> dict[str, float]:
    key = "geometry.parameters"
    if not isinstance(value, Mapping):
        raise units.wrong(key, value, "a table of numbers by name, such as { width = 0.1 }")
    return {str(name): units.to_si(x, "1", f"{key}.{name}") for name, x in value.items()}


def _mesh_path(value: Any) -> Path:
    key = "geometry.file"
    if not isinstance(value, (str, Path)) or str(value) == "":
        raise units.wrong(key, value, "the name of a .msh or .geo file")
    path = Path(value)
    if path.suffix not in (".msh", ".geo"):
        raise units.wrong(key, str(value), "the name of a .msh or .geo file")
    return path


@attrs.frozen(field_transformer=v.readers)
class MeshFile:
    """Film meshed by gmsh; its boundaries are the physical curves of the file.

    scale: the file's unit of length in m; parameters: numbers of a .geo by name, in place of those
    that it defines as "Parameters/NAME".
    """

    shape: ClassVar[str] = "mesh"
    sides: ClassVar[tuple[str, ...]] = ()
    file: Path = attrs.field(
        converter=v.as_path,
        metadata=v.custom(
            "geometry.file",
            _mesh_path,
            allowed="a .msh or .geo file",
            about="the film, its supports named by physical curves",
        ),
    )
    scale: float = attrs.field(
        default=1.0,
        converter=v.as_quantity,
        metadata=v.quantity("geometry.scale", "m", about="the file's unit of length"),
    )
    parameters: Mapping[str, float] | None = attrs.field(
        default=None,
        metadata=v.custom(
            "geometry.parameters",
            _parameters,
            allowed="a table of numbers",
            about="of a .geo by name, in place of those that it defines, in its unit of length",
        ),
    )

    def __attrs_post_init__(self) -> None:
        if not self.file.is_file():
            raise SceneError(f"geometry.file: found '{self.file}'; there is no such file")
        if self.parameters:
            self._check_parameters(self.parameters)

    def _check_parameters(self, given: Mapping[str, float]) -> None:
        """Raise SceneError for a parameter that the file does not define."""
        text = self.file.read_text("utf-8", "replace") if self.file.suffix == ".geo" else ""
        known = list(dict.fromkeys(_DEFINED.findall(text)))
        for name in given:
            if name not in known:
                allowed = ", ".join(known) or "none in this file"
                hint = v.did_you_mean(name, known)
                raise SceneError(f"geometry.parameters.{name}: unknown{hint}; allowed: {allowed}")


Geometry = Disc | Rectangle | String | MeshFile
SHAPES: dict[str, Any] = {"disc": Disc, "rectangle": Rectangle, "string": String, "mesh": MeshFile}


def read_geometry(table: Mapping[str, Any], directory: Path) -> Geometry:
    """Read [geometry]; the shape decides which keys it has.  Raises SceneError."""
    if "shape" not in table:
        raise SceneError(f"geometry.shape: missing; allowed: {' | '.join(SHAPES)}")
    cls = SHAPES[v.read_choice(table["shape"], "geometry.shape", SHAPES)]
    rest = {key: value for key, value in table.items() if key != "shape"}
    if cls is MeshFile and isinstance(rest.get("file"), str) and rest["file"]:
        rest["file"] = str(directory / rest["file"])
    return v.from_table(cls, "geometry", rest)
