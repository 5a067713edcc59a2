"""The modal equations in their scaled form: the unit of time that of the lowest natural frequency,
the unit of displacement where the cubic force equals the linear one, unit mass.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any
from weakref import finalize

import numpy as np

from nanorom.continuation.arrays import nothing, symmetrise_cubic, symmetrise_quadratic, times
from nanorom.types import Array, Numbers

ROUND_OFF = 1e-13  # of the largest entry: what a change of coordinates leaves of a zero


def over_mass(mass: Array, arrays: Mapping[str, Array]) -> dict[str, Array]:
    """The arrays of the equations divided by the mass, symmetric where they act symmetrically."""
    inverse = np.linalg.inv(mass)
    divided = {
        # zeros, most often
        name: np.tensordot(inverse, array, axes=1) if array.any() else nothing(array.shape)
        for name, array in arrays.items()
    }
    divided["quadratic"] = symmetrise_quadratic(divided["quadratic"])
    divided["cubic"] = symmetrise_cubic(divided["cubic"])
    loss = divided.pop("cubic_damping")
    if loss.any():
        loss = loss + loss.transpose(0, 2, 1, 3)
        # loss[r, k, j, l] multiplies q_j q_l dq_k/dt; only its part symmetric in j, l acts
        loss = (loss + loss.transpose(0, 1, 3, 2)) / 2
    divided["loss"] = loss
    return divided


def non_dimensional(
    arrays: Mapping[str, Array], frequency: float, amplitude: float, modes: int
) -> ScaledSystem:
    """The equations of `modes` modes and states of first order in units of time and
    displacement.
    """
    return ScaledSystem(
        frequency=frequency,
        amplitude=amplitude,
        damping=times(arrays["damping"], 1 / frequency),
        stiffness=times(arrays["stiffness"], 1 / frequency**2),
        quadratic=times(arrays["quadratic"], amplitude / frequency**2),
        cubic=times(arrays["cubic"], (amplitude / frequency) ** 2),
        loss=times(arrays["loss"], amplitude**2 / frequency),
        force=times(arrays["direct"], 1 / (amplitude * frequency**2)),
        parametric=times(arrays["parametric"], 1 / frequency**2),
        inertia=np.append(np.ones(modes), np.zeros(len(arrays["damping"]) - modes)),
    )


def nonlinear_amplitude(arrays: Mapping[str, Array], frequency: float) -> float:
    """The displacement at which the nonlinear force reaches the linear one (of the forced response
    if linear, of the free one where only its damping is not).
    """
    stiffness, quadratic, cubic = (arrays[name] for name in ("stiffness", "quadratic", "cubic"))
    modes = np.arange(len(stiffness))
    diagonal = np.abs(cubic[modes, modes, modes, modes])
    squares = np.abs(np.diag(stiffness))
    if diagonal.max() > 0:
        return float(np.sqrt((squares[diagonal > 0] / diagonal[diagonal > 0]).max()))
    if np.abs(cubic).max() > 0:
        return float(frequency / np.sqrt(np.abs(cubic).max()))
    if np.abs(quadratic).max() > 0:
        return float(frequency**2 / np.abs(quadratic).max())
    forced = float(np.abs(arrays["direct"]).max() / frequency**2)
    loss, damping = np.abs(arrays["loss"]).max(), np.abs(arrays["damping"]).max()
    free = float(np.sqrt(damping / loss)) if loss > 0 else 0.0
    return forced or free or 1.0


@dataclass(frozen=True, eq=False)
class ScaledSystem:
    """I q'' + C q' + K q + A qq + B qqq + W(q, q) q' = f(t) + P(t) q, non-dimensional.

    `quadratic` is symmetric in its last two and `cubic` in its last three indices; `loss[r, k, j,
    l]` gives W_rk = sum_jl loss[r, k, j, l] q_j q_l. The last axis of `force` (L, 2K + 1) and
    `parametric` (L, L, 2K + 1) is that of the terms 1, cos(omega t), sin, cos(2 omega t), ... of
    the drive. `inertia` (L,) is 1, and 0 of states of first order, which come last and have the
    damping 1. `frequency` and `amplitude` are the units of 1/time and displacement.
    """

    frequency: float
    amplitude: float
    damping: Array
    stiffness: Array
    quadratic: Array
    cubic: Array
    loss: Array
    force: Array
    parametric: Array
    inertia: Array
    shapes: Array | None = None  # (L, L): of the model, by those of the equations (columns)

    @property
    def size(self) -> int:
        return len(self.force)

    @property
    def tones(self) -> int:
        """The highest harmonic K of the drive."""
        return (self.force.shape[-1] - 1) // 2

    @property
    def massless(self) -> Numbers:
        """Numbers of the coordinates that are states of first order."""
        return np.flatnonzero(self.inertia == 0)

    @property
    def fastest(self) -> float:
        """The highest natural frequency, or relaxation rate of a state."""
        massive = np.flatnonzero(self.inertia)
        squares = np.linalg.eigvals(self.stiffness[np.ix_(massive, massive)])
        rates = np.linalg.eigvals(self.stiffness[np.ix_(self.massless, self.massless)])
        highest = np.sqrt(np.abs(squares).max(initial=0.0))
        return float(max(highest, np.abs(rates).max(initial=0.0)))

    @property
    def relaxation(self) -> float:
        """The fastest decay rate of a free motion of the modes."""
        massive = np.flatnonzero(self.inertia)
        some = np.ix_(massive, massive)
        zero, one = np.zeros((len(massive),) * 2), np.eye(len(massive))
        state = np.block([[zero, one], [-self.stiffness[some], -self.damping[some]]])
        return float(np.abs(np.linalg.eigvals(state).real).max(initial=0.0))

    def given(self, motion: Array) -> Array:
        """A motion (..., L) of these equations in the coordinates and units of the model."""
        own = motion if self.shapes is None else motion @ self.shapes.T
        return np.asarray(own * self.amplitude)

    def inner(self, motion: Array) -> Array:
        """A motion (..., L) of the model in the coordinates and units of these equations."""
        own = motion if self.shapes is None else np.linalg.solve(self.shapes, motion.T).T
        return np.asarray(own / self.amplitude)

    def given_states(self, states: Array) -> Array:
        """States (..., 2L) of coordinates and their rates, as `given`."""
        q, v = np.split(states, 2, axis=-1)
        return np.concatenate([self.given(q), self.frequency * self.given(v)], axis=-1)

    def inner_states(self, states: Array) -> Array:
        """States (..., 2L) of coordinates and their rates, as `inner`."""
        q, v = np.split(states, 2, axis=-1)
        return np.concatenate([self.inner(q), self.inner(v) / self.frequency], axis=-1)

    @cached_property  # of many modes, the arrays are large
    def nonlinear(self) -> bool:
        return bool(self.quadratic.any() or self.cubic.any() or self.has_loss)

    @cached_property
    def has_loss(self) -> bool:
        """Whether the damping is nonlinear."""
        return bool(self.loss.any())

    def plus(self, change: ScaledSystem, factor: float) -> ScaledSystem:
        """The equations with `factor` times a change of all their arrays; those that it leaves as
        they are stay the same ones.
        """
        arrays = {name: (getattr(self, name), getattr(change, name)) for name in ARRAYS}
        changed = {n: own + factor * more for n, (own, more) in arrays.items() if more.any()}
        return replace(self, **changed)

    def times(self, factor: float) -> ScaledSystem:
        """A change of all arrays, `factor` times as large."""
        arrays = {name: getattr(self, name) for name in ARRAYS}
        return replace(self, **{name: factor * a for name, a in arrays.items() if a.any()})

    def pattern(self, change: ScaledSystem) -> ScaledSystem:
        """Entries that are zero where those of the equations and of a change of them are: what may
        act on what.
        """
        arrays = {name: (getattr(self, name), getattr(change, name)) for name in ARRAYS}
        both = {n: np.abs(own) + np.abs(more) for n, (own, more) in arrays.items() if more.any()}
        return replace(self, **both)

    def restrict(self, modes: Numbers) -> ScaledSystem:
        """The same equations with every mode outside `modes` at rest."""
        m = np.asarray(modes)
        if len(m) == self.size:
            return self
        return ScaledSystem(
            self.frequency,
            self.amplitude,
            self.damping[np.ix_(m, m)],
            self.stiffness[np.ix_(m, m)],
            self.quadratic[np.ix_(m, m, m)],
            self.cubic[np.ix_(m, m, m, m)],
            self.loss[np.ix_(m, m, m, m)],
            self.force[m],
            self.parametric[np.ix_(m, m)],
            self.inertia[m],
        )

    def turned(self, columns: Array) -> ScaledSystem:
        """The equations for y where q = columns @ y, which must not mix states with modes."""
        inverse = np.linalg.inv(columns)
        arrays = {}
        for name in ARRAYS:
            array = np.tensordot(inverse, getattr(self, name), axes=1)
            for axis in range(1, array.ndim - (name in DRIVEN)):
                array = np.moveaxis(np.tensordot(array, columns, axes=(axis, 0)), -1, axis)
            small = ROUND_OFF * np.abs(array).max(initial=0.0)
            arrays[name] = np.where(np.abs(array) > small, array, 0.0)
        before = columns if self.shapes is None else self.shapes @ columns
        return replace(self, shapes=before, **arrays)

    def changed(self, change: ScaledSystem) -> ScaledSystem:
        """A change of the arrays in the model's coordinates, in those of these equations."""
        return change if self.shapes is None else change.turned(self.shapes)


def of_tensors(system: ScaledSystem) -> dict[Any, Any]:
    """What is known of the nonlinear terms of a system, for all systems that have the same arrays
    of them; forgotten when these are let go, so that it must not hold them.
    """
    tensors = system.quadratic, system.cubic, system.loss
    key = tuple(id(tensor) for tensor in tensors)
    if key not in _of_tensors:
        _of_tensors[key] = {}
        for tensor in tensors:
            finalize(tensor, _forget, key)
    return _of_tensors[key]


def _forget(key: tuple[int, ...]) -> None:
    _of_tensors.pop(key, None)


_of_tensors: dict[tuple[int, ...], dict[Any, Any]] = {}
UNITS = ("frequency", "amplitude", "inertia", "shapes")
DRIVEN = ("force", "parametric")  # arrays whose last axis is that of the drive's terms
ARRAYS = tuple(f.name for f in fields(ScaledSystem) if f.name not in UNITS)
