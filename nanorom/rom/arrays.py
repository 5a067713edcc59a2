"""Arrays of a reduced model: converted, frozen and checked."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from nanorom.errors import ModelError
from nanorom.rom import tensors
from nanorom.types import Array


def as_array(value: ArrayLike) -> Array:
    array = np.array(value, dtype=float)
    array.flags.writeable = False
    return array


def as_optional(value: ArrayLike | None) -> Array | None:
    return None if value is None else as_array(value)


def as_integers(value: ArrayLike) -> NDArray[np.int64]:
    given = np.asarray(value)
    array = np.array(given, dtype=np.int64)
    if (array != given).any():
        raise ModelError(f"found {given.dtype} where whole numbers are expected")
    array.flags.writeable = False
    return array


def as_arrays(value: Mapping[str, ArrayLike]) -> dict[str, Array]:
    return {str(name): as_array(pattern) for name, pattern in value.items()}


def as_tensor(value: ArrayLike) -> Array:
    array = np.array(value, dtype=float)
    square = array.ndim > 1 and len(set(array.shape)) == 1  # other shapes are reported later
    array = tensors.symmetrise(array) if square else array
    array.flags.writeable = False  # it is a copy, of which a large tensor needs no further one
    return array


def as_names(value: Iterable[Any]) -> tuple[str, ...]:
    return tuple(str(name) for name in value)


def as_copy(value: Mapping[str, Any]) -> dict[str, Any]:
    return dict(value)
