"""Special points of a scene's response by names such as LP1, and their derivatives.

LP1 is the first fold by frequency at the last drive level, LP1@2 that at the second level, and
LP1.f01 the amplitude of a mode there.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from nanorom.continuation import ModalSystem, PointSlope, SpecialPoint, point_slopes
from nanorom.continuation.orbits.bifurcations import KINDS
from nanorom.errors import ModelError, SceneError
from nanorom.results.near import Named, Near, difference
from nanorom.results.question import Question
from nanorom.results.respond import respond
from nanorom.results.response import Response
from nanorom.rom.names import index_of
from nanorom.scene.scene import Scene
from nanorom.types import Array, Progress

_NAME = re.compile(rf"({'|'.join(KINDS)})(\d+)(?:@(\d+))?(?:\.(.+))?")


@attrs.frozen
class Name:
    """What a name says: kind, place from 1, level from 1 and a mode, or neither."""

    whole: str
    kind: str
    place: int
    level: int
    mode: str

    @classmethod
    def read(cls, name: str, scene: Scene) -> Name:
        """Of a scene's response; raises ModelError."""
        match = _NAME.fullmatch(name)
        assert match is not None and scene.drive is not None
        kind, place, level, mode = match.groups()
        levels = len(scene.drive.levels)
        if int(place) < 1 or not 1 <= int(level or levels) <= levels:
            raise ModelError(f"of: found {name!r}; allowed: points from 1, levels 1 to {levels}")
        return cls(name, kind, int(place), int(level or levels), mode or "")

    def point(self, response: Response) -> SpecialPoint:
        """The point of a response; raises ModelError if it has none of that name."""
        found = response.diagrams[self.level - 1].points(self.kind)
        if len(found) < self.place:
            raise ModelError(
                f"of: found {self.whole!r}; the response has {len(found)} points {self.kind} at "
                f"level {self.level}"
            )
        return sorted(found, key=lambda point: point.omega)[self.place - 1]


def is_name(name: str) -> bool:
    """Whether a name is that of a special point."""
    return _NAME.fullmatch(name) is not None


def check(scene: Scene) -> None:
    """Raise SceneError for a scene that has no special points."""
    if scene.drive is None or scene.sweep is None or scene.damping is None:
        raise SceneError("damping, drive, sweep: missing, whose special points are asked for")


def _check_exact(scene: Scene) -> None:
    """Raise SceneError for a scene whose special points have no exact derivatives."""
    if scene.lossy or scene.damping is not None and scene.damping.material_time:
        raise SceneError(
            "damping: special points have derivatives with quality_factor alone; found losses of "
            "the material"
        )


def derived(names: Sequence[str], near: Near, progress: Progress | None = None) -> dict[str, Named]:
    """Special points of a scene's response by name, with their derivatives along lines of models.

    near: the scene's model with these.  Raises SceneError, ModelError, ContinuationError.
    """
    scene, model, label = near.scene, near.model, near.model.label
    check(scene)
    if near.exact:
        _check_exact(scene)
    drive, sweep = scene.drive, scene.sweep
    assert drive is not None and sweep is not None
    read = [Name.read(name, scene) for name in names]
    for each in read:
        if each.mode and index_of(label, each.mode) is None:
            raise ModelError(f"of: found {each.whole!r}; allowed modes: {', '.join(label)}")
    question = Question(drive, sweep, scene.damping)

    response = respond(model, drive, sweep, scene.damping, progress)
    system = question.of(model)[0]
    by_line = [_slope_of(lambda s, line=line: question.of(line(s))[0]) for line in near.lines]
    found, known = {}, dict[tuple[str, int, int], list[PointSlope]]()
    for each in read:
        point, level = each.point(response), drive.levels[each.level - 1]
        place = each.kind, each.place, each.level
        if place not in known:
            acting = [_at(level, arrays) for arrays in by_line]
            known[place] = point_slopes(system, point, *level, acting)
        found[each.whole] = _named(each, point, known[place], list(label))
    return found


def _named(name: Name, point: SpecialPoint, slopes: list[PointSlope], label: list[str]) -> Named:
    if not name.mode:
        by = tuple(slope.omega / (2 * np.pi) for slope in slopes)
        return Named(point.omega / (2 * np.pi), "Hz", by)
    mode = index_of(label, name.mode)
    assert mode is not None
    return Named(float(point.amplitude[mode]), "m", tuple(float(s.amplitude[mode]) for s in slopes))


def _slope_of(system: Any) -> dict[str, Array]:
    """d arrays / d ln(key) of the equations: differences of explicit functions."""
    names = tuple(_arrays(system(0.0)))
    found = difference(lambda s: np.concatenate([a.ravel() for a in _arrays(system(s)).values()]))
    shapes = [array.shape for array in _arrays(system(0.0)).values()]
    ends = np.cumsum([int(np.prod(shape)) for shape in shapes])[:-1]
    parts = np.split(found, ends)
    return {name: part.reshape(shape) for name, part, shape in zip(names, parts, shapes)}


def _arrays(system: ModalSystem) -> dict[str, Array]:
    system.check_proportional()
    return system.arrays()


def _at(level: tuple[float, float], arrays: Mapping[str, Array]) -> dict[str, Array]:
    """The arrays with the forces that act at a level."""
    factors = dict(zip(("direct", "parametric"), level))
    return {name: factors.get(name, 1.0) * array for name, array in arrays.items()}
