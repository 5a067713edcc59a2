"""Backbone curves: periodic motions of the undamped, undriven model (nonlinear normal modes).

With the time origin at a turning point the motion is even in time, so the balance is written for
cosines alone and needs no phase condition. Source: Kerschen, Peeters, Golinval and Vakakis 2009,
doi:10.1016/j.ymssp.2008.04.002.
"""

from __future__ import annotations

from dataclasses import replace

import attrs
import numpy as np

from nanorom.continuation.arrays import brief, nothing
from nanorom.continuation.branches.trace import Tracer
from nanorom.continuation.orbits.harmonics import Support, close_support
from nanorom.continuation.orbits.orbit import Orbit, PeriodicOrbit, orbit_amplitudes
from nanorom.continuation.scaled import ScaledSystem
from nanorom.continuation.settings import Settings, check_range
from nanorom.continuation.system import ModalSystem
from nanorom.continuation.threads import one_thread
from nanorom.errors import ContinuationError
from nanorom.types import Array

FIRST_AMPLITUDE = 1e-3  # in units of the scaled system: still linear
LOWEST, HIGHEST = 0.2, 3.0  # times the natural frequency, where nothing else is asked for
PARTS = (0.0, 1 / 3, 2 / 3)  # of a step at which there are points
ABSENT = 1e-12  # of a linear mode: coordinates that do not take part


@brief
@attrs.frozen(eq=False)
class Backbone:
    """omega (n,) of the free motion in rad per unit of time, amplitude (n, L) = max |q_r| in the
    unit of displacement, orbits (n of them) and energy (n,).

    energy is the potential energy at the turning point, in the units of force times displacement of
    the system; it is the whole energy if the forces derive from a potential.
    """

    omega: Array
    amplitude: Array
    energy: Array
    orbits: list[PeriodicOrbit] = attrs.field(repr=False)


@one_thread()
def backbone(
    system: ModalSystem,
    mode: int = 0,
    omega: tuple[float, float] | None = None,
    *,
    amplitude: float | None = None,
    tolerance: float = 1e-9,
    steps: int = 300,
) -> Backbone:
    """Follow the nonlinear normal mode that starts at a linear mode.

    Parameters
    ----------
    system : ModalSystem; damping and drives are left out
    mode : number of the linear mode, from 0, by natural frequency
    omega : (low, high), where to stop, in rad per unit of time of the system; default 0.2 to 3
        times the natural frequency
    amplitude : stop when max |q_r| of any mode exceeds this, in the units of the system
    tolerance : size of the last harmonics, relative to the orbit
    steps : most steps

    Raises
    ------
    ContinuationError
        for a mode that does not exist or an invalid range.
    """
    if not 0 <= mode < system.size:
        raise ContinuationError(f"mode: {mode} does not exist; there are {system.size} from 0")
    scaled = conservative(system.scaled())
    frequency, shape = linear_mode(scaled, mode)
    if omega is None:
        limits = (LOWEST * frequency, HIGHEST * frequency)
    else:
        low, high = check_range(omega)
        limits = (low / scaled.frequency, high / scaled.frequency)
    most = np.inf if amplitude is None else amplitude / scaled.amplitude
    settings = Settings(tolerance=tolerance, steps=steps)
    return _result(system, scaled, free_orbits(scaled, (frequency, shape), limits, settings, most))


def linear_mode(scaled: ScaledSystem, mode: int) -> tuple[float, Array]:
    """Frequency and shape (L,) of a linear mode, by number from the lowest."""
    values, vectors = np.linalg.eig(scaled.stiffness)
    chosen = np.argsort(values.real)[mode]
    shape = vectors[:, chosen].real
    return float(np.sqrt(values.real[chosen])), shape / np.abs(shape).max()


def free_orbits(
    scaled: ScaledSystem,
    linear: tuple[float, Array],
    limits: tuple[float, float],
    settings: Settings,
    most: float = np.inf,
) -> list[Orbit]:
    """Free orbits of a conservative system, from a linear mode (frequency and shape) on, in order.

    Raises ContinuationError if none is found.
    """
    frequency, shape = linear
    tracer = _even_tracer(scaled, shape, settings)
    start = np.zeros((7, scaled.size))
    start[1] = FIRST_AMPLITUDE * shape
    direction = np.zeros_like(start)
    direction[1] = shape

    def along_mode(balance):  # type: ignore[no-untyped-def]
        packed = balance.basis.pack(balance.basis.compress(direction))
        return np.append(packed, 0.0)

    orbit, _ = tracer.solve(Orbit(start, frequency, 1), along_mode)
    orbits = []
    for series in tracer.follow(orbit, direction, limits):
        points = [tracer.orbit(series, f * series.length) for f in PARTS]
        orbits += points
        if orbit_amplitudes(points[-1].coefficients[None]).max() > most:
            break
    else:
        orbits.append(tracer.orbit(series, series.length))
    return orbits


def conservative(system: ScaledSystem) -> ScaledSystem:
    """The equations of the modes without damping and drive."""
    zero = np.zeros_like
    system = system.restrict(np.flatnonzero(system.inertia))
    return replace(
        system,
        damping=zero(system.damping),
        loss=nothing(system.loss.shape),
        force=zero(system.force),
        parametric=zero(system.parametric),
    )


def _even_tracer(system: ScaledSystem, shape: Array, settings: Settings) -> Tracer:
    """A tracer for motions even in time, on the modes and harmonics that the linear mode
    excites.
    """
    table = np.zeros((system.size, 2), dtype=bool)
    table[np.abs(shape) > ABSENT, 1] = True
    closed = close_support(system, Support(table))
    return Tracer(system, Support(closed.table, even=True), 1, settings)


def _result(system: ModalSystem, scaled: ScaledSystem, orbits: list[Orbit]) -> Backbone:
    unit = scaled.amplitude
    turning = np.array(
        [orbit.coefficients[0] + orbit.coefficients[1::2].sum(0) for orbit in orbits]
    )
    q = turning * unit
    potential = np.einsum("nr,rj,nj->n", q, system.stiffness, q) / 2
    potential += np.einsum("nr,rjk,nj,nk->n", q, system.quadratic, q, q) / 3
    potential += np.einsum("nr,rjkl,nj,nk,nl->n", q, system.cubic, q, q, q) / 4
    omega = np.array([orbit.omega for orbit in orbits]) * scaled.frequency
    return Backbone(
        omega=omega,
        amplitude=np.array([orbit_amplitudes(o.coefficients[None])[0] for o in orbits]) * unit,
        energy=potential,
        orbits=[PeriodicOrbit(o.coefficients * unit, w) for o, w in zip(orbits, omega)],
    )
