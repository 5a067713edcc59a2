"""Steps of many members at once, of equal length in the drive's angle, compiled or by arrays.

Source: Dormand and Prince's method of order 8 with its estimates of order 5 and 3; Hairer,
Norsett, Wanner 1993, section II.10, doi:10.1007/978-3-540-78862-1.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import attrs
import numpy as np
from scipy.integrate import DOP853

from nanorom.compiler import library
from nanorom.continuation.ensemble.equations import Equations
from nanorom.continuation.sweep import ESCAPED, SMALL
from nanorom.types import Array, Numbers

STAGES = 12
A, B, C = DOP853.A[:STAGES, :STAGES], DOP853.B, DOP853.C[:STAGES]
THIRD, FIFTH = DOP853.E3[:STAGES], DOP853.E5[:STAGES]
KERNEL = Path(__file__).with_name("kernel.c")
AT_ONCE = 128  # members whose arrays stay near the processor
LANES = 4  # members that the compiled kernel takes at once


@attrs.frozen(eq=False)
class Stretch:
    """What is integrated: steps of a period of the drive; `samples` of the state, `between` steps
    from one to the next, from phase 0 on.
    """

    per_period: int
    samples: int
    between: int

    @property
    def step(self) -> float:
        """Of the drive's angle, in rad."""
        return 2 * np.pi / self.per_period

    def drive(self, tones: int) -> Array:
        """The terms 1, cos, sin, cos 2, ... (per_period, STAGES, 2K + 1) of the drive."""
        angles = self.step * np.add.outer(np.arange(self.per_period), C)
        terms = np.ones((*angles.shape, 2 * tones + 1))
        orders = np.arange(1, tones + 1)
        terms[..., 1::2] = np.cos(np.multiply.outer(angles, orders))
        terms[..., 2::2] = np.sin(np.multiply.outer(angles, orders))
        return terms


Advance = Callable[[Equations, Array, Array, Stretch], tuple[Array, Array]]


def by_arrays(
    equations: Equations, states: Array, rates: Array, stretch: Stretch
) -> tuple[Array, Array]:
    """Samples (n, 2L, B) of the states (T + 1, 2L, B), of which T are tangents and which are left
    at the end, and the largest relative error (B,) estimated of a step; rates (B,): 1 / omega.
    """
    drive = stretch.drive(equations.tones)
    parts, errors = [], []
    for first in range(0, equations.members, AT_ONCE):
        some = np.arange(first, min(first + AT_ONCE, equations.members))
        right_side = _RightSide(equations.of(some), rates[some])
        own = np.ascontiguousarray(states[..., some])
        samples, error = _steps(right_side, own, drive, stretch)
        states[..., some] = own
        parts.append(samples)
        errors.append(error)
    return np.concatenate(parts, axis=-1), np.concatenate(errors)


def _steps(right_side: _RightSide, y: Array, drive: Array, stretch: Stretch) -> tuple[Array, Array]:
    """Samples and errors of members that are left where the last step ends."""
    stages, worst = np.empty((STAGES, *y.shape)), np.zeros(y.shape[-1])
    flat, h = stages.reshape(STAGES, -1), stretch.step
    samples = np.empty((stretch.samples, *y.shape[1:]))
    count = 0
    with np.errstate(over="ignore", invalid="ignore"):
        for sample in samples:
            for _ in range(stretch.between):
                terms = drive[count % stretch.per_period]
                count += 1
                for s in range(STAGES):
                    more = (h * A[s, :s]) @ flat[:s] if s else 0.0
                    trial = y + np.reshape(more, y.shape) if s else y
                    right_side(terms[s], trial, stages[s])
                y += h * np.reshape(B @ flat, y.shape)
                np.fmax(worst, _error(y[0], stages[:, 0], h), out=worst)
                if np.isinf(worst).all():
                    break
            sample[:] = y[0]
    return samples, worst


def _error(y: Array, stages: Array, h: float) -> Array:
    """Of a step, relative to the states (2L, B), by stages (12, 2L, B); infinite of an escape."""
    third, fifth = (np.abs(np.tensordot(e, stages, axes=1)).max(axis=0) for e in (THIRD, FIFTH))
    below = np.sqrt(fifth**2 + 0.01 * third**2)
    large = np.abs(y).max(axis=0)
    error = h * fifth**2 / np.where(below > 0, below, 1.0) / np.fmax(large, SMALL)
    return np.where(large < ESCAPED, error, np.inf)


