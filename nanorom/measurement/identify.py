"""Tension and Young's modulus from measured resonance frequencies (step I of the paper).

Least squares of the relative differences between measured and computed frequencies; the gradients
come from the modes themselves (Hellmann-Feynman).  Where the measured modes are not labelled, all
assignments in order of frequency compete, and those that the data do not exclude are told.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import attrs
import numpy as np
from scipy import stats

from nanorom.errors import AmbiguityWarning, SceneError
from nanorom.measurement.data import Resonances
from nanorom.measurement.fit import Fit
from nanorom.measurement.search import NOISE, Solution, solutions
from nanorom.measurement.unknowns import USUAL, Film, Unknown, chosen
from nanorom.scene.scene import Scene
from nanorom.types import Array

if TYPE_CHECKING:
    from nanorom.fem.spectrum import Spectrum

SPARE = 4  # computed modes beyond the measured ones, where all have a label
SEARCHED = 2, 8  # modes per measured one and beyond, where some have none
SINGULAR = 1e-7  # smallest of the singular values, relative: beyond, something is not determined
CONFIDENCE = 0.95
EXCLUDED = 1 / 20  # odds, to the best assignment, below which another is not told
SAME = 0.01  # relative, of the values, where there are no intervals
MOST_RIVALS = 5


@attrs.frozen(eq=False)
class Rival:
    """Another assignment that the measurement does not exclude, with other values.

    value: unknown -> SI value; label: (n,) modes; noise: relative standard deviation of the
    differences; chi2: sum of squares of the differences in units of the stated uncertainties, or
    of the noise of the best assignment; odds: its likelihood by that of the best.
    """

    value: dict[str, float]
    label: tuple[str, ...]
    noise: float
    chi2: float
    odds: float


@attrs.frozen(eq=False, kw_only=True)
class Identification:
    """What was found.

    value: unknown -> SI value; interval: unknown -> half width of the 95 % confidence interval
    (infinite where there are as many unknowns as frequencies and no uncertainties); scene: the
    scene with these values; measured, fitted: (n,) Hz; label: (n,) names of the assigned modes;
    noise: relative standard deviation of the differences; rivals: assignments that the measurement
    does not exclude, the likeliest first; evaluations: finite-element spectra after the search.
    """

    value: dict[str, float]
    interval: dict[str, float]
    scene: Scene
    measured: Resonances
    fitted: Array
    label: tuple[str, ...]
    noise: float
    rivals: tuple[Rival, ...]
    evaluations: int

    @property
    def difference(self) -> Array:
        """Relative difference (n,), measured/fitted - 1."""
        return self.measured.frequency / self.fitted - 1

    def save_scene(self, path: str | Path) -> None:
        """Write the scene with the values found; raises FileError."""
        from nanorom.files.whole import atomic_path

        with atomic_path(path) as temporary:
            temporary.write_text(self.scene.to_toml(), encoding="utf-8")


def identify(scene: Scene, measured: Resonances, unknowns: Sequence[str] = USUAL) -> Identification:
    """Find tension, Young's modulus, density or thickness of a scene from its measured resonances.

    Parameters
    ----------
    scene : geometry and what else is known; its own values of the unknowns are where the search
        starts and must be right within a factor of a few.
    measured : resonance frequencies, with or without labels and uncertainties.
    unknowns : names of `nanorom.measurement.unknowns`: ``tension`` (isotropic), ``tension_x``,
        ``tension_y``, ``youngs_modulus``, ``density``, ``thickness``.  On a film that is the same
        along x and y, modes without labels cannot tell T_x from T_y: they are found in the order
        that the scene has, T_x the larger if equal.

    Warns with AmbiguityWarning if another assignment with other values is not excluded.

    Raises
    ------
    SceneError, NanoromError
        If the unknowns make no sense, or the frequencies do not determine them.
    """
    wanted = _checked(scene, measured, unknowns)
    spectrum = _spectrum(scene)
    fit = Fit(scene, measured, wanted, spectrum, len(measured.label) + SPARE, NOISE[0])
    if all(measured.label):
        return _result(fit, fit.least_squares(fit.scaled(fit.start())))
    most = SEARCHED[0] * len(measured.label) + SEARCHED[1]
    search = Fit(scene, measured, wanted, spectrum.reduced(most), most, NOISE[0])
    found = solutions(search, spectrum.length)
    fit.count, fit.noise = int(found[0].index.max()) + SPARE, found[0].noise
    return _result(fit, fit.in_order(fit.least_squares(found[0].x)), found)


def _spectrum(scene: Scene) -> Spectrum:
    from nanorom.launch import finite_elements

    with finite_elements():
        from nanorom.fem.spectrum import Spectrum
    return Spectrum(scene)


def _checked(scene: Scene, measured: Resonances, unknowns: Sequence[str]) -> tuple[Unknown, ...]:
    """The unknowns in their usual order; raises SceneError."""
    found = chosen(Film.of(scene), tuple(unknowns))
    if min(scene.tension.x, scene.tension.y) <= 0:
        raise SceneError("tension: the search needs a first guess greater than 0 along x and y")
    if len(measured.frequency) < len(found):
        names = ", ".join(unknown.name for unknown in found)
        raise SceneError(
            f"{len(found)} unknowns ({names}) need at least as many frequencies; "
            f"found {len(measured.frequency)}"
        )
    return found


def _result(fit: Fit, x: Array, found: Sequence[Solution] = ()) -> Identification:
    """What is told of a fit at its end, and of the other ends that were found."""
    lines, index = fit.evaluate(x)
    residual, jacobian = fit.residual(x), fit.jacobian(x)
    singular = np.linalg.svd(jacobian, compute_uv=False)
    if singular[-1] <= SINGULAR * singular[0]:
        raise SceneError(
            f"the measured frequencies do not determine {', '.join(fit.names)} together; "
            "take fewer unknowns or measure higher modes"
        )
    if fit.measured.uncertainty is not None:
        variance, quantile = 1.0, stats.norm.ppf(0.5 + CONFIDENCE / 2)
    elif fit.freedom > 0:
        variance = float(residual @ residual) / fit.freedom
        quantile = stats.t.ppf(0.5 + CONFIDENCE / 2, fit.freedom)
    else:
        variance, quantile = np.inf, 1.0
    covariance = variance * np.linalg.inv(jacobian.T @ jacobian)
    width = quantile * np.sqrt(np.diag(covariance)) * x
    others = [other for other in found[1:] if _differs(other, found[0], width)]
    rivals = tuple(
        Rival(
            value=dict(zip(fit.names, other.x.tolist())),
            label=other.label,
            noise=other.scatter,
            chi2=other.square / variance,
            odds=float(np.exp(0.5 * (found[0].cost - other.cost))),
        )
        for other in others[:MOST_RIVALS]
    )
    if rivals:
        warnings.warn(
            f"{len(others)} other assignments of the modes are not excluded, the likeliest with "
            f"odds of {rivals[0].odds:.2g}; state uncertainties, label modes or measure more",
            AmbiguityWarning,
            stacklevel=3,
        )
    return Identification(
        value=dict(zip(fit.names, x.tolist())),
        interval=dict(zip(fit.names, width.tolist())),
        scene=fit.film(x).put_into(fit.scene),
        measured=fit.measured,
        fitted=lines.frequency[index],
        label=tuple(lines.label[i] for i in index),
        noise=fit.scatter(x),
        rivals=rivals,
        evaluations=fit.evaluations,
    )


def _differs(other: Solution, best: Solution, width: Array) -> bool:
    """Whether a solution that is not excluded has values beyond the intervals of the best."""
    likely = other.cost <= best.cost - 2 * np.log(EXCLUDED)
    reach = np.where(np.isfinite(width), width, SAME * best.x)
    return bool(likely and (np.abs(other.x - best.x) > reach).any())
