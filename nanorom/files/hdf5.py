"""Nanorom's HDF5 files, read without trust.

What the HDF5 library does not survive is not read; shapes and types are checked before anything is
allocated, links to other files are refused, and nothing in a file is executed.  Arrays carry
checksums (HDF5's Fletcher 32), which any reader checks.  Whatever is wrong becomes one line with
the file's name.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from nanorom import version as package
from nanorom.errors import FileError, NanoromError
from nanorom.files import untrusted
from nanorom.files.untrusted import PER_BYTE, SMALL
from nanorom.files.whole import atomic_path

_left: ContextVar[list[int]] = ContextVar("left")  # bytes that may still be read of a file
WORDS_SHOWN = 300  # characters of what a library says of a file
RESULTS = "what nanorom computed of a scene, as `nanorom run SCENE -o DIR` leaves it in DIR"


@contextmanager
def create(path: str | Path, kind: str, version: int) -> Iterator[h5py.File]:
    """A new file of a nanorom format, written whole or not at all; raises FileError."""
    with new(kind, version) as file:
        yield file
        store(file, path)


@contextmanager
def new(kind: str, version: int) -> Iterator[h5py.File]:
    """A file of a nanorom format in memory: HDF5 itself does not survive a full disk."""
    with h5py.File("new", "w", driver="core", backing_store=False) as file:
        file.attrs.update(format=kind, format_version=version, nanorom_version=package.version())
        yield file


def store(file: h5py.File, path: str | Path) -> None:
    """Write a file that is in memory, whole or not at all; raises FileError."""
    file.flush()
    with atomic_path(path) as temporary:
        temporary.write_bytes(file.id.get_file_image())
    untrusted.trust(Path(path))


@contextmanager
def opened(path: str | Path, kind: str, version: int) -> Iterator[h5py.File]:
    """A file of a nanorom format to read; every error inside becomes a FileError of one line."""
    path = Path(path)
    token = None
    try:
        with _open(path) as file:
            token = _left.set([_most(file.id.get_filesize())])
            _check_format(file, kind, version)
            yield file
    except NanoromError as error:
        raise FileError(f"{path}: {error}") from None
    except Exception as error:  # whatever HDF5, NumPy or JSON find wrong with foreign bytes
        reason = " ".join(str(error).split())[:WORDS_SHOWN] or type(error).__name__
        raise FileError(f"{path}: damaged, or not a {kind} file: {reason}") from None
    finally:
        if token is not None:
            _left.reset(token)


def _most(size: int) -> int:
    """Bytes that are read of a file of a size, each time that one is read."""
    return max(SMALL, PER_BYTE * size)


def _open(path: Path) -> h5py.File:
    if path.is_dir():
        raise FileError("is a directory; give the name of a file")
    if not path.is_file():
        raise FileError("not a regular file" if path.exists() else "no such file")
    try:
        with open(path, "rb"):
            pass
    except OSError as error:
        raise FileError(f"cannot be read: {error.strerror}") from None
    untrusted.survive(path)
    try:
        return h5py.File(path, "r")
    except OSError:
        raise FileError(f"not an HDF5 file, or cut short; allowed: {RESULTS}") from None


def _check_format(file: h5py.File, kind: str, newest: int) -> None:
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
    """The format that a file says it has, "" if it is no HDF5 file; raises FileError if missing."""
    path = Path(path)
    if not path.is_file():
        missing = "is a directory; give the name of a file" if path.is_dir() else "no such file"
        raise FileError(f"{path}: {missing}")
    try:
        with _open(path) as file:
            return text(file.attrs.get("format", ""))
    except (NanoromError, OSError, RuntimeError, ValueError, TypeError):  # damaged, or another kind
        return ""


def read(
    parent: h5py.Group, name: str, shape: tuple[int | None, ...], kinds: str = "fiu"
) -> np.ndarray:
    """A dataset of the expected shape (None: any length) and kinds of type."""
    item = dataset(parent, name, shape, kinds)
    left = _left.get()
    left[0] -= item.nbytes
    if left[0] < 0:  # many names for one array, perhaps
        size = parent.file.id.get_filesize()
        raise FileError(f"{name}: with it, more is read than a file of {size} bytes can hold")
    return np.asarray(item[()])


def dataset(
    parent: h5py.Group, name: str, shape: tuple[int | None, ...], kinds: str = "fiu"
) -> h5py.Dataset:
    """The same, not yet read."""
    item = _own(parent, name)
    if not isinstance(item, h5py.Dataset):
        raise FileError(f"{name}: missing, or not a dataset of this file")
    if item.external is not None or item.is_virtual:
        raise FileError(f"{name}: its numbers are outside the file")
    # the library unpacks whole chunks, which may be larger than what they are part of
    chunk = math.prod(item.chunks or ()) * item.dtype.itemsize
    declared, size = max(item.nbytes, chunk), parent.file.id.get_filesize()
    if declared > _most(size):
        raise FileError(f"{name}: declares {declared:.1e} bytes in a file of {size:.1e}; not read")
    if len(item.shape) != len(shape) or any(
        wanted not in (None, found) for wanted, found in zip(shape, item.shape)
    ):
        wanted = ", ".join("any" if length is None else str(length) for length in shape)
        raise FileError(f"{name}: found shape {item.shape}; expected ({wanted})")
    is_text = h5py.check_string_dtype(item.dtype) is not None
    if item.dtype.kind not in kinds or (item.dtype.kind in "OS" and not is_text):
        raise FileError(f"{name}: found type {item.dtype}; expected another one")
    return item


def group(parent: h5py.Group, name: str) -> h5py.Group:
    """A group of the file."""
    item = _own(parent, name)
    if not isinstance(item, h5py.Group):
        raise FileError(f"{name}: missing, or not a group of this file")
    return item


def _own(parent: h5py.Group, name: str) -> Any:
    """A member that is in the file itself, reached by hard links only."""
    for part in name.split("/"):
        if not isinstance(parent, h5py.Group):
            return None
        link = parent.get(part, getlink=True)
        parent = parent.get(part) if isinstance(link, h5py.HardLink) else None
    return parent


def write(parent: h5py.Group, name: str, values: Any, unit: str | None = None) -> None:
    """An array, with a checksum where HDF5 can keep one, and its unit."""
    values = np.asarray(values)
    checked = {"chunks": values.shape, "fletcher32": True} if values.shape and values.size else {}
    written = parent.create_dataset(name, data=values, **checked)
    if unit is not None:
        written.attrs["unit"] = unit


def write_names(parent: h5py.Group, name: str, names: tuple[str, ...]) -> None:
    """Names as a dataset of UTF-8 strings."""
    encoded = [each.encode() for each in names]
    length = max(map(len, encoded), default=0) or 1
    write(parent, name, np.array(encoded, dtype=h5py.string_dtype("utf-8", length)))


def read_names(parent: h5py.Group, name: str, length: int | None) -> tuple[str, ...]:
    """Names written by `write_names`, or of any length."""
    return tuple(text(x) for x in read(parent, name, (length,), kinds="OSU"))


def write_attributes(parent: h5py.Group, values: Mapping[str, Any]) -> None:
    """Numbers, strings, arrays and (as JSON) dictionaries as attributes."""
    for name, value in values.items():
        is_mapping = isinstance(value, Mapping)
        parent.attrs[name] = json.dumps(value, default=float) if is_mapping else value


def read_attributes(parent: h5py.Group) -> dict[str, Any]:
    """Attributes written by `write_attributes`."""
    found: dict[str, Any] = {}
    for name, value in parent.attrs.items():
        if isinstance(value, (str, bytes)):
            words = text(value)
            found[name] = from_json(words) if words.startswith("{") else words
        elif np.asarray(value).dtype.kind in "fiub":
            found[name] = value.item() if np.ndim(value) == 0 else np.asarray(value)
        else:
            raise FileError(f"{name}: found type {type(value).__name__}; expected numbers or text")
    return found


def integer(parent: h5py.Group, name: str, low: int, high: int | None) -> int:
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
