"""The invariant curve through the states that a motion takes at drive phase 0, by its frequencies.

The strongest line of the windowed spectrum is some combination of the second frequency and the
drive's; the base frequency is the one along whose angle the states lie on a smooth curve. Source of
the refinement of a line: Laskar 1993, doi:10.1016/0167-2789(93)90210-R.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize_scalar

from nanorom.continuation.orbits.harmonics import fourier_matrix
from nanorom.continuation.tori.circle import HARMONICS, circle
from nanorom.continuation.tori.invariance import Curve
from nanorom.continuation.tori.return_map import ReturnMap
from nanorom.errors import ContinuationError
from nanorom.types import Array

RECORDED = 401  # states from which the curve is made
PARTS = 4  # base frequencies tried: the line's divided by 1 ... PARTS
SMOOTH = 0.05  # error of the states against a curve, relative to its size, at most
SIMPLER = 2.0  # factor by which a curve of more turns must fit better
AT_REST = 1e-6  # spread of the states, relative to them, that is a periodic orbit
PERIODIC = "point: the motion from this state is periodic; no torus to follow"
FIRST = 12  # harmonics of the first curves


def recorded(map_: ReturnMap, state: Array, parameter: float, waited: int) -> Array:
    """States (RECORDED, 2L) at drive phase 0 after `waited` applications of the map."""
    states = []
    here = state[None]
    for number in range(waited + RECORDED):
        before, here = here, map_(here, parameter)
        if number == waited and np.abs(here - before).max() < AT_REST * np.abs(here).max():
            raise ContinuationError(PERIODIC)
        if not np.all(np.isfinite(here)):
            raise ContinuationError("point: the motion from this state does not stay finite")
        if number >= waited:
            states.append(here[0])
    return np.array(states)


def curve_through(states: Array, parameter: float) -> Curve:
    """A curve near states that follow one another by the map; raises ContinuationError where they
    lie on none, or all in one place.
    """
    spread = states - states.mean(axis=0)
    if np.abs(spread).max() < AT_REST * np.abs(states).max():
        raise ContinuationError(PERIODIC)
    line = _line(spread)
    best: tuple[float, float] | None = None
    for parts in range(1, PARTS + 1):
        for turns in range(parts):
            rotation = (line + 2 * np.pi * turns) / parts
            rotation, error = _refined(states, rotation)
            if best is None or error * SIMPLER < best[0]:
                best = error, rotation
    assert best is not None
    error, rotation = best
    if error > SMOOTH:
        raise ContinuationError(
            f"point: the states at drive phase 0 lie on no smooth curve (error {error:.1g} of its "
            "size); wait longer, give period_multiple, or the motion is irregular"
        )
    most = max(h for h in HARMONICS if 3 * h < len(states) // 2)
    coefficients, _ = _fitted(states, rotation, most)
    return Curve(circle(most).synthesis @ coefficients, rotation, parameter)


def _line(spread: Array) -> float:
    """Angle per step, in (0, pi), of the strongest line of the windowed states."""
    window = np.hanning(len(spread) + 2)[1:-1, None] ** 2
    direction = np.linalg.svd(spread, full_matrices=False)[2][0]
    signal = (window * spread) @ direction
    size = 8 * len(signal)
    peak = int(np.abs(np.fft.rfft(signal, size))[1:].argmax()) + 1
    number = np.arange(len(signal))

    def power(angle: float) -> float:
        return -float(np.abs(np.exp(-1j * angle * number) @ signal))

    bounds = 2 * np.pi * np.array([peak - 1, peak + 1]) / size
    return float(minimize_scalar(power, bounds=bounds, method="bounded", options={"xatol": 1e-9}).x)


def _fitted(states: Array, rotation: float, harmonics: int) -> tuple[Array, float]:
    """Fourier coefficients (2H + 1, 2L) of the curve through the states, and the largest error
    relative to its size.
    """
    table = fourier_matrix(rotation * np.arange(len(states)), harmonics)
    coefficients = np.linalg.lstsq(table, states, rcond=1e-10)[0]
    size = float(np.abs(states - states.mean(axis=0)).max())
    return coefficients, float(np.abs(table @ coefficients - states).max()) / size


def _refined(states: Array, rotation: float) -> tuple[float, float]:
    """The rotation next to a guess with the least error, and that error."""
    width = 0.2 * 2 * np.pi / len(states)

    def error(angle: float) -> float:
        return _fitted(states, angle, FIRST)[1]

    found = minimize_scalar(
        error,
        bounds=(rotation - width, rotation + width),
        method="bounded",
        options={"xatol": 1e-8},
    )
    return float(found.x), float(found.fun)
