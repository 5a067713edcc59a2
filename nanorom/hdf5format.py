"""The part of the HDF5 file format that nanorom writes, read without the HDF5 library.

The library is not made for bytes from strangers: one changed byte may crash it, or make it allocate
gigabytes or run forever.  Here every address is checked against the file, and all that is read of
a file is counted against its size.  Source: The HDF Group, HDF5 File Format Specification,
version 3.0; section numbers are its own.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from functools import cached_property
from typing import Any, BinaryIO

import attrs
import numpy as np

from nanorom.errors import FileError

SIGNATURE = b"\x89HDF\r\n\x1a\n"
LEAST_READ = 2**26  # bytes that may be read of any file
PER_BYTE = 100  # bytes that may be read per byte of a file; compressed data are rarely denser
MOST_READ = 2**33  # bytes that may be read of the largest file
NOWHERE = 2**64 - 1  # address of what was never written
BLOCK = 2**20  # words of a checksum whose sums fit into 64 bits
DATASPACE, DATATYPE, LINK_INFO, LINK, EXTERNAL, LAYOUT = 0x01, 0x03, 0x02, 0x06, 0x07, 0x08
FILTERS, ATTRIBUTE, CONTINUATION, SYMBOL_TABLE, ATTRIBUTE_INFO = 0x0B, 0x0C, 0x10, 0x11, 0x15
DEFLATE, SHUFFLE, FLETCHER32 = 1, 2, 3
FOREIGN = "bitfield", "opaque", "compound", "reference", "enumeration", "variable-length", "array"
NEWER = (
    "kept in a form of HDF5 that nanorom does not read; save it again, with h5py's default libver"
)
LINKED = "holds links to other files, which are not followed, or is " + NEWER


@attrs.frozen(repr=False)
class Type:
    """What an element is: a NumPy type if it can be read, else None with a name."""

    name: str
    size: int
    dtype: np.dtype | None = None
    variable: bool = False  # text kept in the global heap

    def __repr__(self) -> str:
        return self.name

    @property
    def kind(self) -> str:
        """NumPy's letter, S for text of any length, V for what cannot be read."""
        return "S" if self.variable else "V" if self.dtype is None else self.dtype.kind


