"""From nonlinear sweeps to a device: tension, modulus, losses, drive, read-out, with intervals.

One mode alone in arbitrary units tells its frequency, its loss and two products; what is more
(Davidovikj et al., Nat. Commun. 8 (2017) 1253, doi:10.1038/s41467-017-01351-4) needs amplitudes in
metres or forces in newtons, or several modes, whose frequencies tell tension and bending.  What the
data leave open is told, with what would close it.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import attrs
import numpy as np

from nanorom.errors import SceneError
from nanorom.measurement.data import MeasuredResponse, Trace
from nanorom.measurement.device.begin import Begin, fit_of
from nanorom.measurement.device.choice import Choice, chosen
from nanorom.measurement.device.fit import DeviceFit, Evaluation, Measured, quantile
from nanorom.measurement.device.parameters import Parameters
from nanorom.measurement.device.phases import with_phases
from nanorom.measurement.device.request import Request
from nanorom.measurement.device.start import from_peaks
from nanorom.measurement.sweeps.peaks import CONFIDENCE, Estimate, Peak, find_peaks, is_alike
from nanorom.scene.excitation import Damping
from nanorom.scene.scene import Scene
from nanorom.scene.units import with_unit
from nanorom.types import Array, Progress

PART = 0.2  # of the largest share in what is not told: parameters that belong to it


@attrs.frozen
class Open:
    """Numbers that the data do not tell apart: any one of them, measured otherwise, tells all."""

    titles: tuple[str, ...]


@attrs.frozen(eq=False)
class Fitted:
    """A part of a trace, place: in which range of rows, and what the fit has there.

    fitted: (n,) in the unit of the amplitude; falls:
    rows (2,) Hz, fold Hz or nan, and whether it was before the fold; misfit: neighbouring
    differences are more alike than noise.
    """

    trace: Trace
    place: int
    fitted: Array
    falls: tuple[tuple[float, float, float, bool], ...]
    misfit: bool


@attrs.frozen(eq=False, kw_only=True, repr=False)
class SweepIdentification:
    """What was found.

    estimate: value and half width of the 95 % interval by title, "youngs_modulus" or
    "readout.f01"; unit: of each; correlation: (p, p); open: what the data do not tell apart, whose
    intervals are infinite; scene: with these values; frequency: (L,) Hz of the modes label; level:
    unit of a level that drive and readout belong to; parts: data and fit; noise: relative, of the
    largest amplitude; choices: models that were tried; unit_of_amplitude; evaluations: devices,
    explored: diagrams that were computed.
    """

    estimate: dict[str, Estimate]
    unit: dict[str, str]
    correlation: Array
    open: tuple[Open, ...]
    scene: Scene
    label: tuple[str, ...]
    frequency: Array
    level: str
    parts: tuple[Fitted, ...]
    noise: float
    choices: tuple[Choice, ...]
    unit_of_amplitude: str
    evaluations: int
    explored: int

    def __repr__(self) -> str:
        rows = sum(len(part.trace.frequency) for part in self.parts)
        head = f"SweepIdentification of {len(self.estimate)} numbers from {rows} rows"
        own = [
            f"{title} = {with_unit(each.value, self.unit[title])} +- "
            f"{with_unit(each.interval, self.unit[title], 2)}"
            for title, each in self.estimate.items()
        ]
        return "\n  ".join([head, *own, *(["misfit: more is left than noise"] * self.misfit)])

    @property
    def misfit(self) -> bool:
        """What is left is more than noise: another mode, or another nonlinearity."""
        return any(part.misfit for part in self.parts)

    def __getitem__(self, title: str) -> Estimate:
        """Of a number, by its title; raises SceneError."""
        if title not in self.estimate:
            raise SceneError(f"found {title!r}; allowed: {', '.join(self.estimate)}")
        return self.estimate[title]

    def save_scene(self, path: str | Path) -> None:
        """Write the scene with the values found; raises FileError."""
        from nanorom.files.whole import atomic_path

        with atomic_path(path) as temporary:
            temporary.write_text(self.scene.to_toml(), encoding="utf-8")


def identify_sweeps(
    scene: Scene | str | Path,
    measured: MeasuredResponse | str | Path | Sequence[str | Path],
    unknowns: Sequence[str] | None = None,
    *,
    labels: Sequence[str] = (),
    progress: Progress | None = None,
) -> SweepIdentification:
    """Find numbers of a scene and of the instruments from nonlinear sweeps.

    Parameters
    ----------
    scene : a first guess, right within a factor of a few; its own modes are those that peaks may be
    measured : amplitudes against frequency, up, down or both, at one or several levels, or the
        files that have them
    unknowns : of the film those of `nanorom.measurement.unknowns`; quality_factor, drive, readout,
        with an s at their end for one each mode; material_time, offset; phase, which is sought
        where phases are measured.  Left out: tension,
        youngs_modulus, quality_factors, and drives and readouts where units do not tell them.
    labels : names of the modes of the peaks, by rising frequency; those that fit best if left out

    Warns with AmbiguityWarning if other modes than those taken are not excluded.

    Raises
    ------
    SceneError, FileError, NanoromError
        If the unknowns make no sense, the data have no peak, or no film meets them.
    """
    scene = Scene.of(scene)
    linear = MeasuredResponse.of(measured).linear()
    told = progress or (lambda stage, done, total: None)
    Request.of(scene, linear, unknowns, 1)  # what makes no sense is refused before anything runs
    peaks = _peaks(linear, told)
    request = Request.of(scene, linear, unknowns, len(peaks))
    told("modes", 0, 1)
    begin = Begin.of(scene, peaks, request, labels, linear.unit)
    x = from_peaks(begin.parameters, peaks, list(range(len(peaks))), request.levels)
    fit = fit_of(begin.parameters, peaks, request)
    fit, x = with_phases(fit, x)
    told("fit", 0, 1)
    fit, found, choices = chosen(fit, fit.descend(x), begin)
    told("fit", 1, 1)
    return _result(fit, found, choices, request, linear.unit)


def _peaks(measured: MeasuredResponse, told: Progress) -> list[Peak]:
    return sorted(find_peaks(measured, told), key=lambda peak: peak.frequency.value)


def _result(
    fit: DeviceFit,
    found: Evaluation,
    choices: tuple[Choice, ...],
    request: Request,
    unit: str,
) -> SweepIdentification:
    parameters = fit.parameters
    covariance, untold = fit.covariance(found)
    values = parameters.values(found.x)
    deviation = np.sqrt(np.diag(covariance))
    width = quantile(CONFIDENCE, fit.rows - len(values)) * deviation
    opened = _open(untold, parameters)
    loose = {title for each in opened for title in each.titles}
    estimate = {}
    for parameter, value, half in zip(parameters.sought, values.tolist(), width.tolist()):
        size = np.inf if parameter.title in loose else half
        estimate[parameter.title] = Estimate(value, size * (value if parameter.logarithm else 1.0))
    parts = tuple(
        _fitted(fit, part, y, falls) for part, y, falls in zip(fit.parts, found.fitted, found.falls)
    )
    quality = np.sqrt(found.device.terms.stiffness) / found.device.terms.damping
    damping = Damping(
        tuple(quality[np.argsort(found.device.frequency)].tolist()), found.device.terms.time
    )
    return SweepIdentification(
        estimate=estimate,
        unit={parameter.title: parameter.unit for parameter in parameters.sought},
        correlation=covariance / np.maximum(np.outer(deviation, deviation), 1e-300),
        open=opened,
        scene=attrs.evolve(found.device.scene, damping=damping),
        label=found.device.label,
        frequency=found.device.frequency,
        level=request.unit,
        parts=parts,
        noise=_noise(fit),
        choices=choices,
        unit_of_amplitude=unit,
        evaluations=parameters.evaluations,
        explored=fit.explored,
    )


def _noise(fit: DeviceFit) -> float:
    shares = []
    for part in fit.parts:
        size = float(part.trace.amplitude.max())
        shares.append(float(fit.deviation(part.place, np.array([size]))[0]) / size)
    return float(np.median(shares))


def _open(untold: Array, parameters: Parameters) -> tuple[Open, ...]:
    """Which parameters a direction moves that the data do not tell."""
    found = []
    for row in untold:
        sizes = np.abs(row)
        own = sizes > PART * sizes.max()
        found.append(Open(tuple(p.title for p, o in zip(parameters.sought, own) if o)))
    return tuple(found)


def _fitted(
    fit: DeviceFit, part: Measured, y: Array, falls: list[tuple[int, float, bool]]
) -> Fitted:
    hertz = part.trace.frequency
    told = tuple(
        (float(hertz[row - 1]), float(hertz[row]), fold, early) for row, fold, early in falls
    )
    left = (y - part.trace.amplitude) / fit.deviation(part.place, y)
    return Fitted(part.trace, part.place, y, told, is_alike(left, [len(left)]))
