"""Least squares of computed to measured resonances in the unknown parameters of a film."""

from __future__ import annotations

import attrs
import numpy as np
from numpy.typing import NDArray

from nanorom.errors import SceneError
from nanorom.measurement.assignment import UNSEEN, assign
from nanorom.measurement.data import Resonances
from nanorom.measurement.unknowns import PAIR, Film, Unknown
from nanorom.rom.names import plain
from nanorom.rom.spectrum import Lines, Spectrum
from nanorom.scene.geometry import Disc, Rectangle
from nanorom.scene.scene import Scene
from nanorom.types import Array

SKEW = 1.05  # T_x/T_y of a start: equal tensions have no gradient that splits pairs
MOST_MODES = 100
PRECISION = 1e-6  # relative, of the parameters
MOST_STEPS = 40
SCALINGS = 4
SCALED = 1e-3  # relative, of the lowest squared frequency
MOST_HALVINGS = 8
SHRINK = 0.2  # of a value, at most in one step: it stays positive
USUAL_NOISE = 1e-3  # relative: fits that are better are equally good where nothing tells the noise
LEAST_NOISE = 1e-9  # relative: rounding of the frequencies


@attrs.define(eq=False)
class Fit:
    """Differences between measured and computed resonances as functions of the unknowns (p,).

    noise: relative standard deviation (n,) or one number, with which modes are assigned; count:
    how many modes are computed, more once a label asks for it; evaluations: spectra so far.
    """

    scene: Scene
    measured: Resonances
    unknowns: tuple[Unknown, ...]
    spectrum: Spectrum
    count: int
    noise: Array | float
    evaluations: int = 0
    _last: tuple[bytes, Lines, NDArray[np.intp]] | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Names (p,) of the unknowns."""
        return tuple(unknown.name for unknown in self.unknowns)

    @property
    def pair(self) -> list[int]:
        """Where T_x and T_y stand among the unknowns; empty unless both do."""
        return [self.names.index(name) for name in PAIR] if set(PAIR) <= set(self.names) else []

    @property
    def known(self) -> tuple[str, ...]:
        """Names (n,) of the measured modes, "" where they are not known."""
        return tuple(map(plain, self.measured.label))

    @property
    def logarithm(self) -> Array:
        """Logarithms (n,) of the measured frequencies."""
        return np.log(self.measured.frequency)

    @property
    def weight(self) -> Array:
        """Inverse (n,) of the stated relative uncertainties, or ones."""
        error = self.measured.uncertainty
        return np.ones(len(self.logarithm)) if error is None else self.measured.frequency / error

    @property
    def freedom(self) -> int:
        """Frequencies more than unknowns."""
        return len(self.measured.frequency) - len(self.unknowns)

    # -- parameters -------------------------------------------------------------------------------

    def start(self) -> Array:
        """The scene's own values (p,), equal tensions made a little different."""
        film = Film.of(self.scene)
        x = np.array([unknown.of(film) for unknown in self.unknowns])
        if self.pair and np.ptp(x[self.pair]) == 0:
            x[self.pair] *= [SKEW**0.5, SKEW**-0.5]
        return x

    def film(self, x: Array) -> Film:
        """The scene's film with values (p,) of the unknowns."""
        film = Film.of(self.scene)
        for unknown, value in zip(self.unknowns, x.tolist()):
            film = unknown.put(film, value)
        return film

    def physical(self, x: Array) -> tuple[Array, Array]:
        """T_x, T_y, D, rho h (4,) of the unknowns (p,), and their derivatives (4, p)."""
        film = self.film(x)
        return film.operators, np.array([unknown.slope(film) for unknown in self.unknowns]).T

    def inside(self, x: Array) -> Array:
        """The values (p,) within the bounds of the unknowns that are nearest."""
        low, high = np.transpose([unknown.bounds for unknown in self.unknowns])
        return np.clip(x, low, high)

    def scaled(self, x: Array, lowest: int = 0) -> Array:
        """Unknowns by one factor, so that a computed mode has the lowest measured frequency.

        The density where it is unknown, else all unknown stiffness; where some is known, that
        takes a few steps.
        """
        power = np.array([unknown.stiffens for unknown in self.unknowns])
        if (power < 0).any():
            power = np.minimum(power, 0)
        for _ in range(SCALINGS):
            lines, index = self.evaluate(x)
            mode = index[0] if self.measured.label[0] else lowest
            factor = (self.measured.frequency[0] / lines.frequency[mode]) ** 2
            if abs(factor - 1) < SCALED:
                break
            x = x * factor**power
        return x

    @property
    def told_apart(self) -> bool:
        """Whether x and y differ: by the film's shape, or by labels such as f11c and (1,2)."""
        geometry = self.scene.geometry
        square = isinstance(geometry, Rectangle) and geometry.length == geometry.width
        alike = isinstance(geometry, Disc) or square
        return not alike or any(set(name) & set("cs(") for name in self.known)

    def in_order(self, x: Array) -> Array:
        """T_x and T_y in the scene's order where the measurement cannot tell them apart."""
        if self.told_apart or not self.pair:
            return x
        i, j = self.pair
        if (x[i] < x[j]) == (self.scene.tension.x < self.scene.tension.y):
            return x
        swapped = x.copy()
        swapped[[i, j]] = x[[j, i]]
        return swapped

    # -- differences ------------------------------------------------------------------------------

    def evaluate(self, x: Array) -> tuple[Lines, NDArray[np.intp]]:
        """Computed resonances, and which of them belongs to each measured one."""
        key = np.append(x, self.noise).tobytes()
        if self._last is not None and self._last[0] == key:
            return self._last[1:]
        while True:
            t_x, t_y, bending, areal_mass = self.physical(x)[0]
            lines = self.spectrum(t_x, t_y, bending, areal_mass, self.count)
            lines = attrs.evolve(lines, label=tuple(map(plain, lines.label)))
            self.evaluations += 1
            missing = set(self.known) - set(lines.label) - {""}
            if not missing:
                break
            self.count *= 2
            if self.count > MOST_MODES:
                raise SceneError(
                    f"label: found {', '.join(sorted(missing))}, which is not among the lowest "
                    f"{len(lines.label)} modes: {', '.join(lines.label)}"
                )
        computed = np.log(lines.frequency)
        index = assign(self.logarithm, self.known, computed, lines.label, self.noise)
        self._last = (key, lines, index)
        return lines, index

    def residual(self, x: Array) -> Array:
        """Weighted relative differences (n,)."""
        lines, index = self.evaluate(x)
        # squares are nearly linear in the unknowns, and 1/2 (f^2 - 1) is log f near f = 1
        ratio = lines.frequency[index] / self.measured.frequency
        return 0.5 * self.weight * (ratio**2 - 1)

    def jacobian(self, x: Array) -> Array:
        """Derivative (n, p) of the residual with the logarithms of the unknowns."""
        lines, index = self.evaluate(x)
        ratio = lines.frequency[index] / self.measured.frequency**2
        gradient = (self.weight * ratio)[:, None] * lines.gradient[index]
        return gradient @ self.physical(x)[1] * x

    def least_squares(self, x: Array, precision: float = PRECISION) -> Array:
        """Gauss-Newton: residuals are small, and every evaluation gives the gradient, too."""
        residual, jacobian = self.residual(x), self.jacobian(x)
        for _ in range(MOST_STEPS):
            step = x * np.linalg.lstsq(jacobian, -residual, rcond=None)[0]
            if np.abs(step / x).max() < precision:
                break
            for _ in range(MOST_HALVINGS):
                tried = self.inside(np.maximum(x + step, SHRINK * x))
                found = self.residual(tried)
                if found @ found <= residual @ residual:
                    break
                step = 0.5 * step
            else:
                return x
            x, residual, jacobian = tried, found, self.jacobian(tried)
        return x

    def stepped(self, x: Array, damping: float) -> Array:
        """One damped step of least squares; damping: noise by relative change of the unknowns."""
        rows = np.append(self.jacobian(x), damping * np.eye(len(x)) * self.weight.mean(), axis=0)
        step = np.linalg.lstsq(rows, np.append(-self.residual(x), 0 * x), rcond=None)[0]
        return self.inside(x * np.exp(step))

    def scatter(self, x: Array) -> float:
        """Relative standard deviation of the differences."""
        lines, index = self.evaluate(x)
        plain = np.log(lines.frequency[index]) - self.logarithm
        return float(np.sqrt(plain @ plain / max(self.freedom, 1)))

    def cost(self, x: Array) -> float:
        """-2 log of how likely the measurement and its assignment are, but for a constant.

        chi^2 where uncertainties are stated; else the noise is unknown, and the odds go with
        chi^-(n - p).  As many unknowns as frequencies leave no noise to be found: what misses by
        more than is usual is then the less likely.
        """
        _, index = self.evaluate(x)
        residual = self.residual(x)
        square = float(residual @ residual)
        if self.measured.uncertainty is None:
            least = LEAST_NOISE if self.freedom > 0 else USUAL_NOISE
            square = max(self.freedom, 1) * np.log(max(square, least**2))
        return square + UNSEEN * float(index.max() + 1 - len(index))
