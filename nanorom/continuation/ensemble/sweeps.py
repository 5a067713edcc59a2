"""Many sweeps of the drive frequency at once: over levels, starts, ranges.

Each does what `sweep` does: the frequency is held while the transient dies out and the largest
|q_r| of two periods is recorded; then it changes at phase 0 of the drive. A sweep that has settled
goes on while others wait.
"""

from __future__ import annotations

from collections.abc import Callable

import attrs
import numpy as np

from nanorom.continuation.arrays import brief
from nanorom.continuation.ensemble.ensemble import Ensemble, ensemble_of, members_of
from nanorom.continuation.sweep import CHUNK, REST, SAMPLES, largest
from nanorom.continuation.system import ModalSystem
from nanorom.continuation.threads import one_thread
from nanorom.types import Array, Numbers

TURNS = 2  # periods of the drive in which a doubled motion comes back


@brief
@attrs.frozen(eq=False)
class Sweeps:
    """B sweeps of n frequencies each.

    omega (B, n); amplitude (B, n, L) = max |q_r| over two periods; state (B, n, 2L) at drive phase
    0; settled (B, n): whether the stroboscopic state had come to rest, in the system's units;
    escaped (B,): frequency at which the motion left all bounds, NaN of those that did not; from
    there on amplitude and state are NaN. direct, parametric (B,): levels.
    """

    omega: Array
    direct: Array
    parametric: Array
    amplitude: Array
    state: Array = attrs.field(repr=False)
    settled: Array
    escaped: Array

    def __len__(self) -> int:
        return len(self.omega)


@one_thread()
def sweeps(
    system: ModalSystem,
    omega: object,
    direct: object = 0.0,
    parametric: object = 0.0,
    *,
    state: object = None,
    periods: int = 300,
    settle: float = 1e-3,
    tolerance: float = 1e-6,
    engine: str = "auto",
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Sweeps:
    """Integrate many sweeps in time at once.

    Parameters
    ----------
    system : ModalSystem
    omega : (n,) or (B, n), drive frequencies in the order of the sweeps, rad per unit of time
    direct, parametric : drive levels, one or (B,)
    state : (2L,) or (B, 2L), initial (q, dq/dt); a small disturbance of rest if left out
    periods : most drive periods waited at one frequency
    settle : relative change of the state over two drive periods that counts as settled
    tolerance : relative error of a step of the time integration
    engine : "compiled", "arrays" (NumPy), or "auto": compiled where there is a C compiler
    workers : threads of the compiled engine; as many as processors if left out
    progress : called with the frequencies that are done of all sweeps, and how many there are

    Raises
    ------
    ContinuationError
        for invalid frequencies, levels or states, too many numbers to keep, or an engine that is
        not there.
    """
    members = members_of(system, omega, direct, parametric, state)
    ensemble = ensemble_of(system, members, tolerance, engine, workers)
    unit = ensemble.equations.scaled
    run = _Run(ensemble, members.omega / unit.frequency, unit.inner_states(members.states))
    run.to_the_end(periods, settle, progress)
    return Sweeps(
        omega=members.omega,
        direct=members.direct,
        parametric=members.parametric,
        amplitude=np.abs(unit.given(run.amplitude)),
        state=unit.given_states(run.recorded),
        settled=run.settled,
        escaped=run.escaped * unit.frequency,
    )


class _Run:
    """The state of all sweeps, in scaled units; what they have recorded."""

    def __init__(self, ensemble: Ensemble, omega: Array, states: Array) -> None:
        count, length = omega.shape
        self.ensemble, self.omega = ensemble, omega
        self.states = np.ascontiguousarray(states.T)[None]
        self.place, self.waited = np.zeros((2, count), dtype=int)
        self.amplitude = np.full((count, length, ensemble.equations.size), np.nan)
        self.recorded = np.full((count, length, states.shape[1]), np.nan)
        self.settled = np.zeros((count, length), dtype=bool)
        self.escaped = np.full(count, np.nan)

    def to_the_end(
        self, periods: int, settle: float, progress: Callable[[int, int], None] | None
    ) -> None:
        length = self.omega.shape[1]
        going = np.arange(len(self.omega))
        while len(going):
            samples = self._advance(going, TURNS * CHUNK, CHUNK)
            self.waited[going] += TURNS * CHUNK
            changes = np.abs(samples[-1] - samples[-2]).max(axis=0)
            rest = changes < settle * np.fmax(np.abs(samples[-1]).max(axis=0), REST)
            done = (rest | (self.waited[going] >= periods)) & np.isnan(self.escaped[going])
            self._record(going[done], rest[done])
            going = np.flatnonzero((self.place < length) & np.isnan(self.escaped))
            if progress is not None:
                gone = np.where(np.isnan(self.escaped), self.place, length)
                progress(int(gone.sum()), self.omega.size)

    def _advance(self, some: Numbers, periods: int, samples: int) -> Array:
        """Samples (n, 2L, b) of some sweeps, which are moved to the end of so many periods."""
        omega = self.omega[some, self.place[some]]
        states, found, left = self.ensemble.run(
            self.states[..., some], some, omega, periods, samples
        )
        self.states[..., some] = states
        self.escaped[some[left]] = omega[left]
        return found

    def _record(self, some: Numbers, rest: Array) -> None:
        """Read those that have waited, and let them go on."""
        if not len(some):
            return
        omega = self.omega[some, self.place[some]]
        begin = self.states[0][:, some]
        samples = np.concatenate([begin[None], self._advance(some, TURNS, TURNS * SAMPLES)])
        stays = np.isnan(self.escaped[some])
        chosen, place = some[stays], self.place[some[stays]]
        step = 2 * np.pi / omega / SAMPLES
        self.amplitude[chosen, place] = largest(samples, step)[:, stays].T
        self.recorded[chosen, place] = self.states[0][:, chosen].T
        self.settled[chosen, place] = rest[stays]
        self.place[some] += 1
        self.waited[some] = 0