class Bytes:
    """A file of which a bounded number of bytes is read."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self.size = file.seek(0, 2)
        self._left = min(max(LEAST_READ, PER_BYTE * self.size), MOST_READ)
        self.objects: dict[int, Group | Dataset] = {}
        self._heaps: dict[int, dict[int, bytes]] = {}

    def take(self, at: int, length: int) -> bytes:
        """Bytes at an address; raises FileError if they are not in the file."""
        if at + length > self.size:
            raise FileError("cut short, or an address outside the file")
        self.spend(length)
        self._file.seek(at)
        found = self._file.read(length)
        if len(found) != length:
            raise FileError("cut short while it was read")
        return found

    def spend(self, length: int) -> None:
        """Count bytes; raises FileError beyond what a file of this size may hold."""
        self._left -= length
        if self._left < 0:
            raise FileError(f"holds more than a file of {self.size} bytes can; not read")

    def root(self) -> Group:
        """The group of all others (II.A)."""
        if self.size < 96 or self.take(0, 8) != SIGNATURE:
            raise FileError("not an HDF5 file, or cut short")
        head = Cursor(self.take(8, 88))
        version, _, _, _, _, offsets, lengths, _ = head.bytes(8)
        if version > 1:
            raise FileError(NEWER)
        head.skip(8 if version == 0 else 12)
        base, _, end, _ = head.numbers(8, 4)
        head.skip(8)
        if (offsets, lengths, base) != (8, 8, 0):
            raise FileError(NEWER)
        if end > self.size:
            raise FileError(f"not an HDF5 file, or cut short: {self.size} of {end} bytes")
        found = self.object(head.number(8))
        if not isinstance(found, Group):
            raise FileError("has no group to begin with")
        return found

    def object(self, at: int) -> Group | Dataset:
        """The group or dataset whose header is at an address."""
        if at not in self.objects:
            messages = list(self._messages(at))
            kinds = {kind for kind, _ in messages}
            is_group = kinds & {SYMBOL_TABLE, LINK_INFO, LINK}
            if is_group:
                self.objects[at] = Group(self, messages)
            else:
                self.objects[at] = Dataset(self, messages)
        return self.objects[at]

    def _messages(self, at: int) -> Iterator[tuple[int, Cursor]]:
        """Kind and content of an object header's messages (IV.A.1.a)."""
        head = Cursor(self.take(at, 16))
        if head.number(1) != 1:
            raise FileError(NEWER)
        head.skip(1)
        count, _, length = head.number(2), head.number(4), head.number(4)
        blocks, seen = [(at + 16, length)], set[int]()
        while blocks:
            start, length = blocks.pop()
            if start in seen:
                raise FileError("an object header that leads back to itself")
            seen.add(start)
            block = Cursor(self.take(start, length))
            while count and block.left >= 8:
                kind, size, flags = block.number(2), block.number(2), block.number(1)
                block.skip(3)
                content = Cursor(block.bytes(size))
                count -= 1
                if flags & 2:
                    raise FileError("a part shared between objects, which nanorom does not read")
                if kind == CONTINUATION:
                    blocks.append((content.number(8), content.number(8)))
                else:
                    yield kind, content
        if count:
            raise FileError("an object header that is cut short")

    def tree(self, at: int, kind: int, key: int) -> Iterator[tuple[Cursor, int]]:
        """Key and address of every leaf of a B-tree (III.A.1), whose keys have so many bytes."""
        nodes: list[tuple[int, int | None]] = [(at, None)]
        seen: set[int] = set()
        while nodes:
            at, expected = nodes.pop()
            if at in seen:
                raise FileError("a tree that leads back to itself")
            seen.add(at)
            head = Cursor(self.take(at, 24))
            name, found, level, count = head.bytes(4), *head.numbers(1, 2), head.number(2)
            if name != b"TREE" or found != kind or expected not in (None, level):
                raise FileError("a tree without leaves where one should be")
            node = Cursor(self.take(at + 24, count * (key + 8)))
            for _ in range(count):
                first, child = Cursor(node.bytes(key)), node.number(8)
                if level:
                    nodes.append((child, level - 1))
                else:
                    yield first, child

    def text(self, reference: Cursor) -> bytes:
        """A string of the global heap (III.E)."""
        length, at, index = reference.number(4), reference.number(8), reference.number(4)
        if length == 0:
            return b""
        if at not in self._heaps:
            self._heaps[at] = dict(self._heap(at))
        found = self._heaps[at].get(index, b"")
        if len(found) < length:
            raise FileError("a string that is not where it should be")
        self.spend(length)
        return found[:length]

    def _heap(self, at: int) -> Iterator[tuple[int, bytes]]:
        head = Cursor(self.take(at, 16))
        name, _, size = head.bytes(4), head.number(4), head.number(8)
        if name != b"GCOL" or size < 16:
            raise FileError("a string that is not where it should be")
        heap = Cursor(self.take(at + 16, size - 16))
        while heap.left >= 16:
            index, _, length = heap.number(2), heap.number(6), heap.number(8)
            if index == 0:  # what is left free
                return
            yield index, heap.bytes(length)
            heap.skip(min(-length % 8, heap.left))


class Cursor:
    """Bytes taken one field after the other; raises FileError at the end."""

    def __init__(self, data: bytes) -> None:
        self._data, self._at = data, 0

    @property
    def left(self) -> int:
        """Bytes that were not taken."""
        return len(self._data) - self._at

    def bytes(self, length: int) -> bytes:
        """The next bytes."""
        if length > self.left:
            raise FileError("a part that is cut short")
        self._at += length
        return self._data[self._at - length : self._at]

    def skip(self, length: int) -> None:
        """Leave bytes out."""
        self.bytes(length)

    def number(self, size: int) -> int:
        """An unsigned integer of some bytes."""
        return int.from_bytes(self.bytes(size), "little")

    def numbers(self, size: int, count: int) -> tuple[int, ...]:
        """Several of them."""
        return tuple(self.number(size) for _ in range(count))


