"""The same film's model of more modes, beside a reduced model: what its errors are estimated in."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from nanorom.files import schema
from nanorom.files.schema import Family, Item, entries
from nanorom.rom import tensors
from nanorom.rom.modal import Modal
from nanorom.scene.excitation import Damping
from nanorom.types import Array

# relative difference of frequencies up to which modes may be the same: above the error of the
# larger model's mesh, below what lies between modes whose shapes have one part in common
NEAR = 0.01


def _of_larger(cls: type, fields: list[Any]) -> list[Any]:
    """The fields of a modal model, of N modes instead of L."""
    return [field.evolve(metadata=schema.renamed(field.metadata, "L", "N")) for field in fields]


@attrs.frozen(eq=False, kw_only=True, field_transformer=_of_larger)
class Larger(Modal):
    """Arrays of a model of N modes, those of the reduced model among them, in the same units."""

    @classmethod
    def of(cls, model: Modal) -> Larger:
        """What a reduced model of N modes has."""
        return cls(**{name: getattr(model, name) for name in entries(cls)})

    def arrays(self) -> dict[str, Any]:
        """All of it by name, as a reduced model has it."""
        return {name: getattr(self, name) for name in entries(type(self))}

    def matched(self, model: Modal) -> Larger:
        """The same with a reduced model's own arrays and names where all indices are of its modes.

        Both may be of different meshes: what an estimate tells is then what modes outside make.
        Raises ValueError if a mode of the model is not there.
        """
        places = self.places(model)
        known: dict[str, Any] = {"label": _renamed(self.label, places, model.label)}
        for name, entry in entries(type(self)).items():
            whole, own = getattr(self, name), getattr(model, name)
            if isinstance(entry, Item) and entry.kind == "number" and own is not None:
                known[name] = None if whole is None else _with_block(whole, places, own)
            elif isinstance(entry, Family):
                both = {n: _with_block(whole[n], places, own[n]) for n in whole if n in own}
                known[name] = whole | both
        if self.outside_cubic is not None and model.outside_cubic is not None:
            # of what is outside the model, all but the modes that are here
            outside = np.setdiff1d(np.arange(len(self.label)), places)
            pull = self.quadratic[np.ix_(places, places, outside)]
            compliance = np.linalg.inv(self.stiffness[np.ix_(outside, outside)])
            beyond = model.outside_cubic - tensors.condensed(pull, compliance)
            known["outside_cubic"] = _with_block(self.outside_cubic, places, beyond)
        return attrs.evolve(self, **known)

    def places(self, model: Modal) -> NDArray[np.intp]:
        """Places (L,) of a model's modes, by frequency, of near ones by name.

        A mixed shape may be named by another of its parts where it is one of more modes.  Raises
        ValueError if one is not there.
        """
        apart = np.abs(self.frequency / model.frequency[:, None] - 1.0)
        other = np.array(model.label)[:, None] != np.array(self.label)
        rows, places = linear_sum_assignment(apart + NEAR * other)
        missing = [model.label[row] for row in rows if apart[row, places[row]] > NEAR]
        if len(rows) < len(model.label) or missing:
            raise ValueError(f"the larger model has no mode {', '.join(missing or model.label)}")
        return np.asarray(places, dtype=np.intp)


def _renamed(
    label: tuple[str, ...], places: NDArray[np.intp], own: tuple[str, ...]
) -> tuple[str, ...]:
    """Names of all modes, those at some places by a model's own, no two alike."""
    given = dict(zip(places.tolist(), own))
    spare = [label[place] for place in given if label[place] not in own]
    left = iter(spare)
    return tuple(
        given[n] if n in given else next(left) if name in own else name
        for n, name in enumerate(label)
    )


def _with_block(whole: Array, places: NDArray[np.intp], own: Array) -> Array:
    """An array with another one in the place of all entries of some modes."""
    found = np.array(whole)
    found[np.ix_(*(places,) * found.ndim)] = own
    return found


def extended(damping: Damping, places: NDArray[np.intp], count: int) -> Damping:
    """Damping of more modes than it was given for: those outside as the model's highest.

    places (L,): of the model's modes among them.
    """
    if damping.quality_factor is None:
        return damping
    given = damping.per_mode(len(places))
    quality = np.full(count, given[-1])
    quality[places] = given
    return attrs.evolve(damping, quality_factor=tuple(quality.tolist()))
