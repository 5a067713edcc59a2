"""Modal systems handed to other programs: AUTO-07p, MATLAB (.mat) and plain tables (.csv).

MATLAB and CSV carry the equations in the user's units, one coefficient per monomial:
force on mode r = sum over monomials of coefficient[r] * prod_j q_j ** exponent[j].
The AUTO problem is written in non-dimensional form, because AUTO's tolerances are absolute.
"""

from __future__ import annotations

import csv
import os
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from nanorom.continuation.system import ModalSystem
from nanorom.errors import FileError, SceneError
from nanorom.export.auto import write_auto
from nanorom.files.whole import atomic_path
from nanorom.rom.model import ReducedModel
from nanorom.rom.patterns import aimed
from nanorom.rom.tensors import monomial_coefficients
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Damping, Excitation, Sweep
from nanorom.scene.scene import Scene
from nanorom.types import Array

FORMATS = ("auto", "matlab", "csv")


def export(
    system: ModalSystem,
    to: str,
    target: str | os.PathLike[str],
    *,
    omega: tuple[float, float] | None = None,
    direct: float = 1.0,
    parametric: float = 0.0,
) -> Path:
    """Write a modal system for another program and return the path written.

    Parameters
    ----------
    system : ModalSystem
    to : "auto", "matlab" or "csv"
    target : a directory for AUTO, a file otherwise
    omega : (low, high), range of drive frequencies of the AUTO problem in rad per unit
        of the system's time (default: 0.8 to 1.5 times the lowest natural frequency)
    direct, parametric : drive levels of the AUTO problem, in the system's units

    Raises
    ------
    FileError
        for an unknown format or a target that cannot be written.
    """
    if to not in FORMATS:
        raise FileError(f"export: unknown format {to!r}; choose one of {', '.join(FORMATS)}")
    path = Path(target)
    try:
        if to == "auto":
            write_auto(system, path, omega, direct, parametric)
        elif to == "matlab":
            _write_matlab(system, path)
        else:
            _write_csv(system, path)
    except OSError as error:
        raise FileError(f"export: cannot write {path}: {error.strerror}") from None
    return path


def export_model(
    model: ReducedModel,
    to: str,
    target: str | os.PathLike[str],
    excitation: Excitation | None = None,
    *,
    level: int = 1,
    omega: tuple[str | float, str | float] | None = None,
    direct: str | float | None = None,
    parametric: str | float | None = None,
) -> Path:
    """Write a reduced model for another program and return the path written.

    Parameters
    ----------
    model, to, target : as for `export`
    excitation : drive, sweep and damping; those of the model's scene if left out
    level : which of the drive levels AUTO gets, from 1
    omega : ends of AUTO's range as in a scene, "0.8 f1" or "20 MHz", instead of the sweep's
    direct, parametric : "5 Pa" and "5 mN/m", instead of the drive's

    Raises
    ------
    FileError, SceneError, ContinuationError
        for a target, a level or a model that does not do.
    """
    drive, sweep, damping = _excitation_of(model, excitation)
    if damping is not None:
        model = model.with_damping(damping)
    if direct is not None or parametric is not None:
        levels: dict[str, Any] = {"direct": direct or 0.0, "parametric": parametric or 0.0}
        drive = attrs.evolve(drive, **levels) if drive else Drive(**levels)
        level = 1
    if omega is not None:
        ends: Any = omega
        sweep = Sweep(*ends)
    drive = drive or Drive(direct=(1.0,))
    if not 1 <= level <= len(drive.levels):
        raise FileError(f"level: found {level}; the drive has levels 1 to {len(drive.levels)}")
    hertz = sweep.hertz(float(model.frequency[0])) if sweep else None
    chosen = drive.levels[level - 1]
    model = aimed(model, drive)
    return export(
        model.system(drive.direct_pattern, drive.parametric_pattern, damped=to == "auto"),
        to,
        target,
        omega=hertz and (2 * np.pi * hertz[0], 2 * np.pi * hertz[1]),
        direct=chosen[0],
        parametric=chosen[1],
    )


def _excitation_of(
    model: ReducedModel, given: Excitation | None
) -> tuple[Drive | None, Sweep | None, Damping | None]:
    if given is not None:
        return given.drive, given.sweep, given.damping
    try:
        scene = Scene.from_toml(model.scene)
    except SceneError:  # a model need not come from a scene
        return None, None, None
    return scene.drive, scene.sweep, None  # its damping is in the model


def _all_monomials(system: ModalSystem) -> list[tuple[tuple[int, ...], Array]]:
    linear = [
        ((j,), system.stiffness[:, j]) for j in range(system.size) if np.any(system.stiffness[:, j])
    ]
    return linear + monomial_coefficients(system.quadratic) + monomial_coefficients(system.cubic)


def _write_csv(system: ModalSystem, path: Path) -> None:
    """One monomial of one equation per row: mode, exponents of q_1 ... q_L, coefficient."""
    with atomic_path(path) as temporary, open(temporary, "w", newline="") as handle:
        writer = csv.writer(handle)
        writer.writerow(["mode"] + [f"q{j + 1}" for j in range(system.size)] + ["coefficient"])
        for indices, coefficients in _all_monomials(system):
            exponents = np.bincount(indices, minlength=system.size)
            for mode in np.flatnonzero(coefficients):
                writer.writerow([mode + 1, *exponents, repr(float(coefficients[mode]))])


def _write_matlab(system: ModalSystem, path: Path) -> None:
    from scipy.io import savemat

    table = monomial_coefficients(system.quadratic) + monomial_coefficients(system.cubic)
    exponents = np.array([np.bincount(indices, minlength=system.size) for indices, _ in table])
    coefficients = np.array([values for _, values in table])
    contents = {
        "M": system.mass,
        "C": system.damping,
        "K": system.stiffness,
        "exponents": exponents.reshape(-1, system.size).astype(float),
        "coefficients": coefficients.reshape(-1, system.size),
        "direct": system.direct,
        "parametric": system.parametric,
        "cubic_damping": system.cubic_damping,
        "description": "M q'' + C q' + K q + coefficients.' * prod(q.' .^ exponents, 2)"
        " = (direct + parametric q) cos(w t)",
    }
    with atomic_path(path) as temporary:
        savemat(temporary, contents, oned_as="column", appendmat=False)


# AUTO-07p
# ------------------------------------------------------------------------------------------
