"""What all pictures share: size, type, whole files."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.figure import Figure
from numpy.typing import ArrayLike
from PIL import Image

from nanorom.errors import FileError
from nanorom.files import stored
from nanorom.files.whole import atomic_path
from nanorom.scene.units import common_unit
from nanorom.scene.units import scaled as scaled
from nanorom.scene.units import with_unit as with_unit

COLUMN = 85 / 25.4  # width in inches of a journal column
RESOLUTION = 300  # dots per inch: 1004 pixels across a column

SETTINGS = {
    "axes.axisbelow": True,
    "axes.grid": True,
    "axes.labelsize": 8,
    "axes.linewidth": 0.6,
    "axes.titlesize": 7,
    "font.size": 7,
    "grid.color": "0.9",
    "grid.linewidth": 0.5,
    "legend.fontsize": 6.5,
    "legend.frameon": False,
    "lines.linewidth": 1.1,
    "mathtext.fontset": "dejavusans",
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
}


def axis_unit(values: ArrayLike, unit: str) -> tuple[float, str]:
    """Factor and unit for values along an axis, "10¹⁵ N/m³" where prefixes do not serve."""
    factor, name = common_unit(values, unit)
    name = re.sub(r"^1e(-?\d+) ", r"10^\1 ", name)
    return factor, re.sub(r"\^(-?\d+)", r"$^{\1}$", name)


def styled(draw: Callable[..., Figure]) -> Callable[..., Figure]:
    """Draw with the settings of this module, whatever the caller's are.

    What is drawn may be the name of its file instead.
    """

    drawn_kinds = next(iter(draw.__annotations__.values()), "")  # of demos there are none

    @wraps(draw)
    def drawn(content: Any, *args: Any, **options: Any) -> Figure:
        if drawn_kinds and isinstance(content, (str, Path)):
            path, content = content, stored.load(content)
            kind = type(content).__name__
            if kind not in drawn_kinds:
                raise FileError(f"{path}: found a {kind}; {draw.__name__} draws a {drawn_kinds}")
        with rc_context(SETTINGS):
            return draw(content, *args, **options)

    return drawn


def save(figure: Figure, path: str | Path) -> None:
    """Write the picture, whole or not at all, in the format of its suffix; raises FileError."""
    with atomic_path(path) as temporary, rc_context(SETTINGS):
        figure.savefig(temporary, dpi=RESOLUTION)
        if Path(path).suffix.lower() == ".png":
            _with_palette(temporary)


def _with_palette(path: Path) -> None:
    """Store a picture in 256 colours: to the eye the same, in a third of the bytes."""
    with Image.open(path) as image:
        reduced = image.convert("RGB").quantize(
            256, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE
        )
        dpi = image.info["dpi"]
    reduced.save(path, format="png", optimize=True, dpi=dpi)
