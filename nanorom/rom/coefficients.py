"""The paper's coefficients alpha_jk and b_jkl of one equation, looked up in any order."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from nanorom.errors import ModelError
from nanorom.rom import tensors
from nanorom.rom.names import index_of
from nanorom.types import Array

SHOWN = 8  # coefficients that are told of an equation: those that are largest


class Coefficient(NamedTuple):
    """One coefficient of the paper: b_jkl of equation r, indices 1-based within the model."""

    equation: int
    indices: tuple[int, ...]
    value: float


class Coefficients(dict[tuple[Any, ...], float]):
    """Coefficients of one equation by their rising indices, 1-based: b[1, 1, 2].

    The indices may stand in any order, and may be names of modes: b[2, 1, 1] and
    b["f01", "f01", "f11c"] are the same.  Raises ModelError for a mode that the model lacks.
    """

    def __init__(self, force: Array, labels: Sequence[str]) -> None:
        """Of the part T[r] of a tensor, (L, L) or (L, L, L), in N/m^2 or N/m^3."""
        self._labels, self._order = tuple(labels), force.ndim
        super().__init__(
            (tuple(i + 1 for i in indices), orders * float(force[indices]))
            for indices, orders in tensors.monomials(len(self._labels), force.ndim)
        )

    def __repr__(self) -> str:
        largest = sorted(self, key=lambda index: -abs(self[index]))[:SHOWN]
        shown = ", ".join(f"{index}: {self[index]:.6g}" for index in sorted(largest))
        more = f", ... {len(self) - SHOWN} smaller ones" if len(self) > SHOWN else ""
        return f"{{{shown}{more}}}"

    def __missing__(self, key: Any) -> float:
        indices = key if isinstance(key, tuple) else (key,)
        if len(indices) != self._order:
            raise ModelError(f"coefficient: found {key!r}; allowed: {self._order} modes")
        return self[tuple(sorted(place(self._labels, mode, "coefficient") for mode in indices))]


def place(labels: Sequence[str], mode: int | str, what: str) -> int:
    """Place of a mode within a model, 1-based, given that or its name; raises ModelError."""
    named = index_of(labels, mode) if isinstance(mode, str) else None
    if named is not None:
        return named + 1
    if not isinstance(mode, str) and 1 <= mode <= len(labels) and int(mode) == mode:
        return int(mode)
    raise ModelError(f"{what}: found {mode!r}; allowed: 1 to {len(labels)}, or {', '.join(labels)}")
