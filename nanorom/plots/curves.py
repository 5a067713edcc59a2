"""How branches are drawn: stretches of equal stability, smooth in between, and markers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import attrs
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator

from nanorom.continuation.orbits.bifurcations import KINDS
from nanorom.types import Array

UNSTABLE = (0, (2.5, 1.2))
TAKES_PART = 1e-3  # of the largest amplitude; modes below are not drawn
NEUTRAL = "0.3"
UNEXPLORED = {"marker": "x", "linestyle": "none", "markersize": 3.2, "markeredgewidth": 0.8}
FINER = 8  # straight pieces per continuation step
SHORTEST = 1e-9  # of the picture; keeps points apart that coincide
APART = 1e-5  # of a branch; special points closer to one of its points are not told apart
FEWEST = 5  # points that a smooth curve needs


@attrs.frozen(eq=False)
class Curve:
    """A stretch of a branch that is stable or unstable throughout."""

    omega: Array
    amplitude: Array
    stable: bool


def stretches(branch: Any, located: list[Any]) -> Iterator[Curve]:
    """Cut a branch where its stability changes; the unstable side closes the gap."""
    omega, amplitude, stable = _with_located(branch, located)
    omega, amplitude, position = smooth(omega, amplitude)
    yield from pieces(omega, amplitude.clip(min=0), stable, position)


def pieces(
    omega: Array, amplitude: Array, stable: NDArray[np.bool_], position: NDArray[np.int64]
) -> Iterator[Curve]:
    """Stretches of a smooth curve, given the stability of points and where in it they are."""
    changes = np.flatnonzero(np.diff(stable)) + 1
    ends = [0, *changes, len(stable)]
    for start, stop in zip(ends[:-1], ends[1:]):
        holds = bool(stable[start])
        first, last = (
            (start, stop - 1) if holds else (max(start - 1, 0), min(stop, len(stable) - 1))
        )
        part = slice(position[first], position[last] + 1)
        yield Curve(omega[part], amplitude[part], holds)


def _with_located(branch: Any, located: list[Any]) -> tuple[Array, Array, NDArray[np.bool_]]:
    """A branch's points and stability, its special points among them: steps pass over folds."""
    omega, amplitude = np.asarray(branch.omega), np.asarray(branch.amplitude)
    stable = np.asarray(branch.stable, dtype=bool)
    width, height = np.ptp(omega), amplitude.max(initial=0.0)
    if width == 0 or height == 0:
        return omega, amplitude, stable
    for point in located:
        points = np.column_stack([omega / width, amplitude / height])
        own = np.concatenate([[point.omega / width], point.amplitude / height])
        away = np.linalg.norm(points - own, axis=1)
        detour = away[:-1] + away[1:] - np.linalg.norm(np.diff(points, axis=0), axis=1)
        after = int(np.argmin(detour)) + 1
        if away[after - 1 : after + 1].min() > APART:
            omega = np.insert(omega, after, point.omega)
            amplitude = np.insert(amplitude, after, point.amplitude, axis=0)
            stable = np.insert(stable, after, stable[after - 1] or stable[after])
    return omega, amplitude, stable


def smooth(omega: Array, amplitude: Array) -> tuple[Array, Array, NDArray[np.int64]]:
    """A smooth curve through the points of a branch, and where in it the points are.

    The steps of a continuation are long where the branch is easy to predict, too long for straight
    lines. Akima's interpolation stays local and does not overshoot.
    """
    width, height = np.ptp(omega), np.abs(amplitude).max(initial=0.0)
    if len(omega) < FEWEST or width == 0 or height == 0:
        return omega, amplitude, np.arange(len(omega))
    points = np.column_stack([omega / width, amplitude / height])
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    length = np.concatenate([[0.0], np.cumsum(steps + SHORTEST)])
    index = np.arange(FINER * (len(omega) - 1) + 1) / FINER
    fine = np.interp(index, np.arange(len(omega)), length)
    curve = Akima1DInterpolator(length, np.column_stack([omega, amplitude]))(fine)
    return curve[:, 0], curve[:, 1:], FINER * np.arange(len(omega))


def line_style(stable: bool) -> dict[str, Any]:
    return {"linestyle": "-" if stable else UNSTABLE, "linewidth": 1.1 if stable else 0.8}


def marker_style(kind: str) -> dict[str, Any]:
    return {
        "marker": KINDS[kind].marker,
        "markerfacecolor": "white",
        "markersize": 3.2,
        "markeredgewidth": 0.8,
    }
