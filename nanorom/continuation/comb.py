"""Frequency combs as a spectrum analyser shows them: lines against drive frequency.

Where a stable torus is known its lines are exact; elsewhere, where motion is periodic or irregular,
the equations are integrated as in a `sweep` and the windowed record is transformed. Source of the
window: Harris 1978, doi:10.1109/PROC.1978.10837 (Blackman-Harris, side lobes below -92 dB).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import attrs
import numpy as np
from scipy.integrate import odeint

from nanorom.continuation.sweep import equations, sweep
from nanorom.continuation.system import ModalSystem
from nanorom.continuation.threads import one_thread
from nanorom.continuation.tori.torus import Torus, TorusState
from nanorom.errors import ContinuationError
from nanorom.types import Array

PER_PERIOD = 32  # samples of a period of the drive: lines up to its 16th harmonic


@attrs.frozen(eq=False)
class Comb:
    """omega (n,): drive frequencies, rad per unit of time; frequency (m,): middles of the cells of
    the analyser; amplitude (n, m, L): largest line of q within each cell, in the unit of q; exact
    (n,): whether a row is that of a torus rather than of a record in time.
    """

    omega: Array
    frequency: Array
    amplitude: Array
    exact: Array


@one_thread()
def comb(
    system: ModalSystem,
    omega: Sequence[float] | Array,
    band: tuple[float, float],
    direct: float = 0.0,
    parametric: float = 0.0,
    *,
    tori: Sequence[Torus] = (),
    state: Array | None = None,
    cells: int = 400,
    periods: int = 400,
    recorded: int = 256,
    tolerance: float = 1e-8,
) -> Comb:
    """The spectra of the motion while the drive frequency passes through `omega` in order.

    Parameters
    ----------
    system : ModalSystem
    omega : (n,), drive frequencies in the order of the sweep, rad per unit of time
    band : (low, high), what the analyser shows, rad per unit of time
    direct, parametric : drive levels
    tori : families followed in omega at these levels; the first stable torus at a frequency is
        taken for the motion there
    state : (2L,), initial (q, dq/dt); a small disturbance of rest if left out
    cells : number m of the analyser's cells
    periods : most drive periods waited at one frequency, where time is integrated
    recorded : drive periods of a record; its lines are 8 / recorded of omega wide
    tolerance : relative error of the time integration

    Raises
    ------
    ContinuationError
        for invalid frequencies or a band that is not rising, or if the integration fails.
    """
    low, high = (float(value) for value in band)
    if not (np.isfinite(low) and np.isfinite(high) and 0 <= low < high):
        raise ContinuationError(f"band: found ({low:g}, {high:g}); allowed a rising range above 0")
    edges = np.linspace(low, high, cells + 1)
    levels = {"direct": direct, "parametric": parametric}
    asked = {"periods": periods, "recorded": recorded, "tolerance": tolerance}
    in_time = partial(record, system, **levels, **asked)
    rows, exact = [], []
    for frequency in np.asarray(omega, dtype=float):
        torus = _torus(tori, float(frequency))
        if torus is not None:
            rates, lines, _ = torus.motion.spectrum(0.0)
            state = np.concatenate([torus.motion(0.0), torus.motion.velocity(0.0)])
            amplitudes = np.abs(lines)
        else:
            rates, amplitudes, state = in_time(float(frequency), state=state)
        rows.append(_cells(rates, amplitudes, edges))
        exact.append(torus is not None)
    middles = (edges[1:] + edges[:-1]) / 2
    return Comb(np.asarray(omega, dtype=float), middles, np.array(rows), np.array(exact))


@one_thread()
def record(
    system: ModalSystem,
    omega: float,
    direct: float = 0.0,
    parametric: float = 0.0,
    *,
    state: Array | None = None,
    periods: int = 400,
    recorded: int = 256,
    tolerance: float = 1e-8,
) -> tuple[Array, Array, Array]:
    """Angular frequencies (m,), rad per unit of time, amplitudes (m, L) of the windowed record of q
    in time, in its unit, and the state (2L,) at its end. A line shows its amplitude at its peak.

    Arguments as of `comb`; raises ContinuationError like `sweep`.
    """
    settled = sweep(
        system,
        [omega],
        direct,
        parametric,
        state=state,
        periods=periods,
        tolerance=tolerance,
    )
    scaled = system.scaled(direct, parametric)
    size, rate = scaled.size, omega / scaled.frequency
    count = recorded * PER_PERIOD
    times = 2 * np.pi / rate / PER_PERIOD * np.arange(count + 1)
    options = {"rtol": tolerance, "atol": 1e-4 * tolerance, "tfirst": True, "mxstep": 100_000}
    start = scaled.inner_states(settled.state[0])
    motion = scaled.given_states(odeint(equations(scaled, rate), start, times, **options))
    if not np.all(np.isfinite(motion)):
        raise ContinuationError(f"time integration failed at omega = {omega:.6g}")
    from scipy.signal.windows import blackmanharris  # takes .3 s to import

    window = blackmanharris(count, sym=False)[:, None]
    spectrum = np.abs(np.fft.rfft(window * motion[:-1, :size], axis=0)) * 2 / window.sum()
    spectrum[0] /= 2
    return omega / recorded * np.arange(len(spectrum)), spectrum, motion[-1]


def _torus(tori: Sequence[Torus], omega: float) -> TorusState | None:
    for torus in tori:
        for state in torus.at(omega) if torus.varied == "omega" else ():
            if state.stable:
                return state
    return None


def _cells(rates: Array, amplitudes: Array, edges: Array) -> Array:
    """The largest amplitude (m, L) of the lines within each cell, 0 where there is none."""
    result = np.zeros((len(edges) - 1, amplitudes.shape[1]))
    place = np.searchsorted(edges, rates, side="right") - 1
    inside = (place >= 0) & (place < len(result))
    np.maximum.at(result, place[inside], amplitudes[inside])
    return result
