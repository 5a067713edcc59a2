"""Scenes: geometry, film, supports and what is asked of them, in SI units and validated.

A scene comes from a TOML file or from Python; both give the same frozen objects::

    scene = Scene.from_file("drum.toml")
    scene = Scene(
        geometry=Disc(radius="2.5 um"),
        plate=Plate(thickness="10 nm"),
        material=Material(youngs_modulus="410 GPa", poisson_ratio=0.16, density="2267 kg/m^3"),
        tension=Tension(x="0.321 N/m", y="0.257 N/m"),
        modes=Modes(count=11),
    )

Values with units are strings; plain numbers are in SI. Every attribute is a plain SI number.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import attrs

from nanorom.errors import SceneError
from nanorom.scene import fields as v
from nanorom.scene import units
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Damping, Sweep, check_complete
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import (
    Disc,
    Geometry,
    MeshFile,
    Rectangle,
    String,
    read_geometry,
)
from nanorom.scene.instrument import Instrument
from nanorom.scene.layers import Stack
from nanorom.scene.load import Load
from nanorom.scene.mass import AddedMass
from nanorom.scene.material import Gas, Material
from nanorom.scene.outlines import (
    DiscRegion,
    PolygonRegion,
    RectangleRegion,
    RingRegion,
    SurfaceRegion,
)
from nanorom.scene.pads import Bare, read_regions
from nanorom.scene.region import Region
from nanorom.scene.request import MOST_MODES, Accuracy, Modes, Reduction
from nanorom.scene.rules import check_film, check_source
from nanorom.scene.spread import Spreads, resolved, taken
from nanorom.scene.support import (
    STRING_ENDS,
    Edge,
    Kind,
    PlaneSpring,
    Spring,
    Support,
)

__all__ = [
    "MOST_MODES",
    "Accuracy",
    "AddedMass",
    "Damping",
    "Disc",
    "DiscRegion",
    "Drive",
    "Edge",
    "Gas",
    "Instrument",
    "Load",
    "Material",
    "MeshFile",
    "Modes",
    "PlaneSpring",
    "Plate",
    "PolygonRegion",
    "Rectangle",
    "RectangleRegion",
    "Reduction",
    "Region",
    "RingRegion",
    "Scene",
    "Spring",
    "String",
    "Support",
    "SurfaceRegion",
    "Sweep",
    "Tension",
]


def _section(key: str, kind: Any) -> dict[str, Any]:
    """Metadata of a field of a scene that holds one section."""

    def check(value: Any) -> Any:
        if not isinstance(value, kind):
            name = getattr(kind, "__name__", "Disc | Rectangle | String | MeshFile")
            raise units.wrong(key, value, f"an object of class {name}")
        return value

    return {v.READER: check}


def _sections(name: str, kind: type) -> dict[str, Any]:
    """Metadata of a field of a scene that holds several sections [[name]]."""

    def check(value: Any) -> Any:
        for each in value if v.is_list(value) else (value,):
            if not isinstance(each, kind):
                raise units.wrong(name, each, f"objects of class {kind.__name__}")
        return tuple(value) if v.is_list(value) else (value,)

    return {v.READER: check, v.TABLES: name}


class _Loaded(type):
    """`Scene.load(path)` reads a file, although ``load`` of a scene is its section [load]."""

    @property
    def load(cls) -> Any:
        return cls.from_file  # type: ignore[attr-defined]


@attrs.frozen(kw_only=True, field_transformer=v.readers)
class Scene(metaclass=_Loaded):
    """Everything that is known and asked about one device; valid by construction."""

    geometry: Geometry = attrs.field(
        metadata=_section("geometry", (Disc, Rectangle, String, MeshFile))
    )
    plate: Plate = attrs.field(metadata=_section("plate", Plate))
    material: Material = attrs.field(metadata=_section("material", Material))
    tension: Tension = attrs.field(default=Tension(0.0, 0.0), metadata=_section("tension", Tension))
    support: Support = attrs.field(metadata=_section("support", Support))
    modes: Modes = attrs.field(metadata=_section("modes", Modes))
    reduction: Reduction = attrs.field(
        default=Reduction(), metadata=_section("reduction", Reduction)
    )
    accuracy: Accuracy = attrs.field(default=Accuracy(), metadata=_section("accuracy", Accuracy))
    masses: tuple[AddedMass, ...] = attrs.field(default=(), metadata=_sections("mass", AddedMass))
    regions: tuple[Region, ...] = attrs.field(default=(), metadata=_sections("region", Region))
    load: Load | None = attrs.field(default=None, metadata=_section("load", Load))
    gas: Gas | None = attrs.field(default=None, metadata=_section("gas", Gas))
    damping: Damping | None = attrs.field(metadata=_section("damping", Damping) | v.OPTIONAL)
    drive: Drive | None = attrs.field(default=None, metadata=_section("drive", Drive))
    sweep: Sweep | None = attrs.field(default=None, metadata=_section("sweep", Sweep))
    readout: Instrument | None = attrs.field(default=None, metadata=_section("readout", Instrument))
    spread: Spreads | None = attrs.field(default=None, metadata=_section("spread", Spreads))

    @support.default
    def _usual_support(self) -> Support:
        return STRING_ENDS if isinstance(self.geometry, String) else Support()

    @damping.default
    def _damped_by_losses(self) -> Damping | None:
        return Damping() if self.lossy else None

    def __attrs_post_init__(self) -> None:
        sides = self.geometry.sides
        if sides:
            for name in self.support.named:
                if name not in sides:
                    hint = v.did_you_mean(name, sides)
                    raise SceneError(
                        f"support.{name}: unknown side of a {self.geometry.shape}{hint}; "
                        f"allowed: {', '.join(sides)}, default"
                    )
        check_film(self)
        if not self.flat and self.reduction.method == "tangent":
            raise SceneError(
                "reduction.method: found tangent for a film that is not flat; "
                "allowed: direct | step"
            )
        if self.modes.automatic:
            self._check_automatic()
        elif self.damping is not None:
            self.damping.per_mode(len(self.modes.numbers))
        if not self.flat and self.reduction.in_plane == "fixed":
            raise SceneError(
                "reduction.in_plane: found fixed for a film that is not flat; allowed: free, as "
                "such a film moves in its plane already in its linear modes"
            )
        if self.damping is not None and self.damping.idle and not self.lossy:
            if self.drive is not None or self.sweep is not None:
                raise SceneError(
                    "damping.quality_factor: missing; allowed: one for all modes or one per mode, "
                    "or none beside material.loss, material.expansion, [gas] or support.impedance"
                )
            object.__setattr__(self, "damping", None)
        check_complete(self.damping, self.drive, self.sweep)
        check_source(self)

    def _check_automatic(self) -> None:
        """Raise SceneError if there is no response that could choose the modes."""
        for name in ("damping", "drive", "sweep"):
            if getattr(self, name) is None:
                raise SceneError(
                    f"modes.count: found auto without [{name}]; allowed: auto with [damping], "
                    "[drive] and [sweep], whose response asks for modes, or a count"
                )
        assert self.damping is not None
        given = self.damping.quality_factor or ()
        if len(given) > 1:
            raise SceneError(
                f"damping.quality_factor: found {len(given)} values beside "
                "modes.count = auto; allowed: one for all modes"
            )
        if not self.plate.rules.larger:
            raise SceneError(
                f"modes.count: found auto beside plate.model = {self.plate.model}; allowed: a "
                "count, or another model"
            )

    @property
    def flat(self) -> bool:
        """Neither a load nor an initial shape takes the film out of its plane."""
        return self.load is None and self.plate.initial_shape is None

    @property
    def patches(self) -> tuple[Region, ...]:
        """Regions, and outlines of gates: cells follow the edges of all of them."""
        return self.regions + (self.load.patches if self.load is not None else ())

    @property
    def lossy(self) -> bool:
        """The film's material, the gas about it or its frame damps every mode."""
        return self.bends_with_loss or bool(self.gas or self.support.impedance)

    @property
    def bends_with_loss(self) -> bool:
        """Bending takes energy out of every mode."""
        lossy = self.material.lossy or any(region.loss for region in self.regions)
        return lossy and self.plate.bends is not False

    @property
    def supports(self) -> dict[str, Kind]:
        """Kind of support by side; for a mesh file by tag, with the key "default" for the rest."""
        return supports_of(self.geometry, self.support)

    @classmethod
    def from_file(cls, path: str | Path) -> Scene:
        """Read a scene file; raises SceneError, with the file's name in front."""
        path = Path(path)
        text = v.read_text(path)
        try:
            return cls.from_toml(text, path.parent)
        except SceneError as error:
            raise SceneError(f"{path}: {error}") from None

    @classmethod
    def of(cls, scene: Scene | str | Path | Mapping[str, Any]) -> Scene:
        """A scene as it is, of tables, or read from the file of a name; raises SceneError."""
        if isinstance(scene, Scene):
            return scene
        if isinstance(scene, Mapping):
            return cls.from_dict(scene)
        if isinstance(scene, (str, Path)):
            return cls.from_file(scene)
        raise SceneError(
            f"scene: found {type(scene).__name__}; allowed: a Scene, its tables, or the name of a "
            "scene file"
        )

    @classmethod
    def from_toml(cls, text: str, directory: str | Path = ".") -> Scene:
        """Read a scene from TOML text; mesh files are looked up in the directory."""
        return cls.from_dict(v.parse_toml(text), directory)

    @classmethod
    def from_dict(cls, document: Mapping[str, Any], directory: str | Path = ".") -> Scene:
        """Read a scene from nested dictionaries as TOML gives them; raises SceneError."""
        plain, spreads = taken(document)
        scene = cls._of_means(plain, directory)
        if not spreads:
            return scene
        if scene.spread is not None:
            raise SceneError("spread: found beside quantities with +-; allowed: one of the two")
        read = partial(cls._of_means, directory=directory)
        return attrs.evolve(scene, spread=resolved(plain, spreads, read))

    @classmethod
    def _of_means(cls, document: Mapping[str, Any], directory: str | Path) -> Scene:
        """Of tables that have means alone."""
        stack, document = Stack.taken(document)
        keys = {f.metadata.get(v.TABLES, f.name): f for f in attrs.fields(cls)}
        for name, table in document.items():
            if name not in keys:
                hint = v.did_you_mean(name, keys)
                raise SceneError(
                    f"{name}: unknown section{hint}; allowed: {', '.join([*keys, 'layer'])}"
                )
            several = v.TABLES in keys[name].metadata
            if several and not isinstance(table, list):
                raise units.wrong(name, table, f"tables [[{name}]]")
            if not several and not isinstance(table, Mapping):
                raise units.wrong(name, table, f"a table [{name}]")
        for name in ("geometry", "modes") if stack else ("geometry", "plate", "material", "modes"):
            if name not in document:
                raise SceneError(f"{name}: missing section [{name}]")
        table = dict(document.pop("plate", {}))
        if isinstance(table.get("initial_shape"), str) and table["initial_shape"]:
            table["initial_shape"] = str(Path(directory) / table["initial_shape"])
        plate = stack.plate(table) if stack else v.from_table(Plate, "plate", table)
        pull = document.get("tension")
        if isinstance(pull, Mapping) and isinstance(pull.get("variation"), str):
            document["tension"] = {**pull, "variation": str(Path(directory) / pull["variation"])}
        given: dict[str, Any] = {"plate": plate, **(stack.film() if stack else {})}
        regions = document.pop("region", ())
        for name, table in document.items():
            if name == "geometry":
                given[name] = read_geometry(table, Path(directory))
            elif name == "tension":
                given[name] = Tension.from_table(table, plate)
            elif name == "material":
                given[name] = Material.from_table(table, plate)
            elif name == "support":
                given[name] = Support.from_table(table, document["geometry"].get("shape"))
            elif isinstance(table, list):
                read = [v.from_table(_CLASSES[name], name, each) for each in table]
                given[keys[name].name] = tuple(read)
            else:
                given[name] = v.from_table(_CLASSES[name], name, table)
        if stack and "support" in given:
            kinds = supports_of(given["geometry"], given["support"]).values()
            given |= {"load": stack.loaded(given.get("load"), kinds)}
        bare = Bare.of(stack, plate, given.get("material"), given.get("tension"))
        scene = cls(**given, regions=read_regions(regions, bare))
        if stack:
            stack.check(scene.supports.values(), parted=bool(regions))
        return scene

    def with_(
        self,
        *,
        method: str | None = None,
        in_plane: str | None = None,
        solver: str | None = None,
        modes: Any = None,
        tolerance: Any = None,
        degree: int | None = None,
        mesh_size: Any = None,
        **sections: Any,
    ) -> Scene:
        """A copy with some settings or whole sections changed, validated anew.

        ``modes`` is a count or a list of mode numbers; ``degree`` and ``mesh_size`` take the
        place of a tolerance and the other way round.  Raises SceneError.
        """
        reduction = {"method": method, "in_plane": in_plane, "solver": solver}
        changes = {name: value for name, value in reduction.items() if value is not None}
        if changes:
            sections["reduction"] = attrs.evolve(self.reduction, **changes)
        if isinstance(modes, Modes):
            sections["modes"] = modes
        elif modes is not None:
            sections["modes"] = Modes(select=modes) if v.is_list(modes) else Modes(count=modes)
        if tolerance is not None:
            response = self.accuracy.response
            sections["accuracy"] = Accuracy(tolerance, degree, mesh_size, response)
        elif degree is not None or mesh_size is not None:
            sections["accuracy"] = Accuracy(
                degree=self.accuracy.degree if degree is None else degree,
                mesh_size=self.accuracy.mesh_size if mesh_size is None else mesh_size,
                response=self.accuracy.response,
            )
        return attrs.evolve(self, **sections)

    def to_toml(self) -> str:
        """The scene as TOML in SI numbers; reading it gives an equal scene."""
        return v.to_tables(self)


def supports_of(geometry: Geometry, support: Support) -> dict[str, Kind]:
    """Kind of support by side of a shape; of a mesh file by tag, "default" for the rest."""
    if geometry.sides:
        return {side: support.kind(side) for side in geometry.sides}
    return {**support.named, "default": support.default}


_CLASSES: dict[str, Any] = {
    "modes": Modes,
    "reduction": Reduction,
    "accuracy": Accuracy,
    "mass": AddedMass,
    "load": Load,
    "gas": Gas,
    "damping": Damping,
    "drive": Drive,
    "sweep": Sweep,
    "readout": Instrument,
    "spread": Spreads,
}
