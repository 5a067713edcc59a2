"""Pictures of what a file of nanorom holds, as `nanorom plot` draws them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from nanorom.errors import FileError
from nanorom.plots.effective import effective_figure
from nanorom.plots.loads import load_curve
from nanorom.plots.modes import mode_gallery
from nanorom.plots.response import amplitude_panels, response_figure
from nanorom.plots.verified import verified_figure

if TYPE_CHECKING:
    from nanorom.measurement.data import MeasuredResponse
    from nanorom.results.effective import Effective
    from nanorom.results.loadcurve import LoadCurve
    from nanorom.results.response import Response
    from nanorom.results.verified import Verified
    from nanorom.rom.model import ReducedModel


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


def draw_load_curve(
    curve: LoadCurve, path: Path, folder: Path, measured: MeasuredResponse | None = None
) -> None:
    """A picture of the file's name: deflection and frequencies against the load."""
    _no_data(path, measured)
    load_curve(curve, folder / path.with_suffix(".png").name)


def _no_data(path: Path, measured: MeasuredResponse | None) -> None:
    if measured is not None:
        raise FileError(f"{path}: --data goes with a response.h5 alone")
