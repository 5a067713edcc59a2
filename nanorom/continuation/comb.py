"""Frequency combs as a spectrum analyser shows them: lines against drive frequency.

Where a stable torus is known its lines are those between its nearest members; elsewhere, where
motion is periodic or irregular, the equations are integrated as in a sweep, and all records that
start from its states are made at once and transformed. Source of the window: Harris 1978,
doi:10.1109/PROC.1978.10837 (Blackman-Harris, side lobes below -92 dB).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import groupby
from typing import Any

import attrs
import numpy as np

from nanorom.continuation.arrays import brief
from nanorom.continuation.ensemble.ensemble import ensemble_of, members_of
from nanorom.continuation.ensemble.sweeps import sweeps
from nanorom.continuation.system import ModalSystem
from nanorom.continuation.threads import one_thread
from nanorom.continuation.tori.torus import Torus
from nanorom.errors import ContinuationError
from nanorom.types import Array

PER_PERIOD = 32  # samples of a period of the drive: lines up to its 16th harmonic
AT_ONCE = 16  # records made at once: some 100 MB of eleven modes


@brief
@attrs.frozen(eq=False)
class Comb:
    """omega (n,): drive frequencies, rad per unit of time; frequency (m,): middles of the cells of
    the analyser; amplitude (n, m, L): largest line of q within each cell, in the unit of q, NaN
    where the motion had left all bounds; exact (n,): whether a row is that of a torus rather than
    of a record in time; second (n,): second base frequency of those, NaN of the others.
    """

    omega: Array
    frequency: Array
    amplitude: Array
    exact: Array
    second: Array


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
    progress: Callable[[int, int], None] | None = None,
) -> Comb:
    """The spectra of the motion while the drive frequency passes through `omega` in order.

    Parameters
    ----------
    system : ModalSystem
    omega : (n,), drive frequencies in the order of the sweep, rad per unit of time
    band : (low, high), what the analyser shows, rad per unit of time
    direct, parametric : drive levels
    tori : families followed in omega at these levels; the first that is stable at a frequency is
        taken for the motion there, its lines interpolated between its members on both sides
    state : (2L,), initial (q, dq/dt); a small disturbance of rest if left out
    cells : number m of the analyser's cells
    periods : most drive periods waited at one frequency, where time is integrated
    recorded : drive periods of a record; its lines are 8 / recorded of omega wide
    tolerance : relative error of the time integration
    progress : called with rows that are done, and how many there are

    Raises
    ------
    ContinuationError
        for invalid frequencies or a band that is not rising, or if the integration fails.
    """
    low, high = (float(value) for value in band)
    if not (np.isfinite(low) and np.isfinite(high) and 0 <= low < high):
        raise ContinuationError(f"band: found ({low:g}, {high:g}); allowed a rising range above 0")
    if cells < 1 or recorded < 1:
        raise ContinuationError(f"cells, recorded: found {cells}, {recorded}; allowed 1 or more")
    omega, edges = np.asarray(omega, dtype=float), np.linspace(low, high, cells + 1)
    known = [_between(tori, float(frequency)) for frequency in omega]
    waits = _Waits(system, direct, parametric, periods, recorded, tolerance)
    amplitude = waits.rows(omega, known, state, edges, progress or (lambda done, total: None))
    exact = np.array([torus is not None for torus in known])
    second = np.array([np.nan if torus is None else torus.second for torus in known])
    return Comb(omega, (edges[1:] + edges[:-1]) / 2, amplitude, exact, second)


@attrs.frozen(eq=False)
class _Waits:
    """How rows are made in time: of what, how long it is waited, how long recorded."""

    system: ModalSystem
    direct: float
    parametric: float
    periods: int
    recorded: int
    tolerance: float

    def rows(
        self,
        omega: Array,
        known: Sequence[_Lines | None],
        state: Array | None,
        edges: Array,
        told: Callable[[int, int], None],
    ) -> Array:
        """Amplitudes (n, m, L), of the rows that are not known from sweeps that go on where the
        known ones end; nothing after a motion has left all bounds.
        """
        system = self.system
        size = system.size + (system.states.size if system.states else 0)
        amplitude = np.full((len(omega), len(edges) - 1, size), np.nan)
        starts = np.full((len(omega), 2 * size), np.nan)
        levels = self.direct, self.parametric
        options: dict[str, Any] = {"periods": self.periods, "tolerance": self.tolerance}
        for _, group in groupby(range(len(omega)), key=lambda row: known[row] is None):
            rows = list(group)
            for row in rows:
                lines = known[row]
                if lines is not None:
                    amplitude[row] = _cells(lines.rates, lines.amplitudes, edges)
                    state = lines.state
            if known[rows[0]] is None:
                found = sweeps(system, omega[rows], *levels, state=state, **options)
                starts[rows], state = found.state[0], found.state[0, -1]
                if not np.isnan(found.escaped[0]):
                    break
            told(rows[-1] + 1, len(omega))
        some = np.flatnonzero(np.isfinite(starts[:, 0]))
        made = records(system, omega[some], *levels, starts[some], self.recorded, self.tolerance)
        for row, (rates, sizes, _) in zip(some, made):
            amplitude[row] = _cells(rates, sizes, edges)
        return amplitude


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

    Arguments as of `comb`; raises ContinuationError like `sweeps`, and where the motion leaves all
    bounds.
    """
    levels = direct, parametric
    settled = sweeps(system, [omega], *levels, state=state, periods=periods, tolerance=tolerance)
    if not np.isnan(settled.escaped[0]):
        raise ContinuationError(f"omega: the motion leaves all bounds at {omega:.6g}")
    start = settled.state[:, 0]
    return next(records(system, np.array([omega]), *levels, start, recorded, tolerance))