class _RightSide:
    """Rates of states and tangents by the drive's angle."""

    def __init__(self, equations: Equations, rates: Array) -> None:
        self.e, self.rates = equations, rates
        self.pair, self.triple = equations.pairs.T, equations.triples.T
        self.rows = np.eye(equations.size)[:, equations.places[:, 0]]

    def __call__(self, terms: Array, y: Array, to: Array) -> None:
        e, (a, b), (pair, c) = self.e, self.pair, self.triple
        one = np.ones((1, y.shape[-1]))
        z = np.concatenate([y[0], one])
        pairs = z[a] * z[b]
        products = pairs[pair] * z[c]
        stiffness = np.einsum("t,mtb->mb", terms, e.parametric)
        force = np.einsum("t,rtb->rb", terms, e.force)
        self._finish(y[0], force - e.weights @ products, stiffness, to[0])
        for d, into in zip(y[1:], to[1:]):
            dz = np.concatenate([d, 0.0 * one])
            changes = (dz[a] * z[b] + z[a] * dz[b])[pair] * z[c] + pairs[pair] * dz[c]
            self._finish(d, -e.weights @ changes, stiffness, into)

    def _finish(self, y: Array, force: Array, stiffness: Array, to: Array) -> None:
        e, size = self.e, self.e.size
        if len(e.places):
            force = force + self.rows @ (stiffness * y[e.places[:, 1]])
        massless = e.massless[:, None]
        to[:size] = self.rates * np.where(massless, force, y[size:])
        to[size:] = self.rates * np.where(massless, 0.0, force)


class _Kernel(ctypes.Structure):
    """`equations` of kernel.c."""

    _fields_ = [
        *[(name, ctypes.c_int) for name in "size terms tangents pairs triples driven".split()],
        ("members", ctypes.c_long),
        *[
            (name, ctypes.c_void_p)
            for name in (
                "pair triple row column place massless weight force parametric rate drive "
                "a b third fifth"
            ).split()
        ],
        *[(name, ctypes.c_double) for name in ("step", "small", "escaped")],
    ]


@attrs.frozen(eq=False)
class Compiled:
    """The same as `by_arrays` by the kernel, shared by threads; two to a processor at most."""

    kernel: ctypes.CDLL
    workers: int

    def __call__(
        self, equations: Equations, states: Array, rates: Array, stretch: Stretch
    ) -> tuple[Array, Array]:
        assert states.flags.c_contiguous and states.dtype == float
        members, size = equations.members, equations.size
        used = equations.weights != 0
        kept = {  # what the structure points to
            "pair": np.ascontiguousarray(equations.pairs, dtype=np.intc),
            "triple": np.ascontiguousarray(equations.triples, dtype=np.intc),
            "row": np.append(0, np.cumsum(used.sum(axis=1))).astype(np.intc),
            "column": np.nonzero(used)[1].astype(np.intc),
            "place": np.ascontiguousarray(equations.places, dtype=np.intc),
            "massless": equations.massless.astype(np.intc),
            "weight": equations.weights[used],
            "force": np.ascontiguousarray(equations.force),
            "parametric": np.ascontiguousarray(equations.parametric),
            "rate": np.ascontiguousarray(rates),
            "drive": stretch.drive(equations.tones),
            "a": np.ascontiguousarray(A),
            "b": np.ascontiguousarray(B),
            "third": np.ascontiguousarray(THIRD),
            "fifth": np.ascontiguousarray(FIFTH),
        }
        given = _Kernel(
            size=size,
            terms=2 * equations.tones + 1,
            tangents=len(states) - 1,
            pairs=len(equations.pairs),
            triples=len(equations.triples),
            driven=len(equations.places),
            members=members,
            step=stretch.step,
            small=SMALL,
            escaped=ESCAPED,
            **{name: array.ctypes.data for name, array in kept.items()},
        )
        samples, errors = np.empty((stretch.samples, 2 * size, members)), np.empty(members)

        def run(first: int, last: int) -> int:
            return int(
                self.kernel.advance(
                    ctypes.byref(given),
                    *(ctypes.c_void_p(states.ctypes.data), ctypes.c_long(first)),
                    *(ctypes.c_long(last), ctypes.c_long(stretch.per_period)),
                    *(ctypes.c_long(stretch.samples), ctypes.c_long(stretch.between)),
                    *(ctypes.c_void_p(samples.ctypes.data), ctypes.c_void_p(errors.ctypes.data)),
                )
            )

        ends = _shares(members, self.workers)
        with ThreadPoolExecutor(len(ends) - 1) as pool:
            failed = list(pool.map(run, ends[:-1], ends[1:]))
        if any(failed):
            raise MemoryError("no memory for the states of a few members")
        return samples, errors


def _shares(members: int, workers: int) -> Numbers:
    """Where the members of each worker begin, and the end: whole groups of lanes."""
    groups = -(-members // LANES)
    shares = min(workers, groups)
    return np.minimum(LANES * (groups * np.arange(shares + 1) // shares), members)


def compiled(workers: int) -> Compiled | None:
    """The compiled kernel, or None where there is no C compiler."""
    kernel = library(KERNEL)
    return None if kernel is None else Compiled(kernel, workers)
