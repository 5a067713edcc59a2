"""More modes than a model has: to choose its modes among, and to say what those left out make.

The film is meshed for them anew, more coarsely than for the model itself: a per mille of what is
left out says enough.  Where the film cannot have as many (its plane does not follow modes as high,
or no mesh will do), it is as many as it can have: those first whose symmetry is the model's, since
others move by themselves only, where they grow.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING

import attrs
import numpy as np

from nanorom.errors import AccuracyWarning, SlowPlaneError, SolverError
from nanorom.fem.reduce import reduce_scene
from nanorom.fem.solvers.groups import shared, together
from nanorom.results.question import Question
from nanorom.rom.larger import Larger, extended
from nanorom.rom.model import ReducedModel
from nanorom.scene.excitation import Frequency, Sweep
from nanorom.scene.request import FIRST, MOST_MODES, Accuracy, Modes
from nanorom.scene.scene import Scene
from nanorom.types import Progress
from nanorom.verification.symmetry import Classes

if TYPE_CHECKING:
    from nanorom.results.choice import Choice, Search

RESPONSE = 1e-3  # accuracy.response of modes that are chosen, if it is left out
MESH = 1e-3  # tolerance of the larger model
MOST, WIDER = 60, 1.6  # modes that are looked at, and by how much more each time
LEAST_MORE, MOST_MORE = 8, 12  # modes beyond those of a model that is given
FEWER = 0.5  # of the modes, where there cannot be as many
NEAR = 2e-3  # of a frequency: modes that another mesh may give in another order


def automatic(
    scene: Scene, progress: Progress | None = None, groups: int | None = None
) -> ReducedModel:
    """The model of those modes that the response of a scene needs. Collective.

    Its diagnostics say why each is there (`chosen`) and how wrong the response is estimated to be.
    Warns with AccuracyWarning where accuracy.response is not met; raises what `reduce_scene` does.
    """
    from nanorom.results.choice import Search  # follows responses: other models need not load that

    assert scene.drive is not None and scene.sweep is not None
    tolerance = scene.accuracy.response or RESPONSE
    wide = _most(scene, FIRST, (1,), groups)
    sweep = _in_hertz(scene.sweep, wide)
    question = Question(scene.drive, sweep, None)
    search = Search(wide, question, tolerance, None, progress)
    count = FIRST
    while True:
        choice = _searched(search)
        if not choice.wider or wide.size < count or count >= MOST:
            break
        count = min(MOST, int(WIDER * count))
        wide = _most(scene, count, (1,), groups)
        search = search.within(wide)
    model = _reduced(scene, wide, tuple(choice.why), sweep, progress, groups)
    told = {"chosen": choice.why, "error_response": choice.error, "modes_asked": wide.size}
    if choice.error > tolerance or choice.wider:
        more = f"; modes beyond the lowest {wide.size} may take part" if choice.wider else ""
        warnings.warn(
            f"accuracy.response {tolerance:g} is not met: estimated error {choice.error:.1e}{more}",
            AccuracyWarning,
            stacklevel=3,
        )
    larger = Larger.of(wide).matched(model)
    return attrs.evolve(model, larger=larger, diagnostics=model.diagnostics | told)


def with_larger(scene: Scene, model: ReducedModel, groups: int | None = None) -> ReducedModel:
    """A model with a larger one beside it, where its scene asks for a response. Collective."""
    asked = scene.drive is not None and scene.sweep is not None and scene.damping is not None
    if not (asked or scene.accuracy.response) or not scene.plate.rules.larger:
        return model
    count = scene.modes.highest + int(np.clip(model.size, LEAST_MORE, MOST_MORE))
    try:
        wide = _most(scene, count, scene.modes.numbers, groups)
        return attrs.evolve(model, larger=Larger.of(wide).matched(model))
    except (SolverError, ValueError) as error:  # none beyond the model's own, or others by name
        warnings.warn(
            f"no larger model, so that errors of the response are not estimated: {error}",
            AccuracyWarning,
            stacklevel=3,
        )
        told = {"not_estimated": str(error)}
        return attrs.evolve(model, diagnostics=model.diagnostics | told)


def _most(scene: Scene, count: int, own: Sequence[int], groups: int | None) -> ReducedModel:
    """The model of the lowest ``count`` modes or, if there cannot be as many, of fewer.

    Of modes that are given by number, and more.
    """
    beyond = len(own)
    more = [number for number in range(1, count + 1) if number not in own]
    numbers = sorted([*own, *more[: MOST_MODES - beyond]])
    if len(numbers) == beyond and more:
        raise SolverError(f"no model has more than {MOST_MODES} modes")
    while True:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", AccuracyWarning)
                return reduce_scene(_wide(scene, numbers), groups=groups)
        except SlowPlaneError as error:
            alike = _alike(error, own)
            if len(alike) == len(numbers):
                alike = _fewer(numbers, own)
            numbers = alike
            if len(numbers) <= beyond:
                raise
        except SolverError:
            numbers = _fewer(numbers, own)
            if len(numbers) <= beyond:
                raise


def _alike(error: SlowPlaneError, own: Sequence[int]) -> list[int]:
    """Modes that may move with some by number, by their symmetry: what the plane does is less."""
    classes = error.classes
    even = tuple(0 for _ in classes[own[0]])
    moving = Classes.spanned({even, *(classes[number] for number in own)}).deflections
    return [number for number in classes if classes[number] in moving]


def _fewer(numbers: Sequence[int], own: Sequence[int]) -> list[int]:
    """The lower of the modes beyond some, and these."""
    more = [number for number in numbers if number not in own]
    return sorted([*own, *more[: int(FEWER * len(more))]])


def _wide(scene: Scene, numbers: Sequence[int]) -> Scene:
    """A scene for modes by number, on a mesh that does for estimates."""
    accuracy = scene.accuracy
    if accuracy.tolerance is not None:
        accuracy = Accuracy(max(MESH, accuracy.tolerance))
    damping = scene.damping
    if damping is not None and not scene.modes.automatic:
        places = np.searchsorted(numbers, scene.modes.numbers)
        damping = extended(damping, places, len(numbers))
    return scene.with_(
        modes=Modes(select=numbers),
        accuracy=attrs.evolve(accuracy, response=None),
        damping=damping,
        method="direct",
    )


def _searched(search: Search) -> Choice:
    """What a search chooses: one rank looks, all are told."""

    def work(names: Sequence[str]) -> dict[str, Choice]:
        return {name: search.run() for name in names}

    choice = shared(together(), ["modes"], work)["modes"]
    search.why = {search.model.label.index(name): why for name, why in choice.why.items()}
    return choice


def _in_hertz(sweep: Sweep, model: ReducedModel) -> Sweep:
    """A sweep whose range does not depend on which modes a model has."""
    low, high = sweep.hertz(float(model.frequency[0]))
    return attrs.evolve(sweep, start=Frequency(low), stop=Frequency(high))


def _reduced(
    scene: Scene,
    wide: ReducedModel,
    label: tuple[str, ...],
    sweep: Sweep,
    progress: Progress | None,
    groups: int | None,
) -> ReducedModel:
    """The model of some modes by name, to the scene's own tolerance."""
    frequency = wide.frequency
    chosen = np.array([frequency[wide.label.index(name)] for name in label])
    near = np.abs(frequency[:, None] / chosen - 1).min(axis=1) < NEAR
    numbers = wide.number[near].tolist()
    sweep = scene.sweep if numbers[0] == 1 and scene.sweep is not None else sweep
    own = scene.with_(modes=Modes(select=numbers), sweep=sweep)
    model = reduce_scene(own, progress, groups=groups)
    if set(label) < set(model.label):
        kept = [name in label for name in model.label]
        errors = np.asarray(model.diagnostics["error_frequencies"])[kept]
        model = model.select([name for name in model.label if name in label])
        told = model.diagnostics | {"error_frequencies": errors}
        model = attrs.evolve(model, diagnostics=told)
        own = own.with_(modes=Modes(select=model.number.tolist()))
    return attrs.evolve(model, scene=own.to_toml())