def records(
    system: ModalSystem,
    omega: Array,
    direct: float,
    parametric: float,
    states: Array,
    recorded: int,
    tolerance: float,
) -> Iterator[tuple[Array, Array, Array]]:
    """What `record` gives, one after the other, from states (n, 2L) at drive frequencies (n,)."""
    from scipy.signal.windows import blackmanharris  # takes .3 s to import

    count = recorded * PER_PERIOD
    window = blackmanharris(count, sym=False)[:, None]
    for first in range(0, len(omega), AT_ONCE):
        some = slice(first, first + AT_ONCE)
        members = members_of(system, omega[some, None], direct, parametric, states[some])
        ensemble = ensemble_of(system, members, tolerance, "auto", None)
        unit, rates = ensemble.equations.scaled, members.omega[:, 0]
        begin = np.ascontiguousarray(unit.inner_states(members.states).T)[None]
        everyone = np.arange(len(rates))
        _, found, left = ensemble.run(begin, everyone, rates / unit.frequency, recorded, count)
        for member, rate in enumerate(rates):
            motion = np.concatenate([begin[0][:, member][None], found[:, :, member]])
            motion = unit.given_states(motion)
            if left[member]:
                motion = np.full_like(motion, np.nan)
            q = motion[:-1, : unit.size]
            spectrum = np.abs(np.fft.rfft(window * q, axis=0)) * 2 / window.sum()
            spectrum[0] /= 2
            yield rate / recorded * np.arange(len(spectrum)), spectrum, motion[-1]


@attrs.frozen(eq=False)
class _Lines:
    """Rates (n,) and amplitudes (n, L) of a torus, its second frequency, its state (2L,)."""

    rates: Array
    amplitudes: Array
    second: float
    state: Array


def _between(tori: Sequence[Torus], omega: float) -> _Lines | None:
    """Lines of the first stable torus at a frequency, from the members on both sides of it."""
    for torus in tori:
        if torus.varied != "omega":
            continue
        values, stable = torus.omega, torus.stable
        passed = (values[:-1] - omega) * (values[1:] - omega) <= 0
        for index in np.flatnonzero(np.all([passed, stable[:-1], stable[1:]], axis=0)):
            part = (omega - values[index]) / (values[index + 1] - values[index])
            return _mixed(torus, int(index), float(part), omega)
    return None


def _mixed(torus: Torus, index: int, part: float, omega: float) -> _Lines:
    """The lines a part (0 to 1) of the way from one member of a family to the next."""
    ends = torus[index], torus[index + 1]
    weights = 1 - part, part
    # of both members, by the largest numbers of harmonics of the two
    most = [max(end.motion.coefficients.shape[axis] for end in ends) for axis in (0, 1)]
    sizes = np.zeros((*most, ends[0].motion.coefficients.shape[2]))
    for end, weight in zip(ends, weights):
        own = np.abs(end.motion.coefficients)
        more = (most[0] - own.shape[0]) // 2
        padded = np.pad(own, [(more, more), (0, most[1] - own.shape[1]), (0, 0)])
        sizes = sizes + weight * padded
    second = sum(weight * end.second for end, weight in zip(ends, weights))
    first = np.arange(most[0]) - most[0] // 2
    rates = np.add.outer(omega / torus.period_multiple * first, second * np.arange(most[1]))
    motion = ends[round(part)].motion
    state = np.concatenate([motion(0.0), motion.velocity(0.0)])
    return _Lines(np.abs(rates.ravel()), np.reshape(sizes, (-1, len(state) // 2)), second, state)


def _cells(rates: Array, amplitudes: Array, edges: Array) -> Array:
    """The largest amplitude (m, L) of the lines within each cell, 0 where there is none."""
    result = np.zeros((len(edges) - 1, amplitudes.shape[1]))
    place = np.searchsorted(edges, rates, side="right") - 1
    inside = (place >= 0) & (place < len(result))
    np.maximum.at(result, place[inside], amplitudes[inside])
    return result
