"""Which modes the peaks are, and the parameters of the device where the search begins."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from nanorom.errors import AmbiguityWarning, SceneError
from nanorom.measurement.assignment import assign
from nanorom.measurement.data import Resonances
from nanorom.measurement.device.fit import DeviceFit, Measured
from nanorom.measurement.device.parameters import Known, Parameter, Parameters
from nanorom.measurement.device.request import Request
from nanorom.measurement.sweeps.peaks import Peak
from nanorom.measurement.unknowns import Film
from nanorom.rom.names import plain
from nanorom.scene.excitation import Damping
from nanorom.scene.scene import Scene
from nanorom.types import Array

if TYPE_CHECKING:
    from nanorom.fem.sensitivity.model import ModelSlopes

COARSE = 0.05  # relative: how far a mode's frequency in the scene may be from the measured one


@attrs.frozen(eq=False)
class Begin:
    """A scene's modes beside the peaks of its sweeps.

    scene; label, number, frequency: (n,) of all its modes, Hz; index: (L,) of those that are peaks;
    parameters: where the search begins.
    """

    scene: Scene
    label: tuple[str, ...]
    number: tuple[int, ...]
    frequency: Array
    index: tuple[int, ...]
    parameters: Parameters

    @classmethod
    def of(
        cls,
        scene: Scene,
        peaks: Sequence[Peak],
        request: Request,
        labels: Sequence[str],
        unit: str,
    ) -> Begin:
        """Of peaks by rising frequency; unit: of their amplitudes.  Raises SceneError."""
        frequency = np.array([peak.frequency.value for peak in peaks])
        known = [plain(label) for label in labels] or [""] * len(peaks)
        if len(known) != len(peaks):
            raise SceneError(
                f"labels: found {len(known)}; allowed: {len(peaks)}, one for each peak"
            )
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
        places = np.log(found.value.frequency)
        # one peak is the lowest mode, if nothing else is said
        shift = np.log(frequency[0]) - places[0] if len(peaks) == 1 and not known[0] else 0.0
        index = assign(np.log(frequency) - shift, known, places, names, COARSE).tolist()
        first = cls(
            scene,
            tuple(names),
            found.number,
            found.value.frequency,
            tuple(index),
            _parameters(scene, index, names, request, peaks, unit),
        )
        return attrs.evolve(first, parameters=first.of_modes(index))

    def of_modes(self, index: Sequence[int]) -> Parameters:
        """The parameters with a scene of some modes alone, and with these labels."""
        damping = self.scene.damping
        if damping is not None:  # each mode's own is kept beside it
            damping = Damping((damping.quality_factor or (1.0,))[:1], damping.material_time)
        kept: dict[str, Any] = {
            "drive": self.scene.drive,
            "sweep": self.scene.sweep,
            "damping": damping,
        }
        scene = self.scene.with_(modes=sorted(self.number[i] for i in index), **kept)
        label = tuple(self.label[i] for i in index)
        return attrs.evolve(self.parameters, scene=scene, label=label)


def fit_of(parameters: Parameters, peaks: Sequence[Peak], request: Request) -> DeviceFit:
    """The rows of every peak, with the noise that its own fit has left."""
    parts: list[Measured] = []
    ranges, noise = [], []
    for place, peak in enumerate(peaks):
        rows = np.concatenate([trace.frequency for trace in peak.traces])
        ranges.append((float(rows.min()), float(rows.max())))
        size = max(float(trace.amplitude.max()) for trace in peak.traces)
        noise.append((peak.noise * size, 0.0))
        parts += [Measured(trace, request.levels[trace.level], place) for trace in peak.traces]
    if "phase" not in request.beside:  # in some of the traces alone
        parts = [attrs.evolve(p, trace=attrs.evolve(p.trace, phase=None)) for p in parts]
    return DeviceFit(parameters, parts, ranges, noise, [(size, 0.0) for size, _ in noise])


def _reducer() -> Callable[[Scene, Sequence[str]], ModelSlopes]:
    from nanorom.launch import finite_elements

    with finite_elements():
        from nanorom.fem.sensitivity.near import slopes_of
    return slopes_of


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
    scene: Scene,
    index: Sequence[int],
    names: Sequence[str],
    request: Request,
    peaks: Sequence[Peak],
    unit: str,
) -> Parameters:
    """All parameters where the search begins, before the peaks have told more."""
    film, label = Film.of(scene), [names[i] for i in index]
    sought = [Parameter(u.name, "", u.of(film), u.unit) for u in request.film]
    quality = scene.damping.per_mode(len(names)) if scene.damping else (np.nan,) * len(names)
    fixed = {f"quality_factor.{name}": value for name, value in zip(names, quality)}
    fixed |= {"material_time": film.material_time, "drive": 1.0, "readout": 1.0}
    fixed |= {"offset": 0.0, "phase": 0.0}
    begin = {
        "quality_factor": [peak.quality_factor.value for peak in peaks],
        "drive": [1.0] * len(peaks),
        "readout": [1.0] * len(peaks),
        "phase": [0.0] * len(peaks),
    }
    units = {
        "quality_factor": "1",
        "drive": "1" if request.pattern else "N",
        "readout": f"{unit.partition(',')[0]}/m" if unit != "m" else "1",
        "material_time": "s",
        "offset": "Hz",
        "phase": "rad",
    }
    for name, each in request.beside.items():
        if name not in begin:
            sought.append(Parameter(name, "", fixed.pop(name), units[name], logarithm=False))
            continue
        values = begin[name]
        if each:
            own = zip(label, values)
            sought += [Parameter(name, m, v, units[name], name != "phase") for m, v in own]
        else:
            value = float(np.median(values))
            sought.append(Parameter(name, "", value, units[name], name != "phase"))
        fixed = {k: v for k, v in fixed.items() if k.partition(".")[0] != name}
    return Parameters(
        scene=scene,
        label=tuple(label),
        unknowns=request.film,
        sought=tuple(sought),
        fixed=fixed,
        known=Known(request.pattern),
        reduce=_reducer(),
    )