class _Object:
    """What groups and datasets have in common: attributes."""

    def __init__(self, file: Bytes, messages: list[tuple[int, Cursor]]) -> None:
        self.file = file
        self._found = dict(reversed(messages))
        self._attributes = [content for kind, content in messages if kind == ATTRIBUTE]
        if ATTRIBUTE_INFO in self._found:
            raise FileError(NEWER)

    @cached_property
    def attrs(self) -> dict[str, Any]:
        """Attributes (IV.A.2.m): text, numbers, arrays; a Type for what cannot be read."""
        return dict(map(self._attribute, self._attributes))

    def _attribute(self, message: Cursor) -> tuple[str, Any]:
        version, flags = message.numbers(1, 2)
        sizes = message.numbers(2, 3)
        if version not in (1, 2, 3) or (version > 1 and flags):
            raise FileError(NEWER)
        message.skip(version == 3)
        parts = []
        for size in sizes:
            parts.append(message.bytes(size))
            message.skip(-size % 8 if version == 1 else 0)
        name = parts[0].partition(b"\0")[0].decode()
        kind, shape = datatype(Cursor(parts[1])), dataspace(Cursor(parts[2]))
        if shape is None or kind.kind == "V":
            return name, kind if shape is not None else Type("empty", 0)
        count = int(np.prod(shape, dtype=object))
        values = elements(self.file, kind, message.bytes(count * kind.size), shape)
        value: Any = values[()] if shape == () else values
        return name, value.decode() if isinstance(value, bytes) else value


class Group(_Object):
    """Names and what they stand for (IV.A.2.r)."""

    @cached_property
    def _members(self) -> dict[str, int | None]:
        if SYMBOL_TABLE not in self._found:
            raise FileError(LINKED)
        file, (tree, heap) = self.file, self._found[SYMBOL_TABLE].numbers(8, 2)
        head = Cursor(file.take(heap, 32))
        if head.bytes(4) != b"HEAP":
            raise FileError("names that are not where they should be")
        head.skip(4)
        size, _, at = head.numbers(8, 3)
        names = file.take(at, size)
        found: dict[str, int | None] = {}
        for _, node in file.tree(tree, 0, 8):
            entries = Cursor(file.take(node, 8))
            if entries.bytes(4) != b"SNOD":
                raise FileError("a group whose members are not where they should be")
            entries.skip(2)
            count = entries.number(2)
            entries = Cursor(file.take(node + 8, 40 * count))
            for _ in range(count):
                start, target, link, _ = entries.numbers(8, 2) + entries.numbers(4, 2)
                entries.skip(16)
                name = names[start : names.find(b"\0", start)].decode()
                found[name] = None if link == 2 else target  # 2: by another name, not followed
        return found

    def __contains__(self, name: str) -> bool:
        return name in self._members

    def __iter__(self) -> Iterator[str]:
        return iter(self._members)

    def get(self, name: str) -> Group | Dataset | None:
        """A member that is in the file itself, None if there is none."""
        at = self._members.get(name)
        return None if at is None else self.file.object(at)


