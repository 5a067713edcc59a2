"""Export to Poscidyn, which integrates batches of oscillators in time (pypi.org/project/poscidyn).

Its equations are q'' + (omega_0/Q) q' + omega_0^2 q + a q q + b q q q = (f_d + f_p q) cos(omega t),
one damping and one parametric factor per mode.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from nanorom.continuation.drive import CARRIER
from nanorom.continuation.system import ModalSystem
from nanorom.errors import FileError
from nanorom.files.whole import atomic_path
from nanorom.types import Array

COUPLED = 1e-9  # of the largest entry: what lies off a diagonal beyond it would be lost


def write_poscidyn(
    system: ModalSystem,
    path: Path,
    omega: tuple[float, float] | None,
    direct: float,
    parametric: float,
) -> None:
    """Write omega_0, Q, f_d, f_p (L,), a (L, L, L) and b (L, L, L, L) into an .npz file.

    All are non-dimensional, as Poscidyn computes in single precision: ``frequency`` is the unit of
    omega, ``amplitude`` that of q, both in the units of the system.  Raises FileError if the
    equations have what Poscidyn's have not, and where the file cannot be written.
    """
    scaled = system.scaled(direct, parametric)
    if scaled.loss.any():
        raise FileError("export: Poscidyn has no nonlinear damping; leave out material_time")
    omega_0 = np.sqrt(_diagonal(scaled.stiffness, "stiffness"))
    arrays = {
        "omega_0": omega_0,
        "Q": omega_0 / _diagonal(scaled.damping, "damping"),
        "a": scaled.quadratic,
        "b": scaled.cubic,
        "f_d": scaled.force[:, CARRIER],
        "f_p": _diagonal(scaled.parametric[..., CARRIER], "parametric"),
        "frequency": np.array(scaled.frequency),
        "amplitude": np.array(scaled.amplitude),
    }
    if omega is not None:
        arrays["omega"] = np.array(omega) / scaled.frequency
    with atomic_path(path) as temporary, open(temporary, "wb") as file:
        np.savez(file, **arrays)


def _diagonal(matrix: Array, name: str) -> Array:
    beside = np.abs(matrix - np.diag(np.diag(matrix))).max(initial=0.0)
    if beside > COUPLED * np.abs(matrix).max(initial=0.0):
        raise FileError(
            f"export: {name} couples modes, which Poscidyn's equations do not; select one mode, "
            'or take parametric_pattern = "paper"'
        )
    return np.diag(matrix).copy()
