"""Harmonic balance of the discretised film: residual, derivative, and the norm they are told in.

    M w'' + C w' + (K + p(t) P) w + G w + F(w) = g(t) f

with the courses g and p of the drive, cos(omega t) most often, and what a squeezed gas answers, G,
which differs from harmonic to harmonic.

Unknowns are the Fourier coefficients of every free degree of freedom, (n, 2H + 1) in the order
1, cos, sin, cos 2, ... of theta = rate t, rate = omega / period_multiple.  The force is evaluated
at 4H + 2 samples of a period and projected, which is exact for a cubic.  A residual is measured by
the static work it would do, sqrt(R . K^-1 R): that of a force does not change with the mesh.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from nanorom.continuation.orbits.harmonics import differentiate, fourier_matrix
from nanorom.types import Array
from nanorom.verification.assembled import Discrete
from nanorom.verification.linear import ClassDynamics
from nanorom.verification.symmetry import Classes


@attrs.frozen(eq=False)
class Drive:
    """Direct force by class (n,), and what the modulation multiplies, by class (n, n) operators.

    Both at the levels that act, with their courses (2K + 1,) in the terms 1, cos(omega t), sin,
    cos(2 omega t), ...
    """

    direct: Sequence[Array]
    course: Array
    modulation: Sequence[Any] | None
    modulation_course: Array


class OrbitEquations:
    """R(X, rate) = 0 of a film in some classes of symmetry under a drive.

    material_time : of a viscoelastic material, film-scaled, 0 for none.  The harmonics are those of
    the drive at least.
    """

    def __init__(
        self,
        film: Discrete,
        classes: Classes,
        dynamics: Sequence[ClassDynamics],
        drive: Drive,
        harmonics: int,
        period_multiple: int,
        material_time: float = 0.0,
    ) -> None:
        self.film, self.classes, self.dynamics = film, classes, dynamics
        self.drive, self.harmonics, self.period_multiple = drive, harmonics, period_multiple
        self.material_time = material_time
        self.offsets = np.cumsum([0, *(d.size for d in dynamics)])
        self.numbers = (np.arange(2 * harmonics + 1) + 1) // 2
        samples = 4 * harmonics + 2
        angles = 2 * np.pi * np.arange(samples) / samples
        self.synthesis = fourier_matrix(angles, harmonics).T.copy()
        weights = np.full(2 * harmonics + 1, 2.0 / samples)
        weights[0] = 1.0 / samples
        self.analysis = np.ascontiguousarray(self.synthesis.T * weights)
        self.wave = fourier_matrix(period_multiple * angles, _tones(drive.modulation_course))
        self.wave = self.wave @ drive.modulation_course
        self.weights = np.where(self.numbers == 0, 1.0, 0.5)  # of a mean square
        self.direct = np.zeros((self.offsets[-1], 2 * harmonics + 1))
        self.direct[:, _places(drive.course, period_multiple)] = np.outer(
            np.concatenate(drive.direct), drive.course
        )

    @property
    def size(self) -> int:
        """Number of free degrees of freedom."""
        return int(self.offsets[-1])

    def parts(self, columns: Array) -> list[Array]:
        """Rows of each class."""
        return [columns[a:b] for a, b in zip(self.offsets[:-1], self.offsets[1:])]

    def derivative(self, x: Array) -> Array:
        """d/dtheta of coefficients (n, 2H + 1)."""
        return differentiate(x.T).T

    def viscous(self, rate: float) -> Array | None:
        """1 + tau d/dt on time samples (m, m), None for an elastic material."""
        if self.material_time == 0.0:
            return None
        samples = len(self.wave)
        # of all that a product of two deflections has: harmonics up to 2H
        wide = fourier_matrix(2 * np.pi * np.arange(samples) / samples, 2 * self.harmonics)
        weights = np.full(wide.shape[1], 2.0 / samples)
        weights[0] = 1.0 / samples
        slope = wide @ differentiate((wide * weights).T)
        return np.asarray(np.eye(samples) + self.material_time * rate * slope)

    def linear(self, x: Array, rate: float) -> Array:
        """M w'' + C w' + K w + G w without what the drive modulates."""
        velocity = rate * self.derivative(x)
        acceleration = -((rate * self.numbers) ** 2) * x
        found = [
            d.stiffness @ w + d.mass @ a + d.damping(v) + d.squeezed(w, rate)
            for d, w, v, a in zip(self.dynamics, *map(self.parts, (x, velocity, acceleration)))
        ]
        return np.concatenate(found)

    def modulated(self, samples: Array) -> Array:
        """Force (n, m) of the modulation on deflections at time samples (n, m)."""
        if self.drive.modulation is None:
            return np.zeros_like(samples)
        found = [op @ w for op, w in zip(self.drive.modulation, self.parts(samples))]
        return np.asarray(np.concatenate(found) * self.wave)

    def residual(self, x: Array, rate: float) -> tuple[Array, Any]:
        """R (n, 2H + 1) of coefficients, and the state of the film along the orbit."""
        samples = x @ self.synthesis
        forces, state = self.film.force(self.classes, self.parts(samples), self.viscous(rate))
        force = np.concatenate(forces) + self.modulated(samples)
        return self.linear(x, rate) + force @ self.analysis - self.direct, state

    def settled(self, x: Array) -> Array:
        """Coefficients of modes, with what of the film follows them at once."""
        if not self.film.follows:
            return x
        parts = self.film.settled(self.classes, self.parts(x @ self.synthesis))
        return np.asarray(np.concatenate(parts) @ self.analysis)

    def along(self, state: Any, change: Array, rate: float) -> Array:
        """Derivative of R along a change of the coefficients, about a state."""
        samples = change @ self.synthesis
        parts = self.parts(samples)
        forces = self.film.tangent(self.classes, state, parts, self.viscous(rate))
        force = np.concatenate(forces) + self.modulated(samples)
        return self.linear(change, rate) + force @ self.analysis

    def by_rate(self, x: Array, rate: float) -> Array:
        """Derivative of R by the rate."""
        inertia = -2 * rate * self.numbers**2 * x
        found = [
            d.mass @ a + d.damping(v) + d.squeezed_by_rate(w, rate)
            for d, w, v, a in zip(self.dynamics, *map(self.parts, (x, self.derivative(x), inertia)))
        ]
        total = np.concatenate(found)
        if self.material_time:
            parts = self.parts(x @ self.synthesis)
            both = [
                np.concatenate(self.film.force(self.classes, parts, viscous)[0])
                for viscous in (self.viscous(rate), None)
            ]
            total += (both[0] - both[1]) @ self.analysis / rate
        return np.asarray(total)

    def flexibility(self, forces: Array) -> Array:
        """Static deflections under forces (n, 2H + 1), as coefficients of mean squares."""
        parts = [d.flexibility(f) for d, f in zip(self.dynamics, self.parts(forces))]
        return np.asarray(np.concatenate(parts) * self.weights)

    def norm(self, forces: Array) -> float:
        """sqrt of the mean static work of forces."""
        return float(np.sqrt(np.maximum(float(np.vdot(forces, self.flexibility(forces))), 0.0)))

    def driving(self, x: Array) -> float:
        """Norm of the direct drive, or, where there is none, of the modulation's force."""
        direct = self.norm(self.direct)
        if direct > 0:
            return direct
        return self.norm(self.modulated(x @ self.synthesis) @ self.analysis)


def _tones(course: Array) -> int:
    """The highest harmonic K of a course (2K + 1,)."""
    return len(course) // 2


def _places(course: Array, period_multiple: int) -> np.ndarray:
    """Where the terms of a course (2K + 1,) of omega t are among those of rate t."""
    sines = np.arange(1, _tones(course) + 1) * 2 * period_multiple
    return np.concatenate([[0], np.column_stack([sines - 1, sines]).ravel()])
