"""Nanorom's HDF5 files: written by the HDF5 library, read without trust and without it.

Shapes and types are checked before numbers are read, links to other names and files are refused,
and nothing in a file is executed. Arrays carry HDF5's own checksums (Fletcher 32), which any reader
checks. Whatever is wrong becomes one line with the file's name.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import nanorom
from nanorom.errors import FileError, NanoromError
from nanorom.files import atomic_path
from nanorom.hdf5format import Bytes, Dataset, Group, Type

if TYPE_CHECKING:
    import h5py

OLDEST = "earliest"  # form of the file, which every reader knows
WORDS_SHOWN = 300  # characters of what a library says of a file


@contextmanager
def create(path: str | Path, kind: str, version: int) -> Iterator[h5py.File]:
    """A new file of a nanorom format, written whole or not at all; raises FileError."""
    with new(kind, version) as file:
        yield file
        store(file, path)


@contextmanager
def new(kind: str, version: int) -> Iterator[h5py.File]:
    """A file of a nanorom format in memory: HDF5 itself does not survive a full disk."""
    import h5py

    with h5py.File("new", "w", driver="core", backing_store=False, libver=OLDEST) as file:
        file.attrs.update(format=kind, format_version=version, nanorom_version=nanorom.__version__)
        yield file


def store(file: h5py.File, path: str | Path) -> None:
    """Write a file that is in memory, whole or not at all; raises FileError."""
    file.flush()
    with atomic_path(path) as temporary:
        temporary.write_bytes(file.id.get_file_image())


@contextmanager
def opened(path: str | Path, kind: str, version: int) -> Iterator[Group]:
    """A file of a nanorom format to read; every error inside becomes a FileError of one line."""
    path = Path(path)
    try:
        with _root(path) as file:
            _check_format(file, kind, version)
            yield file
    except NanoromError as error:
        raise FileError(f"{path}: {error}") from None
    except Exception as error:  # whatever NumPy or JSON find wrong with foreign bytes
        reason = " ".join(str(error).split())[:WORDS_SHOWN] or type(error).__name__
        raise FileError(f"{path}: damaged, or not a {kind} file: {reason}") from None


@contextmanager
def _root(path: Path) -> Iterator[Group]:
    if path.is_dir():
        raise FileError("is a directory; give the name of a file")
    if not path.is_file():
        raise FileError("not a regular file" if path.exists() else "no such file")
    try:
        with open(path, "rb") as file:
            yield Bytes(file).root()
    except OSError as error:
        raise FileError(f"cannot be read: {error.strerror}") from None


def _check_format(file: Group, kind: str, newest: int) -> None:
    found = text(file.attrs.get("format", ""))
    if found != kind:
        raise FileError(f"an HDF5 file of format {found!r}; expected {kind!r}")
    version = integer(file, "format_version", 1, None)
    if version > newest:
        raise FileError(
            f"format_version: found {version}, this nanorom reads up to {newest}; "
            "use a newer nanorom"
        )


def kind_of(path: str | Path) -> str:
    """The format that a file says it has, "" if it has none; raises FileError if not readable."""
    path = Path(path)
    if not path.is_file() or not os.access(path, os.R_OK):
        with opened(path, "", 0):
            pass
    try:
        with _root(path) as file:
            return text(file.attrs.get("format", ""))
    except (NanoromError, ValueError):
        return ""


def read(
    parent: Group, name: str, shape: tuple[int | None, ...], kinds: str = "fiu"
) -> np.ndarray:
    """A dataset of the expected shape (None: any length) and kinds of type."""
    item = dataset(parent, name, shape, kinds)
    try:
        return item.read()
    except FileError as error:
        raise FileError(f"{name}: {error}") from None


def dataset(
    parent: Group, name: str, shape: tuple[int | None, ...], kinds: str = "fiu"
) -> Dataset:
    """The same, not yet read."""
    item = _own(parent, name)
    if not isinstance(item, Dataset):
        raise FileError(f"{name}: missing, or not a dataset of this file")
    if len(item.shape) != len(shape) or any(
        wanted not in (None, found) for wanted, found in zip(shape, item.shape)
    ):
        wanted = ", ".join("any" if length is None else str(length) for length in shape)
        raise FileError(f"{name}: found shape {item.shape}; expected ({wanted})")
    if item.type.kind not in kinds:
        raise FileError(f"{name}: found type {item.type.name}; expected another one")
    return item


def group(parent: Group, name: str) -> Group:
    """A group of the file."""
    item = _own(parent, name)
    if not isinstance(item, Group):
        raise FileError(f"{name}: missing, or not a group of this file")
    return item


def _own(parent: Group, name: str) -> Group | Dataset | None:
    """A member that is in the file itself."""
    found: Group | Dataset | None = parent
    try:
        for part in name.split("/"):
            found = found.get(part) if isinstance(found, Group) else None
    except FileError as error:
        raise FileError(f"{name}: {error}") from None
    return found


def write(parent: h5py.Group, name: str, values: Any, unit: str | None = None) -> None:
    """An array, with a checksum where HDF5 can keep one, and its unit."""
    values = np.asarray(values)
    checked = {"chunks": values.shape, "fletcher32": True} if values.shape and values.size else {}
    written = parent.create_dataset(name, data=values, **checked)
    if unit is not None:
        written.attrs["unit"] = unit


def write_names(parent: h5py.Group, name: str, names: tuple[str, ...]) -> None:
    """Names as a dataset of UTF-8 strings."""
    import h5py

    encoded = [each.encode() for each in names]
    length = max(map(len, encoded), default=0) or 1
    write(parent, name, np.array(encoded, dtype=h5py.string_dtype("utf-8", length)))


def read_names(parent: Group, name: str, length: int | None) -> tuple[str, ...]:
    """Names written by `write_names`."""
    return tuple(map(text, read(parent, name, (length,), kinds="S")))


def write_attributes(parent: h5py.Group, values: Mapping[str, Any]) -> None:
    """Numbers, strings, arrays and (as JSON) dictionaries as attributes."""
    for name, value in values.items():
        is_mapping = isinstance(value, Mapping)
        parent.attrs[name] = json.dumps(value, default=float) if is_mapping else value


def read_attributes(parent: Group) -> dict[str, Any]:
    """Attributes written by `write_attributes`."""
    found: dict[str, Any] = {}
    for name, value in parent.attrs.items():
        if isinstance(value, (str, bytes)):
            words = text(value)
            found[name] = from_json(words) if words.startswith("{") else words
        elif not isinstance(value, Type) and np.asarray(value).dtype.kind in "fiub":
            found[name] = value.item() if np.ndim(value) == 0 else np.asarray(value)
        else:
            kind = value if isinstance(value, Type) else "array of text"
            raise FileError(f"{name}: found type {kind}; expected numbers or text")
    return found


def integer(parent: Group, name: str, low: int, high: int | None) -> int:
    """An attribute that is a whole number in a range."""
    value: Any = parent.attrs.get(name)
    whole = isinstance(value, (int, np.integer))
    if not whole or value < low or (high is not None and value > high):
        shown = value.item() if isinstance(value, np.generic) else value
        raise FileError(f"{name}: found {shown!r}; expected an integer from {low}")
    return int(value)


def from_json(words: str) -> dict[str, Any]:
    """A JSON object."""
    value = json.loads(words)
    if not isinstance(value, dict):
        raise FileError("expected a JSON object in an attribute")
    return value


def text(value: Any) -> str:
    """A string as HDF5 gives it."""
    return value.decode() if isinstance(value, bytes) else str(value)
