"""What is wished of a device: what may change and how far, what is to be best, what must hold."""

from __future__ import annotations

import copy
import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np
from scipy.optimize import brentq

from nanorom.devices.expression import Condition, Expression
from nanorom.devices.request import SECONDS, table_at, tables_of
from nanorom.devices.variation import Variation, variations
from nanorom.errors import SceneError
from nanorom.rom import quantities
from nanorom.scene import fields as v
from nanorom.scene.geometry import MeshFile
from nanorom.scene.places import look, put
from nanorom.scene.scene import Scene
from nanorom.scene.spread import Spread, taken
from nanorom.scene.units import of_any_dimension, wrong
from nanorom.types import Array
from nanorom.version import version

MOST_MODES = 99  # that names may count, where the number of modes is not known beforehand
BETWEEN = "{ from, to } for each key, with spacing = log if wanted"


@attrs.frozen(field_transformer=v.readers)
class Settings:
    """How a design is looked for.

    starts: from which a best device is looked for; points: of a front of two objectives;
    evaluations: devices that one start may compute, those of differences not counted; seconds: that
    one device may take; hours: after which no device is begun; precision: relative, to which
    conditions are met; samples: devices by which the yield of the best is counted.
    """

    starts: int = attrs.field(default=6, metadata=v.integer("starts", 1, 1000))
    points: int = attrs.field(default=9, metadata=v.integer("points", 3, 1000))
    evaluations: int = attrs.field(default=60, metadata=v.integer("evaluations", 2, 10_000))
    seconds: float = attrs.field(default=SECONDS, metadata=v.quantity("seconds", "1"))
    hours: float = attrs.field(default=12.0, metadata=v.quantity("hours", "1"))
    precision: float = attrs.field(
        default=1e-6, metadata=v.quantity("precision", "1", v.within(1e-12, 0.1))
    )
    samples: int = attrs.field(default=0, metadata=v.integer("samples", 0, 100_000))
    seed: int = attrs.field(default=0, metadata=v.integer("seed", 0, 2**32 - 1))


SETTINGS = tuple(field.name for field in attrs.fields(Settings))
KEYS = ("vary", "minimize", "maximize", "conditions", "of", "spread", *SETTINGS)


@attrs.frozen(eq=False)
class Objective:
    """A formula that is to be small (sign 1) or large (-1)."""

    expression: Expression
    sign: float

    @property
    def text(self) -> str:
        """As it is said."""
        return f"{'minimize' if self.sign > 0 else 'maximize'} {self.expression.text}"


