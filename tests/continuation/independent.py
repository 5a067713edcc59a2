"""Equations of motion written out term by term, and their integration in time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

from nanorom.continuation import Drive, FirstOrder, ModalSystem, PeriodicOrbit

OPTIONS = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14}
DIGITS = 6  # moduli that agree to so many are those of a conjugate pair


def motion(
    system: ModalSystem, omega: float, direct: float, parametric: float
) -> Callable[[float, np.ndarray], np.ndarray]:
    """d(q, q', T)/dt as the docstrings of the package have it, without its code."""
    size, states = system.size, system.states
    own = Drive(direct=system.direct, parametric=system.parametric)
    drives = [own.filled(size, states.size if states else 0), *system.drives]

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        q, v, temperature = y[:size], y[size : 2 * size], y[2 * size :]
        force = -system.stiffness @ q - system.damping @ v
        force = force - np.einsum("rjk,j,k", system.quadratic, q, q)
        force = force - np.einsum("rjkl,j,k,l", system.cubic, q, q, q)
        force = force - 2 * np.einsum("rjkl,j,k,l", _halved(system.cubic_damping), q, v, q)
        fed = np.zeros(len(temperature))
        for drive in drives:
            wave = np.cos(drive.harmonic * omega * t + drive.phase)
            force = force + wave * (direct * drive.direct + parametric * drive.parametric @ q)
            fed = fed + direct * wave * drive.states
        if states is not None:
            force = force + states.force @ temperature
            force = force - np.einsum("rjs,j,s", states.stiffness, q, temperature)
            fed = fed - states.rate @ temperature + states.displacement @ q
            fed = fed + np.einsum("sjk,j,k", states.squares, q, q)
        return np.concatenate([v, np.linalg.solve(system.mass, force), fed])

    return rate


def _halved(tensor: np.ndarray) -> np.ndarray:
    """D so that D q_l (q_j' q_k + q_j q_k') is twice that of q_j, v_k, q_l."""
    return (tensor + tensor.transpose(0, 2, 1, 3)) / 2


def state(orbit: PeriodicOrbit, size: int, time: float = 0.0) -> np.ndarray:
    """(q, q', T) of an orbit of `size` modes at a time."""
    q, v = orbit(time), orbit.velocity(time)
    return np.concatenate([q[:size], v[:size], q[size:]])


def after(rate: Callable, start: np.ndarray, period: float) -> np.ndarray:
    return solve_ivp(rate, (0.0, period), start, **OPTIONS).y[:, -1]


def multipliers(rate: Callable, start: np.ndarray, period: float) -> np.ndarray:
    """Eigenvalues of the return map, by central differences; largest modulus first."""
    columns = []
    for i in range(len(start)):
        step = np.zeros(len(start))
        step[i] = 1e-4 * max(abs(start[i]), 1e-3)
        ends = [after(rate, start + sign * step, period) for sign in (1, -1)]
        columns.append((ends[0] - ends[1]) / (2 * step[i]))
    return in_order(np.linalg.eigvals(np.array(columns).T))


def in_order(values: np.ndarray) -> np.ndarray:
    """Largest modulus first, of conjugates the one above the real axis first."""
    return values[np.lexsort((-values.imag, -np.round(np.abs(values), DIGITS)))]


def random_states(size: int, count: int, seed: int) -> FirstOrder:
    random = np.random.default_rng(seed)
    return FirstOrder(
        rate=np.diag(random.uniform(0.3, 3.0, count)) - 0.05 * np.ones((count, count)),
        displacement=1e-3 * random.standard_normal((count, size)),
        squares=1e-2 * random.standard_normal((count, size, size)),
        force=20 * random.standard_normal((size, count)),
        stiffness=30 * random.standard_normal((size, size, count)),
    )


def random_drives(size: int, count: int, seed: int) -> list[Drive]:
    random = np.random.default_rng(seed)
    return [
        Drive(
            harmonic,
            random.uniform(-3, 3) if harmonic else 0.0,
            direct=0.02 * random.standard_normal(size),
            parametric=0.1 * random.standard_normal((size, size)),
            states=1e-3 * random.standard_normal(count),
        )
        for harmonic in (0, 1, 2, 5)
    ]


def gap(system: ModalSystem, orbit: PeriodicOrbit, direct: float, parametric: float = 0.0) -> float:
    """How far from its beginning an orbit ends after its period, in time."""
    begin, rate = state(orbit, system.size), motion(system, orbit.omega, direct, parametric)
    return float(np.abs(after(rate, begin, orbit.period) - begin).max())
