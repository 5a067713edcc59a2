"""Free motions on a manifold, and what the equations of motion say of them."""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.errors import ModelError
from nanorom.rom.manifold.equations import Equations
from nanorom.rom.manifold.invariance import Expansion
from nanorom.rom.manifold.monomials import Index
from nanorom.types import Array, Numbers

INSTANTS = 128  # of a period
FINER = 8  # instants between these at which extrema are sought
NEWTON, NEWTON_STEPS = 1e-12, 30
STEP = 1e-7  # of finite differences, relative
AT_REST = 1e-14  # of the first master
MOST_TURNS = 12  # of the first master in a period of all
OWN = 0.5  # of the first master's frequency: harmonics that are a master's own
NO_DIVISOR = 1e-9
PASSES = 4  # of the estimate of errors: a slave's tangent stiffness needs more than one


@attrs.frozen(eq=False)
class Motion:
    """A periodic motion in the scaled units of a manifold.

    rate : frequency of the first master; omega : of the period; u (n, 2L): complex modal
    coordinates at equal instants of a period; q (n, L).
    """

    rate: float
    omega: float
    u: Numbers
    q: Array

    @property
    def largest(self) -> Array:
        """max |q_r| (L,) over a period."""
        return largest(self.q)


def largest(q: Array) -> Array:
    """max |q_r| (L,) of samples (n, L) of a period, between the samples, too."""
    count = len(q)
    terms = np.fft.rfft(q, axis=0)
    fine = np.abs(np.fft.irfft(terms, FINER * count, axis=0) * FINER)
    top = fine.argmax(axis=0)
    columns = np.arange(q.shape[1])
    before, here, after = (np.take(fine, top + d, axis=0, mode="wrap") for d in (-1, 0, 1))
    before, here, after = (values[columns, columns] for values in (before, here, after))
    bend = before - 2 * here + after
    rise: Array = (before - after) ** 2 / np.where(bend < 0, -16 * bend / 2, np.inf)
    return np.asarray(here + rise)


def motion(equations: Equations, expansion: Expansion, z: Numbers, turns: Array) -> Motion:
    """The free motion z exp(i turns omega t) of masters z (m,) whose dynamics are a normal form."""
    rate = float(rates(expansion, z)[0].imag)
    count = _period(turns[np.abs(z) > AT_REST * abs(z[0])] / turns[0])
    angle = 2 * np.pi / INSTANTS * np.arange(INSTANTS)
    path = z * np.exp(1j * count * angle[:, None] * turns / turns[0])
    u = expansion.monomials.values(np.concatenate([path, path.conj()], axis=1)) @ expansion.shape
    return Motion(rate, rate / count, u, np.asarray((u @ equations.basis.shapes.T).real))


def _period(turns: Array) -> int:
    """Turns of the first master in a period of all."""
    for count in range(1, MOST_TURNS):
        if np.abs(turns * count - np.round(turns * count)).max() < NO_DIVISOR:
            return count
    raise ModelError("masters: move with frequencies of no common period")


def rates(expansion: Expansion, z: Numbers) -> Numbers:
    """f_r / z_r (m,) at masters z (m,); f_r where z_r is zero."""
    half = len(z)
    values = expansion.monomials.values(np.concatenate([z, z.conj()]))
    flow = (values @ expansion.dynamics)[:half]
    return np.asarray(flow / np.where(z == 0, 1.0, z))


def errors(equations: Equations, masters: Index, found: Motion) -> tuple[float, float]:
    """Relative errors of frequency and motion, estimated from what the equations leave.

    The residual of u' = rates u + inverse f(u) along the motion is solved for, harmonic by
    harmonic, with the linear equations, but for the masters' own; a few such steps tell how far the
    periodic motion is from that on the manifold, and find resonances of slaves, too. Where they
    diverge, so does the estimate.
    """
    basis, count = equations.basis, len(found.u)
    order = np.fft.fftfreq(count, 1.0 / count)[:, None]
    begin = np.fft.fft(found.u, axis=0) / count
    first = np.unravel_index(np.abs(begin).argmax(), begin.shape)
    own = np.zeros(begin.shape, dtype=bool)
    own[:, masters] = np.abs(1j * order * found.omega - basis.rates[masters]) < OWN * found.rate
    terms, omega = begin.copy(), found.omega
    for _ in range(PASSES):
        u = np.fft.ifft(terms, axis=0) * count
        q, speed = ((u @ matrix.T).real for matrix in (basis.shapes, basis.speeds))
        force = -equations.nonlinear_force(q, speed) @ basis.inverse.T
        divisors = 1j * order * omega - basis.rates
        left = divisors * terms - np.fft.fft(force, axis=0) / count
        keep = own | (np.abs(divisors) < NO_DIVISOR)
        terms = terms - np.where(keep, 0.0, left / np.where(keep, 1.0, divisors))
        omega = omega - float((left[first] / terms[first]).imag) / order[first[0], 0]
        if not (np.all(np.isfinite(terms)) and omega > 0):
            return np.inf, np.inf
    shift = abs(omega / found.omega - 1)
    return float(shift), float(np.linalg.norm(terms - begin) / np.linalg.norm(begin))


def free(expansion: Expansion, size: float, turns: Array, guess: Numbers) -> Numbers:
    """Masters z (m,), the first `size`, of a periodic free motion without damping, near a guess of
    the others; raises ModelError where there is none.
    """
    half = len(turns)
    if half == 1:
        return np.array([size], dtype=complex)

    def balance(unknown: Array) -> Array:
        z = np.concatenate([[size], unknown[:-1]]).astype(complex)
        values = expansion.monomials.values(np.concatenate([z, z.conj()]))
        flow = (values @ expansion.dynamics)[:half].imag
        return np.asarray(flow - unknown[-1] * turns * z.real)

    start = np.concatenate([[size], np.real(guess[1:])]).astype(complex)
    unknown = np.append(start[1:].real, rates(expansion, start)[0].imag / turns[0])
    for _ in range(NEWTON_STEPS):
        left = balance(unknown)
        slope = np.empty((half, half))
        for column in range(half):
            moved = unknown.copy()
            moved[column] += STEP * max(abs(unknown[column]), size)
            slope[:, column] = (balance(moved) - left) / (moved[column] - unknown[column])
        change = np.linalg.lstsq(slope, -left, rcond=None)[0]
        unknown = unknown + change
        if np.abs(change[:-1]).max(initial=0.0) < NEWTON * size:
            return np.concatenate([[size], unknown[:-1]]).astype(complex)
    raise ModelError(f"masters: no free motion is found at {size:g} of the unit of displacement")
