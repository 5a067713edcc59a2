"""Tension and Young's modulus from measured resonance frequencies (step I of the paper).

Least squares of the relative differences between measured and computed frequencies; the gradients
come from the modes themselves (Hellmann-Feynman).  Where the measured modes are not labelled, they
are assigned in order of frequency so that the fit is best, leaving out computed modes that were
not seen.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from pathlib import Path

import attrs
import numpy as np
from numpy.typing import NDArray
from scipy import stats

from nanorom.assignment import UNSEEN, assign
from nanorom.errors import NanoromError, SceneError
from nanorom.measured import Resonances
from nanorom.scene import Disc, Rectangle, Scene, Tension

Array = NDArray[np.float64]

UNKNOWNS = ("tension", "tension_x", "tension_y", "youngs_modulus", "density")
USUAL = ("tension_x", "tension_y", "youngs_modulus")
UNITS = {"tension": "N/m", "tension_x": "N/m", "tension_y": "N/m"}
UNITS |= {"youngs_modulus": "Pa", "density": "kg/m^3"}

SPARE = 4  # computed modes beyond the measured ones
MOST_MODES = 100
SKEW = 1.05  # T_x/T_y of a start: equal tensions have no gradient that splits pairs
RATIOS = (1e-3, 4e-3, 1.6e-2, 6.4e-2, 0.26)  # D/(T L^2) at which spectra are computed
FACTORS = (0.5, 0.7, 1.0, 1.4, 2.0)  # of D, to either side of them
SKEWS = tuple(0.05 * i for i in range(-9, 10))  # (T_x - T_y)/(T_x + T_y)
MOST_STARTS = 2
GOOD = 0.3 * UNSEEN  # root mean square difference at which other starts are not tried
PRECISION = 1e-6  # relative, of the parameters
MOST_STEPS = 40
MOST_HALVINGS = 8
SHRINK = 0.2  # of a value, at most in one step: it stays positive
SINGULAR = 1e-7  # smallest of the singular values, relative: beyond, something is not determined
CONFIDENCE = 0.95


@attrs.frozen(eq=False)
class Lines:
    """Computed resonances: frequency (n,) Hz, label (n,), gradient (n, 4).

    The gradient is in Hz per unit of T_x, T_y (N/m), D (N m) and rho h (kg/m^2).
    """

    frequency: Array
    label: tuple[str, ...]
    gradient: Array


Spectrum = Callable[[float, float, float, float, int], Lines]  # T_x, T_y, D, rho h, count


@attrs.frozen(eq=False, kw_only=True)
class Identification:
    """What was found.

    value: unknown -> SI value; interval: unknown -> half width of the 95 % confidence interval
    (infinite where there are as many unknowns as frequencies and no uncertainties); scene: the
    scene with these values; measured, fitted: (n,) Hz; label: (n,) names of the assigned modes;
    noise: relative standard deviation of the differences; evaluations: eigensolutions needed.
    """

    value: dict[str, float]
    interval: dict[str, float]
    scene: Scene
    measured: Resonances
    fitted: Array
    label: tuple[str, ...]
    noise: float
    evaluations: int

    @property
    def difference(self) -> Array:
        """Relative difference (n,) measured/fitted - 1."""
        return self.measured.frequency / self.fitted - 1

    def save_scene(self, path: str | Path) -> None:
        """Write the scene with the values found; raises FileError."""
        from nanorom.files import atomic_path

        with atomic_path(path) as temporary:
            temporary.write_text(self.scene.to_toml(), encoding="utf-8")


def identify(
    scene: Scene, measured: Resonances, unknowns: Sequence[str] = USUAL
) -> Identification:
    """Find tension, Young's modulus or density of a scene from its measured resonances.

    Parameters
    ----------
    scene : geometry and what else is known; its own values of the unknowns are where the search
        starts and must be right within a factor of a few.
    measured : resonance frequencies, with or without labels and uncertainties.
    unknowns : of ``tension`` (isotropic), ``tension_x``, ``tension_y``, ``youngs_modulus``,
        ``density``.  On a film that is the same along x and y, modes without labels cannot tell
        T_x from T_y: they are found in the order that the scene has, T_x the larger if equal.

    Raises
    ------
    SceneError, NanoromError
        If the unknowns make no sense, or the frequencies do not determine them.
    """
    unknowns = _checked(scene, measured, unknowns)
    fit = _Fit(scene, measured, unknowns, _spectrum(scene))
    return fit.run()


def _spectrum(scene: Scene) -> Spectrum:
    try:
        from nanorom.fem.spectrum import Spectrum
    except ImportError as error:
        raise NanoromError(
            f"computing resonances needs DOLFINx, petsc4py, slepc4py and gmsh ({error}); "
            "use ./run or the container image"
        ) from error
    return Spectrum(scene)


def _checked(scene: Scene, measured: Resonances, unknowns: Sequence[str]) -> tuple[str, ...]:
    """The unknowns in their usual order; raises SceneError."""
    for name in unknowns:
        if name not in UNKNOWNS:
            raise SceneError(f"unknowns: found {name!r}; allowed: {', '.join(UNKNOWNS)}")
    chosen = tuple(name for name in UNKNOWNS if name in unknowns)
    if not chosen:
        raise SceneError(f"unknowns: found none; allowed: {', '.join(UNKNOWNS)}")
    if "tension" in chosen and any(name in chosen for name in ("tension_x", "tension_y")):
        raise SceneError("unknowns: found tension beside tension_x or tension_y; give one or both")
    if "youngs_modulus" in chosen and scene.plate.model == "membrane":
        raise SceneError(
            "unknowns: found youngs_modulus, but a membrane has no bending stiffness to find it "
            'from; use plate.model = "plate"'
        )
    if min(scene.tension.x, scene.tension.y) <= 0:
        raise SceneError("tension: the search needs a first guess greater than 0 along x and y")
    if len(measured.frequency) < len(chosen):
        raise SceneError(
            f"{len(chosen)} unknowns ({', '.join(chosen)}) need at least as many frequencies; "
            f"found {len(measured.frequency)}"
        )
    return chosen


class _Fit:
    """Least squares in the unknowns relative to where the search starts."""

    def __init__(
        self, scene: Scene, measured: Resonances, unknowns: tuple[str, ...], spectrum: Spectrum
    ) -> None:
        self.scene, self.measured, self.unknowns = scene, measured, unknowns
        self.spectrum = spectrum
        self.evaluations = 0
        self.count = len(measured.frequency) + SPARE
        self.logarithm = np.log(measured.frequency)
        self.weight = np.ones(len(self.logarithm))
        if measured.uncertainty is not None:
            self.weight = measured.frequency / measured.uncertainty
        self._last: tuple[bytes, Lines, NDArray[np.intp]] | None = None

    def run(self) -> Identification:
        """Search from one start after the other until the fit is good; take the best."""
        ends = [self._end(self._scaled(self._start()))]
        if not all(self.measured.label):
            for start in self._candidates() if ends[0][0] > self._good else ():
                ends.append(self._end(start))
                if ends[-1][0] <= self._good:
                    break
        return self._result(self._in_order(min(ends, key=lambda end: end[0])[1]))

    def _end(self, start: Array) -> tuple[float, Array]:
        """Where the search ends from a start, and its misfit."""
        end = self._least_squares(start)
        return self._misfit(end), end

    @property
    def _good(self) -> float:
        """Misfit at which no other start is tried: a third of what a wrong mode costs."""
        return GOOD**2 * len(self.logarithm)

    def _misfit(self, x: Array) -> float:
        """What a fit has to answer for: differences, and computed modes that were not seen."""
        lines, index = self._evaluate(x)
        difference = self.logarithm - np.log(lines.frequency[index])
        return float(difference @ difference + UNSEEN**2 * (index.max() + 1 - len(index)))

    def _start(self) -> Array:
        """The scene's own values, equal tensions made a little different."""
        own = np.array([self._own(name) for name in self.unknowns])
        if {"tension_x", "tension_y"} <= set(self.unknowns) and len(set(own[:2])) == 1:
            own[:2] *= [SKEW**0.5, SKEW**-0.5]
        return own

    def _candidates(self) -> list[Array]:
        """Starts for modes without labels: the best of a grid of tension and bending ratios.

        omega^2 is so nearly linear in tensions and bending stiffness that a few spectra with
        their gradients stand for all of the grid.
        """
        start = self._start()
        names = {name: i for i, name in enumerate(self.unknowns)}
        skews, ratios = [0.0], [0.0]
        if {"tension_x", "tension_y"} <= set(names):
            skews = [skew for skew in SKEWS if not self._alike or skew >= 0]
        if "youngs_modulus" in names:
            ratios = list(RATIOS)
        found: list[tuple[float, int, Array]] = []
        for ratio in ratios:
            sample = start.copy()
            if ratio:
                stiffness = ratio * start[: len(start) - 1].mean() * _length(self.scene) ** 2
                sample[names["youngs_modulus"]] = stiffness / self._bending(1.0)
            lines, _ = self._evaluate(sample)
            slope = 2 * lines.frequency[:, None] * lines.gradient @ self._physical(sample)[1]
            for skew, factor in itertools.product(skews, FACTORS if ratio else (1.0,)):
                tried = sample.copy()
                if len(skews) > 1:
                    mean = 0.5 * (sample[0] + sample[1])
                    tried[:2] = mean * (1 + skew), mean * (1 - skew)
                if ratio:
                    tried[names["youngs_modulus"]] *= factor
                squares = np.sort(lines.frequency**2 + slope @ (tried - sample))
                if squares[0] > 0:
                    found.append((self._grid_misfit(0.5 * np.log(squares)), len(found), tried))
        return [self._scaled(tried) for _, _, tried in sorted(found)[:MOST_STARTS]]

    def _grid_misfit(self, computed: Array) -> float:
        """Misfit of logarithms of frequencies (m,), the lowest ones made to agree."""
        computed = computed + self.logarithm[0] - computed[0]
        index = assign(self.logarithm, [""] * len(self.logarithm), computed, [])
        difference = self.logarithm - computed[index]
        return float(difference @ difference + UNSEEN**2 * (index.max() + 1 - len(index)))

    def _scaled(self, start: Array) -> Array:
        """Tensions and modulus by one factor, so that the lowest frequency fits."""
        lines, index = self._evaluate(start)
        lowest = index[0] if self.measured.label[0] else 0
        factor = (self.measured.frequency[0] / lines.frequency[lowest]) ** 2
        if any(name.startswith("tension") for name in self.unknowns):
            stiff = np.array([name != "density" for name in self.unknowns])
            return np.where(stiff, start * factor, start)
        return start

    def _own(self, name: str) -> float:
        tension, material = self.scene.tension, self.scene.material
        return {
            "tension": 0.5 * (tension.x + tension.y),
            "tension_x": tension.x,
            "tension_y": tension.y,
            "youngs_modulus": material.youngs_modulus,
            "density": material.density,
        }[name]

    def _bending(self, modulus: float) -> float:
        """Bending stiffness D in N m of a Young's modulus; 0 for a membrane."""
        h, nu = self.scene.plate.thickness, self.scene.material.poisson_ratio
        return 0.0 if self.scene.plate.model == "membrane" else modulus * h**3 / 12 / (1 - nu**2)

    def _physical(self, x: Array) -> tuple[Array, Array]:
        """T_x, T_y, D, rho h (4,) of the unknowns (p,), and their derivatives (4, p)."""
        given = dict(zip(self.unknowns, x))
        modulus = given.get("youngs_modulus", self.scene.material.youngs_modulus)
        both = given.get("tension")
        values = np.array(
            [
                given.get("tension_x", self.scene.tension.x) if both is None else both,
                given.get("tension_y", self.scene.tension.y) if both is None else both,
                self._bending(modulus),
                given.get("density", self.scene.material.density) * self.scene.plate.thickness,
            ]
        )
        columns = {
            "tension": [1.0, 1.0, 0.0, 0.0],
            "tension_x": [1.0, 0.0, 0.0, 0.0],
            "tension_y": [0.0, 1.0, 0.0, 0.0],
            "youngs_modulus": [0.0, 0.0, self._bending(1.0), 0.0],
            "density": [0.0, 0.0, 0.0, self.scene.plate.thickness],
        }
        return values, np.array([columns[name] for name in self.unknowns]).T

    def _evaluate(self, x: Array) -> tuple[Lines, NDArray[np.intp]]:
        """Computed resonances, and which of them belongs to each measured one."""
        if self._last is not None and self._last[0] == x.tobytes():
            return self._last[1:]
        while True:
            t_x, t_y, bending, areal_mass = self._physical(x)[0]
            lines = self.spectrum(t_x, t_y, bending, areal_mass, self.count)
            self.evaluations += 1
            missing = set(self.measured.label) - set(lines.label) - {""}
            if not missing:
                break
            self.count *= 2
            if self.count > MOST_MODES:
                raise SceneError(
                    f"label: found {', '.join(sorted(missing))}, which is not among the lowest "
                    f"{len(lines.label)} modes: {', '.join(lines.label)}"
                )
        index = assign(self.logarithm, self.measured.label, np.log(lines.frequency), lines.label)
        self._last = (x.tobytes(), lines, index)
        return lines, index

    def _residual(self, x: Array) -> Array:
        lines, index = self._evaluate(x)
        # squares are nearly linear in the unknowns, and 1/2 (f^2 - 1) is log f near f = 1
        ratio = lines.frequency[index] / self.measured.frequency
        return 0.5 * self.weight * (ratio**2 - 1)

    def _jacobian(self, x: Array) -> Array:
        lines, index = self._evaluate(x)
        ratio = lines.frequency[index] / self.measured.frequency**2
        gradient = (self.weight * ratio)[:, None] * lines.gradient[index]
        return gradient @ self._physical(x)[1]

    def _least_squares(self, x: Array, most: int = MOST_STEPS) -> Array:
        """Gauss-Newton: residuals are small, and every evaluation gives the gradient, too."""
        residual, jacobian = self._residual(x), self._jacobian(x) * x
        for _ in range(most):
            step = x * np.linalg.lstsq(jacobian, -residual, rcond=None)[0]
            for _ in range(MOST_HALVINGS):
                tried = np.maximum(x + step, SHRINK * x)
                found = self._residual(tried)
                if found @ found <= residual @ residual:
                    break
                step = 0.5 * step
            else:
                return x
            change = np.abs(tried / x - 1).max()
            x, residual, jacobian = tried, found, self._jacobian(tried) * tried
            if change < PRECISION:
                break
        return x

    def _in_order(self, x: Array) -> Array:
        """T_x and T_y in the scene's order where the measurement cannot tell them apart."""
        tension = self.scene.tension
        named = set("".join(self.measured.label)) & set("cs,")  # f11c, (1,2): they tell x from y
        if not self._alike or named or not {"tension_x", "tension_y"} <= set(self.unknowns):
            return x
        i, j = self.unknowns.index("tension_x"), self.unknowns.index("tension_y")
        if (x[i] < x[j]) == (tension.x < tension.y):
            return x
        swapped = x.copy()
        swapped[[i, j]] = x[[j, i]]
        return swapped

    @property
    def _alike(self) -> bool:
        """Whether the film is the same along x and y."""
        geometry = self.scene.geometry
        square = isinstance(geometry, Rectangle) and geometry.length == geometry.width
        return isinstance(geometry, Disc) or square

    def _result(self, x: Array) -> Identification:
        lines, index = self._evaluate(x)
        residual, jacobian = self._residual(x), self._jacobian(x) * x
        singular = np.linalg.svd(jacobian, compute_uv=False)
        if singular[-1] <= SINGULAR * singular[0]:
            raise SceneError(
                f"the measured frequencies do not determine {', '.join(self.unknowns)} together; "
                "take fewer unknowns or measure higher modes"
            )
        freedom = len(residual) - len(x)
        if self.measured.uncertainty is not None:
            variance, quantile = 1.0, stats.norm.ppf(0.5 + CONFIDENCE / 2)
        elif freedom > 0:
            variance = float(residual @ residual) / freedom
            quantile = stats.t.ppf(0.5 + CONFIDENCE / 2, freedom)
        else:
            variance, quantile = np.inf, 1.0
        covariance = variance * np.linalg.inv(jacobian.T @ jacobian)
        width = quantile * np.sqrt(np.diag(covariance)) * x
        plain = np.log(lines.frequency[index]) - self.logarithm
        values, _ = self._physical(x)
        found = dict(zip(self.unknowns, x.tolist()))
        material = attrs.evolve(
            self.scene.material,
            **{n: v for n, v in found.items() if n in ("youngs_modulus", "density")},
        )
        tension = Tension(float(values[0]), float(values[1]))
        return Identification(
            value=found,
            interval=dict(zip(self.unknowns, width.tolist())),
            scene=self.scene.with_(material=material, tension=tension),
            measured=self.measured,
            fitted=lines.frequency[index],
            label=tuple(lines.label[i] for i in index),
            noise=float(np.sqrt(plain @ plain / max(freedom, 1))),
            evaluations=self.evaluations,
        )


def _length(scene: Scene) -> float:
    """A length of the film in m, to make the bending stiffness a plain number."""
    geometry = scene.geometry
    if isinstance(geometry, Disc):
        return geometry.radius
    if isinstance(geometry, Rectangle):
        return 0.5 * min(geometry.length, geometry.width)
    return geometry.scale
