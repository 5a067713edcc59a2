"""The discretised film as plain arrays: force and tangent of all time samples at once.

Deflections are taken relative to the static state; with s0 its slope, in-plane strain and force are

    E = sym grad u + 1/2 (s (x) s - s0 (x) s0) ,  s = s0 + grad w ,  N = C:E ,
    f(v) = int N s . grad v ,

with u in equilibrium under E.  Quadrature and in-plane stiffness are those of the direct
condensation (`fem.tensors.direct`), so a modal model's cubic force is this one's projection, to
round-off.  Time samples, and columns of a tangent, are the columns of one solve.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import attrs
import numpy as np

from nanorom.fem.symmetry import Parity
from nanorom.types import Array
from nanorom.verification.factors import Factors
from nanorom.verification.symmetry import Classes, images
from nanorom.verification.tables import Laws, Tables, geometric


@attrs.frozen
class Gate:
    """Attraction to a gate: gap and strength as in `fem.models.gate`, film-scaled."""

    gap: float
    strength: float


@attrs.frozen(eq=False)
class State:
    """A deflection at time samples as the film's images see it.

    slope (images, 2, c, q, m); force (images, 3, c, q, m): N, viscous part included; height
    (images, c, q, m) above the flat film where there is a gate.
    """

    slope: Array
    force: Array
    height: Array | None

    @property
    def uncoupling(self) -> Array:
        """The part (3, c, q, m) of the membrane force that couples no classes."""
        return np.asarray(self.force.mean(axis=0))


@attrs.frozen(eq=False)
class DiscreteFilm:
    """A film on one mesh.

    free : rows of the deflection, by class; in_plane : free unrolled rows and factors of the
    in-plane stiffness, by class of the strain, empty where the in-plane displacement is held.
    shape (nodes,) : height of the static state, None where it is flat; laws : of stretching.
    even : the class that every mirror leaves as it is.
    """

    tables: Tables
    free: Mapping[Parity, np.ndarray]
    in_plane: Mapping[Parity, tuple[np.ndarray, Factors]]
    laws: Laws
    even: Parity
    shape: Array | None = None
    gate: Gate | None = None
    follows: bool = False  # the in-plane displacement does, and is condensed

    def settled(self, classes: Classes, parts: Sequence[Array]) -> list[Array]:
        """Deflections as they are."""
        return list(parts)

    def nodal(self, parity: Parity, values: Array) -> Array:
        """Nodal values (nodes, m) of free ones (free, m) of a class."""
        found = np.zeros((self.tables.nodes, values.shape[1]))
        found[self.free[parity]] = values
        return found

    # -- force and tangent --------------------------------------------------------------------

    def force(
        self, classes: Classes, parts: Sequence[Array], viscous: Array | None = None
    ) -> tuple[list[Array], State]:
        """Force beyond that of tension and bending, by class (free, m), of deflections alike.

        viscous (m, m): 1 + tau d/dt on time samples, of a viscoelastic material.
        """
        slope = images(self.slopes(classes, parts))
        still = self.still_slopes(classes)
        if still is not None:
            slope += still[..., None]
        strain = 0.5 * symmetric_product(slope, slope)
        if still is not None:
            strain -= 0.5 * symmetric_product(still, still)[..., None]
        stress = self._stress(classes, strain, viscous)
        height = self._height(classes, parts)
        state = State(slope, stress, height)
        forces = self.work(classes, pulled(stress, slope))
        if height is not None:
            forces = self._with(classes, forces, self._attraction(classes, height))
        return forces, state

    def tangent(
        self,
        classes: Classes,
        state: State,
        parts: Sequence[Array],
        viscous: Array | None = None,
    ) -> list[Array]:
        """Derivative of the force about a state, by class (free, m), along deflections alike."""
        slope = images(self.slopes(classes, parts))
        stress = self._stress(classes, symmetric_product(state.slope, slope), viscous)
        traction = pulled(state.force, slope)
        traction += pulled(stress, state.slope)
        forces = self.work(classes, traction)
        if state.height is not None and self.gate is not None:
            change = self.heights(classes, parts)
            stiffness = self.gate.strength / (self.gate.gap - state.height) ** 3
            stiffness -= self._softening(classes)
            forces = self._with(classes, forces, -stiffness * change)
        return forces

    @property
    def odd(self) -> bool:
        """The force on the mirrored deflection is the mirrored force."""
        return self.shape is None and self.gate is None

    def stiffening(self, parity: Parity, state: State, modes: Array) -> Array:
        """What the mean membrane force adds to the stiffness of modes (k, k) of a class."""
        mean = state.uncoupling.mean(axis=-1)
        return np.asarray(modes.T @ (geometric(self.tables, mean, self.free[parity]) @ modes))

    def varying(self, parity: Parity, state: State, modes: Array) -> Array:
        """What the rest of it adds to the stiffness of each mode (k, m) at time samples."""
        force = state.uncoupling - state.uncoupling.mean(axis=-1, keepdims=True)
        force *= self.tables.weights[..., None]
        x, y = self.tables.slope(self.nodal(parity, modes)).reshape(2, -1, modes.shape[1])
        xx, yy, xy = force.reshape(3, len(x), -1)
        return np.asarray((x * x).T @ xx + (y * y).T @ yy + 2 * ((x * y).T @ xy))

    def heights(self, classes: Classes, parts: Sequence[Array]) -> Array:
        """Deflections (images, c, q, m) at the quadrature points, from the static state."""
        return images(np.stack([self.tables.value(w) for w in self._nodals(classes, parts)]))

    # -- parts --------------------------------------------------------------------------------

    def _nodals(self, classes: Classes, parts: Sequence[Array]) -> list[Array]:
        return [self.nodal(p, part) for p, part in zip(classes.deflections, parts)]

    def slopes(self, classes: Classes, parts: Sequence[Array]) -> Array:
        return np.stack([self.tables.slope(w) for w in self._nodals(classes, parts)])

    def still_slopes(self, classes: Classes) -> Array | None:
        """Slopes (images, 2, c, q) of the static state."""
        if self.shape is None:
            return None
        slopes = np.zeros((classes.count, 2, *self.tables.weights.shape))
        place = classes.deflections.index(self.even)
        slopes[place] = self.tables.slope(self.shape[:, None])[..., 0]
        return images(slopes)

    def _stress(self, classes: Classes, strain: Array, viscous: Array | None) -> Array:
        """Membrane force (images, 3, c, q, m) of strains alike, in-plane displacement condensed."""
        parts = images(strain)
        parts *= 1.0 / classes.count
        for number, parity in enumerate(classes.strains):
            if self.in_plane:
                parts[number] += self._relaxation(parity, parts[number])
            parts[number] = self.laws.stress(parts[number])
        stress = images(parts)
        return stress if viscous is None else stress @ viscous.T

    def _relaxation(self, parity: Parity, strain: Array) -> Array:
        """sym grad u (3, c, q, m) in equilibrium with a strain of one class."""
        tables = self.tables
        xx, yy, xy = self.laws.stress(strain) * tables.weights[..., None]
        load = np.empty((2 * tables.nodes, strain.shape[-1]))
        load[0::2] = tables.work(xx, xy, tables.gather_in_plane)
        load[1::2] = tables.work(xy, yy, tables.gather_in_plane)
        rows, factors = self.in_plane[parity]
        u = np.zeros_like(load)
        u[rows] = -factors.solve(load[rows])
        x_slope = tables.gradient(u[0::2][tables.in_plane])
        y_slope = tables.gradient(u[1::2][tables.in_plane])
        return np.stack([x_slope[0], y_slope[1], 0.5 * (x_slope[1] + y_slope[0])])

    def work(self, classes: Classes, traction: Array) -> list[Array]:
        """int t . grad v by class (free, m) of tractions (images, 2, c, q, m)."""
        parts = images(traction)
        parts *= self.tables.weights[..., None] / classes.count
        return [
            self.tables.work(part[0], part[1], self.tables.gather)[self.free[parity]]
            for part, parity in zip(parts, classes.deflections)
        ]

    def _height(self, classes: Classes, parts: Sequence[Array]) -> Array | None:
        if self.gate is None:
            return None
        values = np.stack([self.tables.value(w) for w in self._nodals(classes, parts)])
        if self.shape is not None:
            place = classes.deflections.index(self.even)
            values[place] += self.tables.value(self.shape[:, None])
        return images(values)

    def _still_height(self, classes: Classes) -> Array:
        """(images, c, q, 1) of the static state above the flat film."""
        zeros = [np.zeros((len(self.free[p]), 1)) for p in classes.deflections]
        height = self._height(classes, zeros)
        assert height is not None
        return height

    def _softening(self, classes: Classes) -> Array:
        assert self.gate is not None
        return self.gate.strength / (self.gate.gap - self._still_height(classes)) ** 3

    def _attraction(self, classes: Classes, height: Array) -> Array:
        """Pressure (images, c, q, m) of the gate beyond first order about the static state."""
        gate, still = self.gate, self._still_height(classes)
        assert gate is not None
        pressure = 0.5 * gate.strength * (gate.gap - height) ** -2
        pressure -= 0.5 * gate.strength * (gate.gap - still) ** -2
        return -(pressure - self._softening(classes) * (height - still))

    def _with(self, classes: Classes, forces: list[Array], pressure: Array) -> list[Array]:
        """Forces and those of a pressure (images, c, q, m)."""
        parts = images(pressure) * (self.tables.weights[..., None] / classes.count)
        pushed = (self.tables.push(part) for part in parts)
        return [f + p[self.free[c]] for f, p, c in zip(forces, pushed, classes.deflections)]


def symmetric_product(first: Array, second: Array) -> Array:
    """sym(s1 (x) s2) (images, 3, c, q, m) of slopes (images, 2, c, q, m)."""
    found = np.empty((len(first), 3, *second.shape[2:]))
    np.multiply(first[:, 0], second[:, 0], out=found[:, 0])
    np.multiply(first[:, 1], second[:, 1], out=found[:, 1])
    np.multiply(first[:, 0], second[:, 1], out=found[:, 2])
    if first is not second:
        found[:, 2] += first[:, 1] * second[:, 0]
        found[:, 2] *= 0.5
    return found


def pulled(stress: Array, slope: Array) -> Array:
    """N s (images, 2, c, q, m) of forces (images, 3, c, q, m) and slopes (images, 2, c, q, m)."""
    found = np.empty_like(slope)
    for component, (x, y) in enumerate(((0, 2), (2, 1))):
        np.multiply(stress[:, x], slope[:, 0], out=found[:, component])
        found[:, component] += stress[:, y] * slope[:, 1]
    return found
