"""Arrays of results as bytes within a page, under the paths that they have in their files."""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Container
from typing import Any

import attrs
import numpy as np

from nanorom.files.schema import Item

ALIGNED = 8  # bytes: a typed array of a browser begins at a multiple of its items


@attrs.define(eq=False)
class Pack:
    """A sink of results (`nanorom.files.schema.Sink`) that keeps them for a page.

    under : what paths begin with; wanted : paths that are kept, all if left out; the parts of
    ``sub`` share their content.
    """

    under: str = ""
    wanted: Container[str] | None = None
    content: dict[str, dict[str, Any]] = attrs.field(factory=dict)
    data: bytearray = attrs.field(factory=bytearray)

    def sub(self, under: str, wanted: Container[str] | None = None) -> Pack:
        """A sink whose paths begin with another folder."""
        return Pack(f"{self.under}{under}/", wanted, self.content, self.data)

    def group(self, path: str) -> None:
        """A group has nothing of its own to keep."""

    def array(self, path: str, item: Item, value: Any) -> None:
        """Keep an array as its schema says: numbers in binary64, or names."""
        if not self._wants(path):
            return
        if item.kind == "name":
            self.value(path, list(value))
        elif item.kind in ("flag", "whole"):
            self.numbers(path, np.asarray(value), "u1" if item.kind == "flag" else "i4", item.unit)
        else:
            self.numbers(path, np.asarray(value), "f8", item.unit)

    def note(self, path: str, kind: str, value: Any) -> None:
        """Keep a text or facts by name."""
        if self._wants(path):
            self.value(path, value)

    def value(self, path: str, value: Any) -> None:
        """Keep whatever JSON takes."""
        self.content[self.under + path] = {"value": value}

    def numbers(
        self, path: str, value: Any, dtype: str, unit: str = "", scale: float = 1.0
    ) -> None:
        """Keep an array as numbers of a type (f8, f4, i4, u4, i2, u2, u1).

        Complex ones get a last axis (real, imaginary). ``scale`` is what those of the page are to
        be multiplied by.
        """
        value = np.asarray(value)
        if np.iscomplexobj(value):
            value = np.stack([value.real, value.imag], axis=-1)
        little = np.ascontiguousarray(value, dtype=np.dtype(dtype).newbyteorder("<"))
        self.data.extend(bytes(-len(self.data) % ALIGNED))
        self.content[self.under + path] = {
            "type": dtype,
            "shape": list(little.shape),
            "at": len(self.data),
            "unit": unit,
            **({} if scale == 1.0 else {"scale": scale}),
        }
        self.data.extend(little.tobytes())

    def table(self) -> str:
        """What is where, as JSON."""
        return json.dumps(self.content, ensure_ascii=False, separators=(",", ":"))

    def bytes(self) -> str:
        """All numbers, compressed, as text."""
        return packed(bytes(self.data))

    def _wants(self, path: str) -> bool:
        return self.wanted is None or path in self.wanted


def packed(data: bytes) -> str:
    """Bytes as a page holds them: compressed with gzip, in base64."""
    return base64.b64encode(gzip.compress(data, 9, mtime=0)).decode("ascii")