class Dataset(_Object):
    """An array (IV.A.2.b, d, i, l)."""

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """Its shape."""
        shape = dataspace(self._part(DATASPACE))
        if shape is None:
            raise FileError("an empty dataset")
        return shape

    @cached_property
    def type(self) -> Type:
        """Type of its elements."""
        return datatype(self._part(DATATYPE))

    def read(self) -> np.ndarray:
        """Its elements; raises FileError if they are not in the file, or damaged."""
        if EXTERNAL in self._found:
            raise FileError("its numbers are outside the file")
        count = int(np.prod(self.shape, dtype=object))
        length = count * self.type.size
        layout = self._part(LAYOUT)
        version, kind = layout.numbers(1, 2)
        if version != 3:
            raise FileError("its numbers are outside the file" if kind == 3 else NEWER)
        if length == 0:
            data = b""
        elif kind == 0:
            data = layout.bytes(layout.number(2))
        elif kind == 1:
            at, size = layout.numbers(8, 2)
            if at == NOWHERE:
                raise FileError(f"declares {length:.1e} bytes, which were never written")
            data = self.file.take(at, min(size, length))
        elif kind == 2:
            return self._chunked(layout)
        else:
            raise FileError(NEWER)
        if len(data) < length:
            raise FileError(f"holds {len(data)} bytes of {length}")
        return elements(self.file, self.type, data[:length], self.shape)

    def _part(self, kind: int) -> Cursor:
        if kind not in self._found:
            raise FileError("missing, or not a dataset of this file")
        return Cursor(self._found[kind]._data)

    def _chunked(self, layout: Cursor) -> np.ndarray:
        rank, tree = layout.number(1) - 1, layout.number(8)
        chunk = layout.numbers(4, rank + 1)[:-1]
        if rank != len(self.shape) or not rank or min(chunk) == 0:
            raise FileError("cut otherwise than its shape")
        count = int(np.prod(self.shape, dtype=object))
        if tree == NOWHERE:
            declared = count * self.type.size
            raise FileError(f"declares {declared:.1e} bytes, which were never written")
        size = int(np.prod(chunk, dtype=object)) * self.type.size
        filters = self._filters()
        cuts = [-(-n // c) for n, c in zip(self.shape, chunk)]
        expected = int(np.prod(cuts, dtype=object))
        found: dict[tuple[int, ...], np.ndarray] = {}
        for key, at in self.file.tree(tree, 1, 8 + 8 * (rank + 1)):
            length, left_out = key.numbers(4, 2)
            place = key.numbers(8, rank)
            data = _unfiltered(self.file, self.file.take(at, length), filters, left_out, size)
            found[place] = elements(self.file, self.type, data, chunk)
        if len(found) != expected:
            raise FileError("declares numbers that were never written")
        self.file.spend(count * self.type.size)
        whole = np.empty(self.shape, dtype=next(iter(found.values())).dtype)
        for place, part in found.items():
            inside = tuple(slice(p, p + c) for p, c in zip(place, chunk))
            target = whole[inside]
            if any(p % c for p, c in zip(place, chunk)) or not target.size:
                raise FileError("cut otherwise than its shape")
            target[...] = part[tuple(slice(n) for n in target.shape)]
        return whole

    def _filters(self) -> list[tuple[int, tuple[int, ...]]]:
        """Number and parameters of what was done to the bytes, in that order."""
        if FILTERS not in self._found:
            return []
        message = self._part(FILTERS)
        version, count = message.numbers(1, 2)
        message.skip(6 if version == 1 else 0)
        found = []
        for _ in range(count):
            name = message.number(2)
            length = message.number(2) if version == 1 or name >= 256 else 0
            _, values = message.numbers(2, 2)
            message.skip(length)
            found.append((name, message.numbers(4, values)))
            message.skip(4 * (values % 2) if version == 1 else 0)
        return found


def _unfiltered(
    file: Bytes, data: bytes, filters: list[tuple[int, tuple[int, ...]]], left_out: int, size: int
) -> bytes:
    """The bytes of a chunk as they were before filters; at most ``size`` of them."""
    for place, (name, values) in reversed(list(enumerate(filters))):
        if left_out >> place & 1:
            continue
        if name == FLETCHER32:
            data, told = data[:-4], data[-4:]
            if fletcher32(data).to_bytes(4, "little") != told:
                raise FileError("its checksum is wrong: the file was damaged; make it again")
        elif name == DEFLATE:
            file.spend(size)
            try:
                data = zlib.decompressobj().decompress(data, size + 4)  # a checksum may be inside
            except zlib.error as error:
                raise FileError(f"cannot be decompressed: {error}") from None
        elif name == SHUFFLE and values and values[0] and len(data) % values[0] == 0:
            data = np.frombuffer(data, np.uint8).reshape(values[0], -1).T.tobytes()
        else:
            raise FileError(f"was packed by filter {name}, which nanorom does not have")
    if len(data) != size:
        raise FileError(f"holds {len(data)} bytes of {size}")
    return data


def fletcher32(data: bytes) -> int:
    """Checksum of bytes as pairs, big end first, the last one filled up with nothing."""
    words = np.frombuffer(data + b"\0" * (len(data) % 2), ">u2")
    first, second = 0, 0
    for start in range(0, len(words), BLOCK):
        block = words[start : start + BLOCK].astype(np.uint64)
        weights = np.arange(len(block), 0, -1, dtype=np.uint64)
        second += len(block) * first + int(weights @ block)
        first += int(block.sum())
        first, second = (x and (x - 1) % 65535 + 1 for x in (first, second))
    return second << 16 | first


def dataspace(message: Cursor) -> tuple[int, ...] | None:
    """Shape (IV.A.2.b), None of an empty one."""
    version, rank, flags = message.numbers(1, 3)
    if version == 1:
        message.skip(5)
    elif version != 2:
        raise FileError(NEWER)
    elif message.number(1) == 2:
        return None
    return message.numbers(8, rank)


def datatype(message: Cursor) -> Type:
    """Type of an element (IV.A.2.d)."""
    head = message.number(1)
    version, kind, bits, size = head >> 4, head & 15, message.number(3), message.number(4)
    order = "<>"[bits & 1]
    if kind == 0 and size in (1, 2, 4, 8) and message.numbers(2, 2) == (0, 8 * size):
        letter = "ui"[bits >> 3 & 1]
        return _numpy(f"{order}{letter}{size}")
    if kind == 1 and size in (2, 4, 8):
        exponent = {2: 5, 4: 8, 8: 11}[size]
        mantissa = 8 * size - exponent - 1
        bias = 2 ** (exponent - 1) - 1
        layout = message.numbers(2, 2) + message.numbers(1, 4) + (message.number(4),)
        ieee = (0, 8 * size, mantissa, exponent, 0, mantissa, bias)
        if layout == ieee and bits & ~1 == 0x20 | 8 * size - 1 << 8:
            return _numpy(f"{order}f{size}")
    if kind == 3 and size:
        return Type("text", size, np.dtype(f"S{size}"))
    if kind == 9 and bits & 15 == 1 and size == 16:
        return Type("text", size, variable=True)
    if kind == 8 and version < 4 and datatype(message).name == "int8":
        return Type("bool", 1, np.dtype(bool))
    if kind == 6 and bits == 2 and size in (8, 16):
        parts = [_member(message, version, size) for _ in range(2)]
        real = np.dtype(f"f{size // 2}")
        if [(n, at) for n, at, _ in parts] == [(b"r", 0), (b"i", size // 2)] and all(
            part.dtype == real for _, _, part in parts
        ):
            return _numpy(f"c{size}")
    names = ("integer", "float", "time", "text", *FOREIGN)
    return Type(names[kind] if kind < len(names) else "unknown", size)


def _numpy(name: str) -> Type:
    dtype = np.dtype(name)
    return Type(dtype.name, dtype.itemsize, dtype)


def _member(message: Cursor, version: int, size: int) -> tuple[bytes, int, Type]:
    """Name, place and type of a compound's member."""
    name = b""
    while not name.endswith(b"\0"):
        name += message.bytes(1)
    if version < 3:
        message.skip(-len(name) % 8)
    at = message.number(4 if version < 3 else 1)
    if version == 1:
        message.skip(28)
    return name[:-1], at, datatype(message)


def elements(file: Bytes, kind: Type, data: bytes, shape: tuple[int, ...]) -> np.ndarray:
    """Bytes as an array of NumPy's native types, text as an array of objects."""
    if kind.variable:
        references = Cursor(data)
        texts = [file.text(Cursor(references.bytes(16))) for _ in range(len(data) // 16)]
        found = np.empty(len(texts), dtype=object)
        found[:] = texts
    elif kind.dtype is None:
        raise FileError(f"found type {kind.name}; expected another one")
    else:
        found = np.frombuffer(data, kind.dtype).astype(kind.dtype.newbyteorder("="))
    return found.reshape(shape)