@attrs.frozen(eq=False)
class Wish:
    """A design as it is asked for.

    document: tables of the scene that is varied; directory: where its files are; varied: keys with
    their bounds; objectives: none, one, or two of which a front is wanted; of: further formulas
    that are told; spread: of keys in a device that is made.
    """

    document: dict[str, Any]
    directory: Path
    varied: list[Variation]
    objectives: tuple[Objective, ...]
    conditions: tuple[Condition, ...]
    of: tuple[Expression, ...]
    spread: dict[str, Spread]
    settings: Settings

    @classmethod
    def read(cls, scene: Scene | str | Path, path: str | Path) -> Wish:
        """Of a scene and a design file (TOML); raises SceneError, the file's name in front."""
        with table_at(path, KEYS) as given:
            return cls.of_table(scene, given)

    @classmethod
    def of_table(cls, scene: Scene | str | Path, given: Mapping[str, Any]) -> Wish:
        """Of a scene and the table of a design file; raises SceneError, ModelError."""
        document, directory = tables_of(scene)
        document, spread = taken(document)
        varied = variations(given.get("vary"))
        for each in varied:
            if each.ends is None or not each.ends[0] < each.ends[1]:
                raise wrong(f"vary.{each.key}", list(each.values) or each.key, BETWEEN)
        keys = [each.key for each in varied]
        units = {each.key: each.unit for each in varied}
        objectives = [
            Objective(Expression.read(text, keys, word), sign)
            for word, sign in (("minimize", 1.0), ("maximize", -1.0))
            for text in _texts(given.get(word), word)
        ]
        conditions = [
            Condition.read(text, units, f"conditions[{n}]")
            for n, text in enumerate(_texts(given.get("conditions"), "conditions"), 1)
        ]
        if len(objectives) > 2 or not objectives and not conditions:
            raise SceneError(
                f"minimize, maximize: found {len(objectives)} formulas; allowed: one, two for a "
                "front, or none beside conditions"
            )
        told = [Expression.read(text, keys, "of") for text in _texts(given.get("of"), "of")]
        settings = Settings(**{key: given[key] for key in SETTINGS if key in given})
        spread |= _of_scene(document) | _spreads(given.get("spread", {}), document)
        wish = cls(
            document,
            directory,
            varied,
            tuple(objectives),
            tuple(conditions),
            tuple(told),
            spread,
            settings,
        )
        wish.check()
        return wish

    def check(self) -> None:
        """Raise SceneError or ModelError where no device can be what is asked for."""
        scene = self.scene(self.start)
        count = MOST_MODES if scene.modes.automatic else len(scene.modes.numbers)
        for name in self.names:
            if "(" not in name:  # names of modes are known when there is a model
                quantities.quantities(name, ("",) * count)
        if not self.names:
            raise SceneError("minimize, conditions: found no quantity of a device, such as f1")
        for key, spread in self.spread.items():
            put(tables := self.tables(self.start), key, spread.mean + spread.deviation, spread.unit)
            Scene.from_dict(tables, self.directory)

    @property
    def names(self) -> tuple[str, ...]:
        """Quantities of a device that are needed."""
        each = [name for expression in self.expressions for name in expression.names]
        return tuple(dict.fromkeys(each))

    @property
    def expressions(self) -> tuple[Expression, ...]:
        """Every formula."""
        sides = [side for condition in self.conditions for side in condition.expressions]
        return (*(each.expression for each in self.objectives), *sides, *self.of)

    @property
    def told(self) -> tuple[Expression, ...]:
        """Formulas whose values are told: objectives, left sides of conditions, further ones."""
        left = [condition.left for condition in self.conditions]
        each = [*(objective.expression for objective in self.objectives), *left, *self.of]
        return tuple({expression.text: expression for expression in each}.values())

    @property
    def start(self) -> Array:
        """Places (p,) of the scene itself between the bounds; the middle where it has none."""
        return np.array([_place(each, look(self.document, each.key)) for each in self.varied])

    def setting(self, places: Array) -> Array:
        """Values (p,) in SI of the keys at places (p,) from 0 to 1 between their bounds."""
        share = np.clip(places, 0.0, 1.0)
        pairs = zip(self.varied, share)
        return np.array([float(x.quantile(np.array(s))) for x, s in pairs if x.quantile])

    def tables(self, places: Array) -> dict[str, Any]:
        """Tables of the scene at places (p,)."""
        document = copy.deepcopy(self.document)
        for variation, value in zip(self.varied, self.setting(places)):
            variation.put(document, float(value))
        return document

    def scene(self, places: Array) -> Scene:
        """The scene at places (p,); raises SceneError."""
        return Scene.from_dict(self.tables(places), self.directory)

    @property
    def key(self) -> str:
        """Digest of everything that devices depend on."""
        digest = hashlib.sha256(
            repr((version(), self.names, json.dumps(self.document, default=str))).encode()
        )
        scene = self.scene(self.start)
        files = [scene.geometry.file] if isinstance(scene.geometry, MeshFile) else []
        for file in [*files, *filter(None, [scene.plate.shape_file])]:
            digest.update(file.read_bytes())
        return digest.hexdigest()


def _texts(given: Any, key: str) -> Sequence[Any]:
    """One formula or a list of them."""
    if given is None:
        return ()
    if isinstance(given, str):
        return (given,)
    if not v.is_list(given) or isinstance(given, Mapping):
        raise wrong(key, given, "a formula, or a list of them")
    return list(given)


def _place(variation: Variation, value: Any) -> float:
    """Where a value of a scene lies between the bounds, from 0 to 1."""
    quantile, ends = variation.quantile, variation.ends
    assert quantile is not None and ends is not None
    try:
        number = of_any_dimension(value, variation.key)[0]
    except SceneError:  # a word, or nothing: the middle will do as a start
        return 0.5
    if not ends[0] < number < ends[1]:
        return 0.5
    return float(brentq(lambda share: float(quantile(np.array(share))) - number, 0.0, 1.0))


def _of_scene(document: dict[str, Any]) -> dict[str, Spread]:
    """Spreads that a scene brings as numbers, taken out of its tables; raises SceneError."""
    found = {}
    for key, moved in document.pop("spread", {}).get("deviation", {}).items():
        if set(moved) != {key}:
            raise SceneError(
                f"spread: found {key}, which moves {', '.join(moved)}; give the scene by the name "
                "of its file, which says it by itself"
            )
        mean = look(document, key)
        found[key] = Spread.of(mean, moved[key], f"spread.{key}")
    return found


def _spreads(given: Any, document: dict[str, Any]) -> dict[str, Spread]:
    """Of a table: "3 %" of what the scene has, or a whole "10 nm +- 3 %"; raises SceneError."""
    if not isinstance(given, Mapping):
        raise wrong("spread", given, 'a table such as "plate.thickness" = "3 %"')
    found = {}
    for key, value in given.items():
        known = look(document, key)
        if known is None or isinstance(known, (dict, list)):
            raise SceneError(f"spread.{key}: the scene has no quantity there")
        found[key] = Spread.of(known, value, f"spread.{key}")
    return found
