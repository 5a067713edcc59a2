"""Arrays as users give them: checked, filled up, symmetrised, without their round-off; parts of
large ones.
"""

from __future__ import annotations

import textwrap
from typing import Any, TypeGuard, TypeVar

import attrs
import numpy as np

from nanorom.errors import ContinuationError
from nanorom.types import Array

HALF = 1 << 53 - 43 - 1  # of the last of 43 bits that are kept, of the 53 of a number
FEW = 6  # entries of an array that is shown as it is
TEMPORARY = 500_000  # entries of a temporary array: it stays near the processor, and small

Kind = TypeVar("Kind")


def brief(cls: type[Kind]) -> type[Kind]:
    """A class of attrs, whose results are shown in a few lines: long arrays by their shapes."""

    fields: Any = attrs.fields(cls)  # type: ignore[arg-type]

    def shown(self: Any) -> str:
        own = [f"{f.name}={_short(getattr(self, f.name))}" for f in fields if f.repr]
        return textwrap.fill(f"{cls.__name__}({', '.join(own)})", 96, subsequent_indent="  ")

    setattr(cls, "__repr__", shown)  # noqa: B010 - mypy knows of no other way
    return cls


def _short(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"array {value.shape}" if value.size > FEW else repr(value.tolist())
    if isinstance(value, (list, tuple)) and len(value) > FEW:
        return f"{len(value)} x {type(value[0]).__name__}"
    return " ".join(repr(value).split())


def finite(value: object) -> bool:
    """Whether a value is one finite real number."""
    try:
        return bool(np.isfinite(float(value)))  # type: ignore[arg-type]
    except (TypeError, ValueError):  # no number
        return False


def without_round_off(values: Array | float) -> Array:
    """The first 43 bits (13 digits) of every number, in an array of its own.

    Systems that differ by their units alone become the same to the last bit, and so do their
    diagrams: at a threshold, round-off would otherwise change the steps taken.
    """
    return _round(np.array(values, dtype=float, order="C"))


def _round(own: Array) -> Array:
    """The same, of an array that nobody else has."""
    if own.any():
        bits = own.reshape(-1).view(np.int64)  # of the modulus; the first is the sign
        bits += HALF
        bits &= ~(2 * HALF - 1)
    return own


def times(values: Array, factor: float) -> Array:
    """An array times a factor without round-off; of zeros, which stay memory that is not touched,
    themselves.
    """
    return _round(np.multiply(values, factor, order="C")) if values.any() else values


def nothing(shape: tuple[int, ...]) -> Array:
    """Zeros that take no memory, whatever their number, and are not to be written to."""
    return np.broadcast_to(0.0, shape)


def _is_frozen(value: object) -> TypeGuard[Array]:
    """Whether nobody can write to an array: a tensor of many modes is not to be there twice."""
    if not isinstance(value, np.ndarray) or value.dtype != float:
        return False
    return value.flags.owndata and value.flags.c_contiguous and not value.flags.writeable


def checked(value: object, shape: tuple[int, ...], name: str) -> Array:
    """An array of finite real numbers of a given shape; raises ContinuationError naming it."""
    try:
        array = value if _is_frozen(value) else np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise ContinuationError(f"{name}: not an array of real numbers") from None
    if array.shape != shape:
        raise ContinuationError(f"{name}: shape {array.shape}, expected {shape}")
    if not np.all(np.isfinite(array)):
        raise ContinuationError(
            f"{name}: contains NaN or infinite entries; check the reduction it comes from"
        )
    return array


def square(value: object, size: int, name: str) -> Array:
    """A square matrix from a matrix, a diagonal or one number for all modes; raises as
    `checked`.
    """
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise ContinuationError(f"{name}: not an array of real numbers") from None
    if array.ndim == 0:
        array = np.full(size, float(array))
    if array.ndim == 1 and array.shape == (size,):
        array = np.diag(array)
    return checked(array, (size, size), name)


def symmetrise_quadratic(tensor: Array) -> Array:
    """A[r, j, k] averaged over the order of j, k: the force A qq is unchanged."""
    return (tensor + tensor.transpose(0, 2, 1)) / 2


def symmetrise_cubic(tensor: Array) -> Array:
    """B[r, j, k, l] averaged over the order of j, k, l, in its own memory: the force B qqq is
    unchanged.
    """
    for row in tensor:
        if not row.any():  # zeros stay what they are, and may be `nothing`
            continue
        total = row + row.transpose(0, 2, 1)
        for order in ((1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)):
            total += row.transpose(order)
        np.divide(total, 6, out=row)
    return tensor


def slices(count: int, width: int) -> list[slice]:
    """Parts of `count` rows, in order, that are small enough for temporaries of so many entries a
    row.
    """
    some = max(1, TEMPORARY // max(width, 1))
    return [slice(first, first + some) for first in range(0, count, some)]
