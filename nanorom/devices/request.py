"""A study as it is asked for: what varies, how it is drawn, which quantities are wanted."""

from __future__ import annotations

import copy
import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from nanorom.devices.sampling import Sampling
from nanorom.devices.variation import Variation, variations
from nanorom.errors import NanoromError, SceneError
from nanorom.rom import quantities
from nanorom.scene import fields as v
from nanorom.scene.geometry import MeshFile
from nanorom.scene.scene import Scene
from nanorom.scene.units import wrong
from nanorom.types import Array
from nanorom.version import version

SECONDS = 600.0  # s that one device may take
DRAWN = tuple(field.name for field in attrs.fields(Sampling))
KEYS = ("vary", "of", *DRAWN, "seconds")


@attrs.frozen(eq=False)
class Request:
    """Rows of a study, and what is wanted of each.

    document: tables of the scene that is varied; directory: where its files are; rows: values of
    the variations, in their order; of: names of quantities; seconds: that a row may take.
    """

    document: dict[str, Any]
    directory: Path
    varied: list[Variation]
    rows: list[tuple[Any, ...]]
    of: tuple[str, ...]
    seconds: float

    @classmethod
    def read(cls, scene: Scene | str | Path, path: str | Path) -> Request:
        """Of a scene and a study file (TOML); raises SceneError, the file's name in front."""
        with table_at(path, KEYS) as given:
            sampling = Sampling(**{key: given.pop(key) for key in DRAWN if key in given})
            return cls.of_table(scene, given.pop("vary", {}), sampling=sampling, **given)

    @classmethod
    def of_table(
        cls,
        scene: Scene | str | Path,
        vary: Mapping[str, Any],
        of: Sequence[str] | None = None,
        sampling: Sampling | None = None,
        seconds: float = SECONDS,
    ) -> Request:
        """What keys of a study file say; raises SceneError, ModelError for a name of ``of``."""
        document, directory = tables_of(scene)
        varied = variations(vary)
        rows = (sampling or Sampling()).rows(varied)
        seconds = v.read_quantity(seconds, "1", "seconds", v.POSITIVE)
        request = cls(document, directory, varied, rows, (), seconds)
        first = request.first_valid()
        return attrs.evolve(request, of=_names(of, first))

    def tables(self, row: int) -> dict[str, Any]:
        """Tables of the scene of a row; raises SceneError."""
        document = copy.deepcopy(self.document)
        for variation, value in zip(self.varied, self.rows[row]):
            variation.put(document, value)
        return document

    def first_valid(self) -> Scene:
        """The first row's scene that makes sense; raises SceneError of the first row if none."""
        first: SceneError | None = None
        for row in range(len(self.rows)):
            try:
                return Scene.from_dict(self.tables(row), self.directory)
            except SceneError as error:
                first = first or error
        assert first is not None
        raise first

    @property
    def words(self) -> dict[str, list[str]]:
        """By key, what its values are as text where they are no numbers."""
        found = {}
        for variation in self.varied:
            if not all(_is_number(value) for value in variation.values):
                found[variation.key] = [_text(value) for value in variation.values]
        return found

    @property
    def settings(self) -> Array:
        """Values (n, p) in SI; of keys with words, the place from 0 among them."""
        table = np.empty((len(self.rows), len(self.varied)))
        words = self.words
        for column, variation, values in zip(table.T, self.varied, zip(*self.rows)):
            known = words.get(variation.key)
            column[:] = values if known is None else [known.index(_text(x)) for x in values]
        return table

    @property
    def key(self) -> str:
        """Digest of everything that the rows depend on."""
        digest = hashlib.sha256(
            repr((version(), json.dumps(self.document, default=str, sort_keys=True))).encode()
        )
        digest.update(repr((self.of, [x.key for x in self.varied], self.words)).encode())
        digest.update(self.settings.tobytes())
        scene = self.first_valid()
        files = [scene.geometry.file] if isinstance(scene.geometry, MeshFile) else []
        for file in [*files, *filter(None, [scene.plate.shape_file])]:
            digest.update(file.read_bytes() if file.is_file() else b"")
        return digest.hexdigest()


@contextmanager
def table_at(path: str | Path, keys: Sequence[str]) -> Iterator[dict[str, Any]]:
    """The table of a file (TOML) of known keys; SceneError for what is wrong with it begins with
    the file's name.
    """
    text = v.read_text(Path(path))
    try:
        given: dict[str, Any] = v.parse_toml(text)
        for key in given:
            if key not in keys:
                hint = v.did_you_mean(key, keys)
                raise SceneError(f"{key}: unknown key{hint}; allowed: {', '.join(keys)}")
        yield given
    except NanoromError as error:
        raise SceneError(f"{path}: {error}") from None


def tables_of(scene: Scene | str | Path) -> tuple[dict[str, Any], Path]:
    """A scene's tables, and where its files are."""
    if isinstance(scene, Scene):
        return v.parse_toml(scene.to_toml()), Path()
    path = Path(scene)
    text = v.read_text(path)
    try:
        return v.parse_toml(text), path.parent
    except SceneError as error:
        raise SceneError(f"{path}: {error}") from None


def _names(of: Sequence[str] | None, scene: Scene) -> tuple[str, ...]:
    """Names of quantities; raises SceneError or ModelError for those that no model has."""
    if of is None:
        if scene.modes.automatic:
            raise SceneError("of: missing beside modes.count = auto; name quantities, such as f1")
        count = range(1, len(scene.modes.numbers) + 1)
        return (*(f"f{n}" for n in count), *(f"b({n},{n},{n})" for n in count))
    if isinstance(of, str) or not v.is_list(of) or not of:
        raise wrong("of", of, "a list of names such as f1, b111")
    for name in of:
        if not isinstance(name, str):
            raise wrong("of", name, "names such as f1, b111")
        if "(" not in name:  # names of modes are known when there is a model
            quantities.quantities(name, ("",) * (99 if scene.modes.automatic else _size(scene)))
    return tuple(of)


def _size(scene: Scene) -> int:
    return len(scene.modes.numbers)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _text(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)
