"""What a lock-in amplifier shows of a response: decibels and phase of a mode or a point."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from nanorom.continuation import Readout
from nanorom.plots.curves import line_style, marker_style, pieces, smooth
from nanorom.plots.response import colours, frequency_unit, legend
from nanorom.plots.style import COLUMN, save, styled
from nanorom.results.readings import REFERENCE, Output, order, reading, signal
from nanorom.results.response import Response
from nanorom.types import Array

SMALLEST = 1e-5  # of the largest amplitude: decibels below are not drawn
TURN = 360.0  # degrees


@styled
def reading_figure(
    response: Response,
    output: Output,
    harmonic: object = 1,
    path: str | Path | None = None,
    name: str = "",
) -> Figure:
    """Draw decibels and phase of one harmonic of an output against drive frequency.

    Decibels are of 1 nm; where the response has a readout, dBm of its voltage.  output, harmonic:
    as for `Response.table`; name: of the output, its own if left out. Writes the picture if a path
    is given. Raises ContinuationError for an output or a harmonic that is not there, FileError if
    the picture cannot be written.
    """
    figure = Figure(figsize=(COLUMN, 1.1 * COLUMN), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    frequency = frequency_unit(response)
    start, stop = (2 * np.pi * f for f in response.sweep.hertz(float(response.frequency[0])))
    largest, read = 0.0, reading if response.readout is None else signal
    decibel, unit = _decibels(response)
    for colour, diagram in zip(colours(response), response.diagrams):
        for branch in diagram.branches:
            found = read(response, branch, output, harmonic)
            if not found.size.any():
                continue
            omega, parts, position = smooth(branch.omega, np.column_stack([found.x, found.y]))
            inside = (omega >= start) & (omega <= stop)
            largest = max(largest, np.linalg.norm(parts[inside], axis=1).max(initial=0.0))
            phase = _degrees(Readout(omega, parts[:, 0] + 1j * parts[:, 1]))
            whole = np.column_stack([parts, phase])
            for curve in pieces(omega, whole, np.asarray(branch.stable, dtype=bool), position):
                style = {"color": colour, **line_style(curve.stable)}
                x, y, angle = curve.amplitude.T
                size = Readout(curve.omega, x + 1j * y)
                upper.plot(curve.omega * frequency[0], decibel(size), **style)
                lower.plot(curve.omega * frequency[0], angle, **style)
        for point in diagram.special_points:
            if start <= point.omega <= stop:
                found = read(response, point, output, harmonic)
                if found.size[0] > 0:
                    style = {**marker_style(point.type), "color": colour, "linestyle": "none"}
                    at = found.omega * frequency[0]
                    upper.plot(at, decibel(found), zorder=3, **style)
    top = decibel(Readout(np.zeros(1), np.array([largest + 0j])))[0]
    upper.set_ylim(top + 20 * np.log10(SMALLEST), top + 5)
    upper.set_xlim(start * frequency[0], stop * frequency[0])
    name = name or (output if isinstance(output, str) else "the output")
    multiple = "" if order(harmonic) == 1 else f" at {order(harmonic)} of the drive's frequency"
    upper.set_ylabel(f"{name}{multiple} ({unit})")
    lower.set_ylabel("phase (degrees)")
    lower.yaxis.set_major_locator(_quarters())
    lower.set_xlabel(f"drive frequency ({frequency[1]})")
    legend(upper, response)
    if path is not None:
        save(figure, path)
    return figure


def _degrees(found: Readout) -> Array:
    """Phase without jumps, which begins within half a turn of 0."""
    degrees = np.degrees(found.phase)
    return np.asarray(degrees - TURN * np.round(degrees[0] / TURN))


def _decibels(response: Response) -> tuple[Callable[[Readout], Array], str]:
    """What makes decibels of what is read, and their unit."""
    instrument = response.readout
    if instrument is None:
        return lambda found: found.decibel(REFERENCE), "dB re 1 nm"
    dbm = instrument.dbm
    return lambda found: dbm(found.size), "dBm"


def _quarters() -> Any:
    from matplotlib.ticker import MultipleLocator

    return MultipleLocator(TURN / 4)
