"""Models, modal systems and responses handed to other programs, by the name of a format."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from nanorom.continuation import PeriodicOrbit
from nanorom.continuation.system import ModalSystem
from nanorom.errors import FileError, SceneError
from nanorom.export.formats import FORMATS, Format, names
from nanorom.files.stored import call
from nanorom.results.response import Response
from nanorom.rom.model import ReducedModel
from nanorom.rom.patterns import aimed, driven
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Damping, Excitation, Sweep, as_frequency
from nanorom.scene.scene import Scene


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
    to : a name of `nanorom.export.formats.FORMATS`
    target : a directory for AUTO and COCO, a file otherwise
    omega : (low, high), range of drive frequencies of the AUTO problem in rad per unit
        of the system's time (default: 0.8 to 1.5 times the lowest natural frequency)
    direct, parametric : drive levels of the AUTO problem, in the system's units

    Raises
    ------
    FileError
        for an unknown format or a target that cannot be written.
    """
    write = _format(to).system
    if not write:
        raise FileError(f"export: {to} is for a model with its mode shapes; export the model")
    if system.drives or system.states is not None:
        raise FileError(
            "export: found drives of several harmonics, or states of first order; allowed: modes "
            "with one drive, which is what other programs are given"
        )
    path = Path(target)
    try:
        call(write, system, path, omega, direct, parametric)
    except OSError as error:
        raise FileError(f"export: cannot write {path}: {error.strerror}") from None
    return path


def export_response(response: Response, to: str, target: str | os.PathLike[str]) -> Path:
    """Write a response for another program and return the path written.

    response : its amplitudes in m and frequencies in Hz; to : "csv" or "matlab".  Raises FileError
    for another format and a target that cannot be written.
    """
    write = _format(to).response
    if not write:
        raise FileError(f"export: {to} is for models; a response goes to {names(of_response=True)}")
    call(write, response, Path(target))
    return Path(target)


def export_motion(
    model: ReducedModel, orbit: PeriodicOrbit, to: str, target: str | os.PathLike[str]
) -> Path:
    """Write the film as it moves over a period of an orbit; returns the path written.

    to : "vtk".  Raises FileError for another format and a target that cannot be written,
    ModelError if the model has no shapes.
    """
    write = _format(to).motion
    if not write:
        able = ", ".join(name for name, each in FORMATS.items() if each.motion)
        raise FileError(f"export: {to} is not for motions; those go to {able}")
    call(write, model, orbit, Path(target))
    return Path(target)


def orbit_of(response: Response, level: int, at: str | float | None = None) -> PeriodicOrbit:
    """The largest stable orbit of a drive level (from 1), or of those next to a drive frequency.

    at : "20 MHz", "1.1 f1" or a number in Hz.  Raises FileError if there is none.
    """
    if not 1 <= level <= len(response.diagrams):
        raise FileError(
            f"level: found {level}; the response has levels 1 to {len(response.diagrams)}"
        )
    first = float(response.frequency[0])
    wanted = None if at is None else as_frequency(at).hertz(first)
    found = []
    for branch in response.diagrams[level - 1].branches:
        points = np.flatnonzero(np.asarray(branch.stable, dtype=bool))
        if wanted is not None and len(branch) > 1:  # points a step from it, on every stretch
            away = np.abs(branch.frequency - wanted) <= np.abs(np.gradient(branch.frequency))
            points = points[away[points]]
        found += [(np.linalg.norm(branch.amplitude[i]), branch, i) for i in points]
    if not found:
        raise FileError(
            f"level {level}: there is no stable orbit{'' if at is None else f' at {at}'}"
        )
    _, branch, index = max(found, key=lambda entry: entry[0])
    return branch.orbit(int(index))


def _format(to: str) -> Format:
    if to not in FORMATS:
        raise FileError(f"export: unknown format {to!r}; choose one of {', '.join(FORMATS)}")
    return FORMATS[to]


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
    whole = _format(to).model
    if whole:
        call(whole, model, Path(target))
        return Path(target)
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
        driven(model, drive, damped=_format(to).damped),
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
