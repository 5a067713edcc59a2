"""Films that bend without stretching, for which von Karman's theory has no nonlinear force.

A film that can roll up (a cantilever, a free ribbon) follows its mode without stretching: what
stiffens it then is its curvature, of the energy

    1/2 D int kappa:kappa (1 + |grad w|^2),

and the inertia of the motion in its plane softens it (Crespo da Silva and Glynn 1978,
doi:10.1080/03601217808907348).  Both are of an order that von Karman's energy leaves out: it is out
of its range where the stretching of a mode is not far above this.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
from dolfinx import fem

from nanorom.errors import AccuracyWarning
from nanorom.fem.fields import quadrature
from nanorom.fem.modes.eigen import Modes
from nanorom.fem.solvers import compat
from nanorom.rom.range import OUT_OF_RANGE


def curvature_cubic(modes: Modes, cubic: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """Cubic coefficients (L,) that curvature adds to those of stretching, scaled alike. Collective.

    cubic: (L,) diagonal entries of stretching, stiffness: (L,) the modes' own, in the same unit of
    force per length.  An upper bound by the largest slope where that is far below the stretching.
    """
    plate = modes.plate
    if not plate.bending:
        return np.zeros(len(cubic))
    steepest = np.zeros(modes.shapes.shape[1])
    for field in quadrature.fields(plate, columns=2 * len(cubic)):
        slope = field.gradient(modes.shapes)
        steepest = np.maximum(steepest, np.sum(slope**2, axis=2).max(axis=(0, 1)))
    steepest = np.max(plate.domain.comm.allgather(steepest), axis=0)
    found = 2 * np.abs(stiffness) * steepest
    doubtful = np.flatnonzero(found > OUT_OF_RANGE * np.abs(cubic))
    w = fem.Function(plate.deflections)
    form = compat.form(plate.curvature_form(w)) if len(doubtful) else None
    for i in doubtful:
        w.x.array[:] = modes.shapes[:, i]
        whole = plate.domain.comm.allreduce(fem.assemble_scalar(form))
        found[i] = plate.mirrors.copies * whole
    return found


def told(
    curvature: np.ndarray, cubic: np.ndarray, names: Sequence[str], factor: float
) -> dict[str, Any]:
    """Largest ratio (L,) of curvature to stretching for a model's diagnostics; warns of it.

    curvature, cubic: (L,) in the same unit, which ``factor`` turns into N/m^3.
    """
    size = np.maximum(np.abs(cubic), np.finfo(float).tiny)
    worst = int(np.argmax(curvature / size))
    ratio = float(curvature[worst] / size[worst])
    if ratio > OUT_OF_RANGE:
        warnings.warn(
            f"mode {names[worst]} bends without stretching: its curvature alone stiffens it by "
            f"{factor * curvature[worst]:.2g} N/m^3, the stretching of von Karman's theory by "
            f"{factor * cubic[worst]:.2g} N/m^3: the theory is out of its range. Frequencies hold, "
            "nonlinear coefficients do not, and the inertia of such a film's motion in its plane "
            "is missing; hold more of its edges",
            AccuracyWarning,
            stacklevel=2,
        )
    return {"curvature_ratio": ratio}
