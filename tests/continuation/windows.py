"""Random systems under both drives, and random ranges of frequency inside a wide one."""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.continuation import Diagram, ModalSystem, explore

RANDOM = (4, 13, 46, 55)  # seeds of the suite; tests/stress/windows.py runs more
WIDE = (0.8, 4.0)
NEAR = (5e-2, 2e-2)  # relative and absolute: amplitudes are read off between points


@attrs.frozen
class State:
    """An orbit at one frequency: periods of the drive, amplitude (L,)."""

    periods: int
    stable: bool
    amplitude: np.ndarray

    def is_near(self, other: State) -> bool:
        close = np.allclose(self.amplitude, other.amplitude, *NEAR)
        return self.periods == other.periods and close


@attrs.frozen
class Window:
    """A range, and stable orbits at its middle that it lacks beside a wide one, or has beyond.

    told: starts near which no orbit was found, by the diagram itself.
    """

    seed: int
    omega: tuple[float, float]
    missing: list[State]
    beyond: list[State]
    told: int
    wide: Diagram = attrs.field(repr=False)


def states(diagram: Diagram, omega: float) -> list[State]:
    """Orbits of all branches at one frequency."""
    found = []
    for branch in diagram.branches:
        low, high = branch.omega[:-1] - omega, branch.omega[1:] - omega
        for i in np.flatnonzero(low * high <= 0):
            share = low[i] / (low[i] - high[i]) if low[i] != high[i] else 0.0
            amplitude = (1 - share) * branch.amplitude[i] + share * branch.amplitude[i + 1]
            stable = bool(branch.stable[i] and branch.stable[i + 1])
            found.append(State(branch.period_multiple, stable, amplitude))
    return found


def system_of(random: np.random.Generator) -> tuple[ModalSystem, float, float]:
    """A hardening system of one or two modes, and its levels of drive."""
    size = int(random.integers(1, 3))
    stiffness = np.sort(random.uniform(1, 4, size)) ** 2
    stiffness = stiffness / stiffness[0]
    damping = 10 ** random.uniform(-2.5, -1.3)
    pattern = random.normal(size=(size, size))
    shape = random.normal(size=(8, size))
    system = ModalSystem(
        stiffness=stiffness,
        damping=damping * np.sqrt(stiffness),
        cubic=np.einsum("nr,ns,nt,nu->rstu", shape, shape, shape, shape) / 8,
        direct=random.normal(size=size),
        parametric=(pattern + pattern.T) / 2,
    )
    parametric = random.uniform(2, 8) * damping
    return system, float(random.choice([0.0, 1e-2, 5e-2])), parametric


def compared(seed: int, trials: int = 3) -> list[Window]:
    """Random ranges of a random system beside a wide one."""
    random = np.random.default_rng(seed)
    system, direct, parametric = system_of(random)
    wide = explore(system, WIDE, direct, parametric)
    found = []
    for _ in range(trials):
        low = random.uniform(1.2, 3.0)
        omega = (low, low * random.uniform(1.02, 1.3))
        narrow = explore(system, omega, direct, parametric)
        middle = 0.5 * sum(omega) + 1e-4
        there, here = ([s for s in states(d, middle) if s.stable] for d in (wide, narrow))
        missing = [s for s in there if not any(s.is_near(other) for other in here)]
        beyond = [s for s in here if not any(s.is_near(other) for other in there)]
        told = sum(left.kind == "start" for left in narrow.unexplored)
        found.append(Window(seed, omega, missing, beyond, told, wide))
    return found
