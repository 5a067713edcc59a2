"""From nonlinear sweeps to a device: tension, modulus, losses, drive, read-out, with intervals.

One mode alone in arbitrary units tells its frequency, its loss and two products; what is more
(Davidovikj et al., Nat. Commun. 8 (2017) 1253, doi:10.1038/s41467-017-01351-4) needs amplitudes in
metres or forces in newtons, or several modes, whose frequencies tell tension and bending.  What the
data leave open is told, with what would close it.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import attrs
import numpy as np

from nanorom.errors import AmbiguityWarning, SceneError
from nanorom.measurement.assignment import assign
from nanorom.measurement.data import MeasuredResponse, Resonances, Trace
from nanorom.measurement.device.fit import DeviceFit, Evaluation, Measured, quantile
from nanorom.measurement.device.parameters import Known, Parameter, Parameters
from nanorom.measurement.device.request import Request
from nanorom.measurement.device.start import from_peaks
from nanorom.measurement.sweeps.peaks import CONFIDENCE, Estimate, Peak, find_peaks, is_alike
from nanorom.measurement.unknowns import Film
from nanorom.rom.names import plain
from nanorom.scene.excitation import Damping
from nanorom.scene.scene import Scene
from nanorom.types import Array, Progress

if TYPE_CHECKING:
    from nanorom.fem.sensitivity.model import ModelSlopes

COARSE = 0.05  # relative: how far a mode's frequency in the scene may be from the measured one
PART = 0.2  # of the largest share in what is not told: parameters that belong to it


@attrs.frozen
class Open:
    """Numbers that the data do not tell apart: any one of them, measured otherwise, tells all."""

    titles: tuple[str, ...]


@attrs.frozen
class Choice:
    """A model that was tried: name; evidence: -2 log of its likelihood with what its parameters
    cost, relative to the one taken, a factor on odds of exp(-evidence/2); taken.
    """

    name: str
    evidence: float
    taken: bool


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


@attrs.frozen(eq=False, kw_only=True)
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
        with an s at their end for one each mode; material_time, offset.  Left out: tension,
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
    begin, names = _modes(scene, peaks, request, labels)
    parameters = _parameters(begin, names, request, peaks, linear.unit)
    x = from_peaks(parameters, peaks, list(range(len(peaks))), request.levels)
    fit = _fit(parameters, linear, peaks, request)
    told("fit", 0, 1)
    found = fit.descend(x)
    fit, found, choices = _with_nonlinear_damping(fit, found)
    told("fit", 1, 1)
    return _result(fit, found, choices, request, linear.unit)


def _peaks(measured: MeasuredResponse, told: Progress) -> list[Peak]:
    return sorted(find_peaks(measured, told), key=lambda peak: peak.frequency.value)


def _reducer() -> Callable[[Scene, Sequence[str]], ModelSlopes]:
    from nanorom.launch import finite_elements

    with finite_elements():
        from nanorom.fem.sensitivity.model import model_slopes
    return model_slopes


def _modes(
    scene: Scene, peaks: Sequence[Peak], request: Request, labels: Sequence[str]
) -> tuple[Scene, list[str]]:
    """The scene with the modes of the peaks alone, near to their frequencies, and their names."""
    frequency = np.array([peak.frequency.value for peak in peaks])
    known = [plain(label) for label in labels] or [""] * len(peaks)
    if len(known) != len(peaks):
        raise SceneError(f"labels: found {len(known)}; allowed: {len(peaks)}, one for each peak")
    scene = _near(scene, frequency, request, known)
    found = _reducer()(scene, [])
    names = [plain(name) for name in found.label]
    for name in known:
        if name and name not in names:
            raise SceneError(f"labels: found {name!r}; allowed: {', '.join(names)}")
    if len(peaks) > len(names):
        raise SceneError(
            f"modes.count: found {len(names)}, fewer than the {len(peaks)} peaks of the data"
        )
    places = found.value.frequency
    shift = np.log(frequency[0] / places[0]) if not known[0] and len(peaks) == 1 else 0.0
    index = assign(np.log(frequency) - shift, known, np.log(places), names, COARSE)
    numbers = [found.number[i] for i in index]
    return scene.with_(modes=sorted(numbers), damping=None, drive=scene.drive, sweep=None), [
        names[i] for i in index
    ]


def _near(scene: Scene, frequency: Array, request: Request, known: Sequence[str]) -> Scene:
    """The scene whose resonances are near the measured ones, where these can tell (step I)."""
    from nanorom.measurement.identify import identify

    film = [unknown for unknown in request.film if unknown.slope(Film.of(scene)).any()]
    pulls = [unknown for unknown in film if unknown.pulls]
    for names in (film, pulls, pulls[:1]):
        if not names or len(names) > len(frequency) or len(frequency) == 1:
            continue  # one peak is the lowest mode, if nothing else is said
        try:
            with warnings.catch_warnings():
                if len(names) < len(film):
                    warnings.simplefilter("ignore", AmbiguityWarning)
                return identify(
                    scene, Resonances(frequency, tuple(known)), [unknown.name for unknown in names]
                ).scene
        except SceneError:  # not determined by frequencies: by fewer of them
            continue
    return scene


def _parameters(
    scene: Scene, label: Sequence[str], request: Request, peaks: Sequence[Peak], unit: str
) -> Parameters:
    """All parameters where the search begins, before the peaks have told more."""
    film = Film.of(scene)
    sought = [Parameter(u.name, "", u.of(film), u.unit) for u in request.film]
    quality = scene.damping.per_mode(len(label)) if scene.damping else (np.nan,) * len(label)
    fixed = {f"quality_factor.{name}": value for name, value in zip(label, quality)}
    fixed |= {"material_time": film.material_time, "offset": 0.0, "drive": 1.0, "readout": 1.0}
    begin = {
        "quality_factor": [peak.quality_factor.value for peak in peaks],
        "drive": [1.0] * len(peaks),
        "readout": [1.0] * len(peaks),
    }
    units = {
        "quality_factor": "1",
        "drive": "1" if request.pattern else "N",
        "readout": f"{unit}/m" if unit != "m" else "1",
        "material_time": "s",
        "offset": "Hz",
    }
    for name, each in request.beside.items():
        if name not in begin:
            sought.append(Parameter(name, "", fixed.pop(name), units[name], logarithm=False))
            continue
        values = begin[name]
        if each:
            sought += [Parameter(name, m, v, units[name]) for m, v in zip(label, values)]
        else:
            sought.append(Parameter(name, "", float(np.median(values)), units[name]))
        fixed = {k: v for k, v in fixed.items() if k.partition(".")[0] != name}
    return Parameters(
        scene=scene,
        label=tuple(label),
        unknowns=request.film,
        sought=tuple(sought),
        fixed=fixed,
        known=Known(request.pattern, None),
        reduce=_reducer(),
    )


def _fit(
    parameters: Parameters, measured: MeasuredResponse, peaks: Sequence[Peak], request: Request
) -> DeviceFit:
    """The rows of every peak, with the noise that its own fit has left."""
    parts, ranges, noise = [], [], []
    for place, peak in enumerate(peaks):
        rows = np.concatenate([trace.frequency for trace in peak.traces])
        ranges.append((float(rows.min()), float(rows.max())))
        size = max(float(trace.amplitude.max()) for trace in peak.traces)
        noise.append((peak.noise * size, 0.0))
        parts += [Measured(trace, request.levels[trace.level], place) for trace in peak.traces]
    return DeviceFit(parameters, parts, ranges, noise)


def _with_nonlinear_damping(
    fit: DeviceFit, found: Evaluation
) -> tuple[DeviceFit, Evaluation, tuple[Choice, ...]]:
    """The fit with a viscous film if the data are likelier so (Schwarz' criterion)."""
    name = "material_time"
    if any(parameter.name == name for parameter in fit.parameters.sought):
        return fit, found, ()
    more = attrs.evolve(
        fit, parameters=fit.parameters.with_(Parameter(name, "", 0.0, "s", logarithm=False))
    )
    start = np.append(found.x, fit.parameters.fixed[name])
    tried = more.evaluate(start, fit)
    step = more.step(tried)
    if step[-1] <= 0 or more.promised(tried) < np.log(fit.rows):
        return fit, found, ()
    end = more.descend(start + step, rounds=1)
    difference = more.evidence(end) - fit.evidence(found)
    better = difference < 0 and end.x[-1] > 0
    choices = (
        Choice("linear damping", 0.0 if not better else -difference, not better),
        Choice("nonlinear damping", difference if not better else 0.0, better),
    )
    return (more, end, choices) if better else (fit, found, choices)


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
