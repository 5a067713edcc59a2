"""The arrays of a modal model, each declared once: of a reduced model and of the larger one."""

from __future__ import annotations

import attrs
import numpy as np
from numpy.typing import NDArray

from nanorom.files.schema import POTENTIAL, SYMMETRIC, array, family
from nanorom.rom.arrays import (
    as_array,
    as_arrays,
    as_integers,
    as_names,
    as_optional,
    as_tensor,
)
from nanorom.types import Array

FOLLOWING = 1000  # numbers above are no modes, but fields that follow the masters of a manifold


@attrs.frozen(eq=False, kw_only=True)
class Modal:
    """What the equations of L modes are made of, in SI units."""

    frequency: Array = attrs.field(
        converter=as_array,
        metadata=array(
            "L",
            "Hz",
            "natural frequencies, sorted; those closer than 1e-3 may stand in order of their names",
        ),
    )
    mass: Array = attrs.field(
        converter=as_array,
        metadata=array("L", "kg", "modal masses m_r, for max |phi| = 1"),
    )
    label: tuple[str, ...] = attrs.field(
        converter=as_names, metadata=array("L", "", "names of the modes", kind="name")
    )
    number: NDArray[np.int64] = attrs.field(
        converter=as_integers,
        metadata=array(
            "L",
            "1",
            "places among all modes by frequency, from 1; above 1000: fields that follow modes",
        ),
    )
    stiffness: Array = attrs.field(
        converter=as_array, metadata=array("L, L", "N/m", "K", symmetry=SYMMETRIC)
    )
    damping: Array = attrs.field(
        converter=as_array, metadata=array("L, L", "kg/s", "C", symmetry=SYMMETRIC)
    )
    quadratic: Array = attrs.field(
        converter=as_tensor, metadata=array("L, L, L", "N/m^2", "A", symmetry=POTENTIAL)
    )
    cubic: Array = attrs.field(
        converter=as_tensor, metadata=array("L, L, L, L", "N/m^3", "B", symmetry=POTENTIAL)
    )
    outside_cubic: Array | None = attrs.field(
        converter=as_optional,
        default=None,
        metadata=array(
            "L, L, L, L",
            "N/m^3",
            "what the static response of everything outside the modes adds to B",
            symmetry=POTENTIAL,
            path="outside/cubic",
        ),
    )
    drive: dict[str, Array] = attrs.field(
        converter=as_arrays,
        factory=dict,
        metadata=family("L", "N per unit of the level", "force patterns J: pressure, spot, ..."),
    )
    parametric: dict[str, Array] = attrs.field(
        converter=as_arrays,
        factory=dict,
        metadata=family("L, L", "N/m per unit of the level", "force patterns P: tension, ..."),
    )
    losses: dict[str, Array] = attrs.field(
        converter=as_arrays,
        factory=dict,
        metadata=family(
            "L", "1", "1/Q by what takes energy: material, thermoelastic, gas", optional=True
        ),
    )
    bending: Array | None = attrs.field(
        converter=as_optional,
        default=None,
        metadata=array("L, L", "N/m", "part of K that a viscous material damps"),
    )
    stretching: Array | None = attrs.field(
        converter=as_optional,
        default=None,
        metadata=array(
            "L, L, L, L",
            "N/m^3",
            "part of B that it damps: [r, j, k, l] from the slope of mode l and the stress of the "
            "pair jk; symmetrised, it is B",
        ),
    )
    cubic_damping: Array | None = attrs.field(
        converter=as_optional,
        default=None,
        metadata=array(
            "L, L, L, L", "N s/m^3", "D, the force sum_jkl D[r,j,k,l] q_l d(q_j q_k)/dt"
        ),
    )
