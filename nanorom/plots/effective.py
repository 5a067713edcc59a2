"""What a fit of a single oscillator returns: its parts, and how it misleads as the drive grows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nanorom.plots.style import COLUMN, save, scaled, styled
from nanorom.results.effective import Effective

MOST_BARS = 7  # parts that are drawn, the largest ones
BAR = 0.13  # of a panel's height


@styled
def effective_figure(effective: Effective, path: str | Path | None = None) -> Figure:
    """Draw three panels (and write the picture).

    The backbone beside that of the Duffing oscillator that fits small amplitudes; the cubic
    coefficient that a fit up to an amplitude returns, by that of small ones, and the rate of decay;
    what shifts the frequency.
    """
    names, shift = _shifts(effective)
    low = 0.3 + BAR * len(names)  # a panel as tall as its bars need
    figure = Figure(figsize=(COLUMN, (1.3 + 0.5 * low) * COLUMN), layout="constrained")
    above, middle, below = figure.subplots(3, 1, height_ratios=[1, 1, low])
    _backbone(above, effective)
    _fits(middle, effective)
    _parts(below, names, shift)
    if path is not None:
        save(figure, path)
    return figure


def _backbone(axes: Axes, effective: Effective) -> None:
    a, metre = scaled(effective.amplitude, "m")
    f, hertz = scaled(effective.omega / (2 * np.pi), "Hz")
    shown = effective.amplitude * a
    axes.plot(effective.omega / (2 * np.pi) * f, shown, label=f"manifold, order {effective.order}")
    axes.plot(
        effective.duffing / (2 * np.pi) * f, shown, "--", label="Duffing, fitted at low drive"
    )
    axes.set_xlabel(f"frequency ({hertz})")
    axes.set_ylabel(f"amplitude of {effective.mode} ({metre})")
    axes.legend()


def _fits(axes: Axes, effective: Effective) -> None:
    a, metre = scaled(effective.amplitude, "m")
    shown = effective.amplitude[1:] * a
    if effective.cubic:
        axes.plot(shown, effective.fitted[1:] / effective.cubic, label="cubic coefficient of a fit")
    if effective.decay[0] > 0:
        axes.plot(shown, effective.decay[1:] / effective.decay[0], label="decay rate")
    axes.set_xlabel(f"largest amplitude fitted ({metre})")
    axes.set_ylabel("by that of small amplitudes")
    axes.legend()


def _shifts(effective: Effective) -> tuple[list[str], np.ndarray]:
    """What parts of the coefficients shift the frequency by at the largest amplitude, by name."""
    a, k = effective.amplitude[-1], effective.stiffness
    cubic = 3 / 8 * effective.part_cubic * a**2 / k
    quintic = 5 / 16 * effective.part_quintic * a**4 / k
    names = [f"{name}{of}" for of in ("", ", quintic") for name in effective.part]
    shift = np.concatenate([cubic, quintic])
    order = np.argsort(-np.abs(shift))[:MOST_BARS]
    order = order[shift[order] != 0][::-1]
    return [names[i] for i in order], shift[order]


def _parts(axes: Axes, names: list[str], shift: np.ndarray) -> None:
    """A bar for each part, by colour upwards or downwards."""
    places = np.arange(len(names))
    for colour, text, own in (("C0", "upwards", shift > 0), ("C3", "downwards", shift < 0)):
        if own.any():
            axes.barh(places[own], np.abs(shift[own]), height=0.6, color=colour, label=text)
    axes.set_yticks(places, names)
    axes.set_ylim(-0.6, max(len(names), 1) - 0.4)
    axes.set_xscale("log")
    axes.set_xlabel("relative shift of the frequency")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
