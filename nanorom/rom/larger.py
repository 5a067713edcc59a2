"""The same film's model of more modes, beside a reduced model: what its errors are estimated in."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np
from numpy.typing import NDArray

from nanorom.files.schema import POTENTIAL, SYMMETRIC, Family, Item, array, entries, family
from nanorom.rom import tensors
from nanorom.rom.arrays import (
    as_array,
    as_arrays,
    as_integers,
    as_names,
    as_optional,
    as_tensor,
)
from nanorom.scene.excitation import Damping
from nanorom.types import Array


@attrs.frozen(eq=False, kw_only=True)
class Larger:
    """Arrays of a model of N modes, those of the reduced model among them, in the same units."""

    frequency: Array = attrs.field(
        converter=as_array, metadata=array("N", "Hz", "natural frequencies, sorted")
    )
    mass: Array = attrs.field(converter=as_array, metadata=array("N", "kg", "modal masses"))
    label: tuple[str, ...] = attrs.field(
        converter=as_names, metadata=array("N", "", "names of the modes", kind="name")
    )
    number: NDArray[np.int64] = attrs.field(
        converter=as_integers, metadata=array("N", "1", "places among all modes, from 1")
    )
    stiffness: Array = attrs.field(
        converter=as_array, metadata=array("N, N", "N/m", "K", symmetry=SYMMETRIC)
    )
    damping: Array = attrs.field(
        converter=as_array, metadata=array("N, N", "kg/s", "C", symmetry=SYMMETRIC)
    )
    quadratic: Array = attrs.field(
        converter=as_tensor, metadata=array("N, N, N", "N/m^2", "A", symmetry=POTENTIAL)
    )
    cubic: Array = attrs.field(
        converter=as_tensor, metadata=array("N, N, N, N", "N/m^3", "B", symmetry=POTENTIAL)
    )
    outside_cubic: Array | None = attrs.field(
        converter=as_optional,
        default=None,
        metadata=array(
            "N, N, N, N", "N/m^3", "of what is beyond these modes", path="outside/cubic"
        ),
    )
    drive: dict[str, Array] = attrs.field(
        converter=as_arrays,
        factory=dict,
        metadata=family("N", "N per unit of the level", "force patterns J"),
    )
    parametric: dict[str, Array] = attrs.field(
        converter=as_arrays,
        factory=dict,
        metadata=family("N, N", "N/m per unit of the level", "force patterns P"),
    )
    losses: dict[str, Array] = attrs.field(
        converter=as_arrays,
        factory=dict,
        metadata=family("N", "1", "1/Q by what takes energy", optional=True),
    )
    bending: Array | None = attrs.field(
        converter=as_optional,
        default=None,
        metadata=array("N, N", "N/m", "part of K that a viscous material damps"),
    )
    stretching: Array | None = attrs.field(
        converter=as_optional,
        default=None,
        metadata=array("N, N, N, N", "N/m^3", "part of B that it damps"),
    )
    cubic_damping: Array | None = attrs.field(
        converter=as_optional, default=None, metadata=array("N, N, N, N", "N s/m^3", "D")
    )

    @classmethod
    def of(cls, model: Any) -> Larger:
        """What a reduced model of N modes has."""
        return cls(**{name: getattr(model, name) for name in entries(cls)})

    def arrays(self) -> dict[str, Any]:
        """All of it by name, as a reduced model has it."""
        return {name: getattr(self, name) for name in entries(type(self))}

    def matched(self, model: Any) -> Larger:
        """The same with a reduced model's own arrays where all indices are of its modes.

        Both may be of different meshes: what an estimate tells is then what modes outside make.
        Raises ValueError if a mode of the model is not there.
        """
        places, known = self.places(model.label), {}
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

    def places(self, label: tuple[str, ...]) -> NDArray[np.intp]:
        """Places (L,) of modes by their names; raises ValueError if one is not there."""
        return np.array([self.label.index(name) for name in label], dtype=np.intp)


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
