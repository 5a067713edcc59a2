"""Pictures of what a file of nanorom holds, as `nanorom plot` draws them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from nanorom.errors import FileError
from nanorom.plots.comb import comb_figure
from nanorom.plots.design import design_figure
from nanorom.plots.effective import effective_figure
from nanorom.plots.loads import load_curve
from nanorom.plots.modes import mode_gallery
from nanorom.plots.reading import reading_figure
from nanorom.plots.response import amplitude_panels, frequency_unit, response_figure
from nanorom.plots.study import study_figure
from nanorom.plots.verified import verified_figure
from nanorom.scene.fields import read_quantities
from nanorom.scene.units import wrong
from nanorom.types import Progress

if TYPE_CHECKING:
    from nanorom.measurement.data import MeasuredResponse
    from nanorom.results.design import Design
    from nanorom.results.effective import Effective
    from nanorom.results.loadcurve import LoadCurve
    from nanorom.results.readings import Output
    from nanorom.results.response import Response
    from nanorom.results.study import Study
    from nanorom.results.verified import Verified
    from nanorom.rom.model import ReducedModel

SPOT = "spot"  # of --read: where the response's readout looks


def draw_model(
    model: ReducedModel, path: Path, folder: Path, measured: MeasuredResponse | None = None
) -> None:
    """modes.png: every mode shape."""
    _no_data(path, measured)
    mode_gallery(model, folder / "modes.png")


def draw_response(
    response: Response, path: Path, folder: Path, measured: MeasuredResponse | None = None
) -> None:
    """response.png, over which measured data are drawn, and amplitudes.png, mode by mode."""
    response_figure(response, folder / "response.png", measured)
    amplitude_panels(response, folder / "amplitudes.png")


def draw_reading(content: Any, path: Path, folder: Path, output: str, harmonic: str) -> None:
    """reading.png: decibels and phase of a mode, by its name, or of a point, "1 um, 0.5 um".

    ``output`` may be "spot", the place of the response's readout.  Raises FileError for a file that
    is no response; for a point, without its model beside it.
    """
    from nanorom.results.beside import MODEL, model_beside
    from nanorom.results.response import Response

    if not isinstance(content, Response):
        raise FileError(f"{path}: --read goes with a response.h5 alone")
    place: Output = output
    spot = None
    if output == SPOT:
        spot = None if content.readout is None else content.readout.position
        if spot is None:
            raise FileError(f"{path}: has no readout.position, which --read {SPOT} needs")
    if "," in output or spot is not None:
        x, y = spot or _point(output)
        shapes = model_beside(content, path).shapes
        if shapes is None:
            raise FileError(f"{path.with_name(MODEL)}: keeps no shapes, which a point needs")
        place = shapes.at((x, y))
    reading_figure(content, place, harmonic, folder / "reading.png", output)


def draw_comb(
    content: Any, path: Path, folder: Path, level: int | None, progress: Progress | None = None
) -> None:
    """comb.png: the spectrum of the mode that moves most, over drive frequency, at a level from 1.

    Raises FileError for a file that is no response, or without its model beside it.
    """
    from nanorom.results.comb import comb_beside
    from nanorom.results.response import Response

    if not isinstance(content, Response):
        raise FileError(f"{path}: --comb goes with a response.h5 alone")
    found = comb_beside(content, path, level, progress)
    factor, unit = frequency_unit(content)
    comb_figure(found, folder / "comb.png", unit=1 / factor, name=unit, length="m")


def draw_verified(
    verified: Verified, path: Path, folder: Path, measured: MeasuredResponse | None = None
) -> None:
    """A picture of the file's name: amplitudes of model and film, and errors below."""
    _no_data(path, measured)
    verified_figure(verified, folder / path.with_suffix(".png").name)


def draw_effective(
    effective: Effective, path: Path, folder: Path, measured: MeasuredResponse | None = None
) -> None:
    """A picture of the file's name: backbone, what fits return, parts of the coefficient."""
    _no_data(path, measured)
    effective_figure(effective, folder / path.with_suffix(".png").name)


def draw_study(
    study: Study, path: Path, folder: Path, measured: MeasuredResponse | None = None
) -> None:
    """A picture of the file's name: quantities against what varies."""
    _no_data(path, measured)
    study_figure(study, folder / path.with_suffix(".png").name)


def draw_design(
    design: Design, path: Path, folder: Path, measured: MeasuredResponse | None = None
) -> None:
    """A picture of the file's name: formulas against keys, and a front."""
    _no_data(path, measured)
    design_figure(design, folder / path.with_suffix(".png").name)


def draw_load_curve(
    curve: LoadCurve, path: Path, folder: Path, measured: MeasuredResponse | None = None
) -> None:
    """A picture of the file's name: deflection and frequencies against the load."""
    _no_data(path, measured)
    load_curve(curve, folder / path.with_suffix(".png").name)


def _point(text: str) -> tuple[float, ...]:
    """x and y in m; raises SceneError."""
    found = read_quantities(text.split(","), "m", "--read")
    if len(found) != 2:
        raise wrong("--read", text, 'x and y such as "1 um, 0 um"')
    return found


def _no_data(path: Path, measured: MeasuredResponse | None) -> None:
    if measured is not None:
        raise FileError(f"{path}: --data goes with a response.h5 alone")
