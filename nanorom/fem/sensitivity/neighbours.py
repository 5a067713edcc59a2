"""Reduced models beside that of a scene, for derivatives where there are no exact ones.

Any number of a scene's tables has them: of loads, springs, regions, layers, masses, a file's
parameters.  Meshes are chosen in steps, so that most often neighbours have one, whose error they
share.
"""

from __future__ import annotations

import copy
import warnings
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np
from mpi4py import MPI

from nanorom.errors import SceneError
from nanorom.fem.mesh import kept
from nanorom.fem.reduce import reduce_scene
from nanorom.results.near import APART, PLACES, Neighbours
from nanorom.rom.model import ReducedModel
from nanorom.scene import fields as v
from nanorom.scene.places import amounts, look, put
from nanorom.scene.scene import Scene
from nanorom.scene.units import of_any_dimension
from nanorom.types import Progress

# what a film is made of and held by; the rest of a scene is about what is asked of it
SECTIONS = ("geometry", "plate", "material", "tension", "support", "load", "gas", "mass")
PARTS = ("region", "layer")
PARTNERS = 2  # modes beyond those of the scene, among which one may be that has gone up


def keys_of(scene: Scene, tables: Mapping[str, Any]) -> list[str]:
    """Keys of the numbers of a film that a scene does not leave as they are without it."""
    found = amounts({name: tables[name] for name in (*SECTIONS, *PARTS) if name in tables})
    return [key for key, value in found.items() if value != _usual(scene, key)]


def _usual(scene: Scene, key: str) -> Any:
    """What a key of a scene's section has if it is left out."""
    section, *name = key.split(".")
    fields = attrs.fields_dict(type(getattr(scene, section, None) or scene))
    return fields[name[0]].default if len(name) == 1 and name[0] in fields else None


def neighbours(
    scene: Scene,
    tables: Mapping[str, Any],
    directory: Path,
    by: Sequence[str] | None = None,
    progress: Progress | None = None,
    comm: MPI.Comm = MPI.COMM_WORLD,
) -> Neighbours:
    """The model of a scene and four beside it for each of some keys of its tables. Collective.

    A key of several numbers, such as tension, moves all of them by one factor.  Without keys, all
    that can be moved alone.  Raises SceneError for keys of no number, and what a reduction raises.
    """
    scenes = dict(_beside(scene, tables, directory, by))
    total, done = 1 + len(PLACES) * len(scenes), 0

    def counted() -> None:
        nonlocal done
        if progress is not None:
            progress("neighbours", done, total)
        done += 1

    def reduced(each: Scene) -> ReducedModel:
        counted()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # the scene's own are told
            found = reduce_scene(each, comm=comm)
            if set(found.label) == set(model.label) or not isinstance(scene.modes.count, int):
                return found
            # a pair that the last mode is one of has changed its order
            found = reduce_scene(each.with_(modes=scene.modes.count + PARTNERS), comm=comm)
        return found.select(model.label) if set(model.label) <= set(found.label) else found

    with kept.for_more():
        counted()
        model = reduce_scene(scene, comm=comm)
        beside = {key: [reduced(each) for each in others] for key, others in scenes.items()}
    return Neighbours(scene, model, beside)


def _beside(
    scene: Scene, tables: Mapping[str, Any], directory: Path, by: Sequence[str] | None
) -> Iterator[tuple[str, list[Scene]]]:
    """Keys, and the scenes at `PLACES` of each; without keys, of those that can be moved alone."""
    known = keys_of(scene, tables)
    for key in known if by is None else by:
        numbers = amounts(look(dict(tables), key), key)
        if not numbers:
            hint = v.did_you_mean(key, known)
            raise SceneError(f"by: found {key!r}{hint}; allowed: {', '.join(known)}")
        try:
            yield key, [_moved(tables, directory, numbers, place) for place in PLACES]
        except SceneError:  # such as a ratio that all layers share: not moved alone
            if by is not None:
                raise


def _moved(
    tables: Mapping[str, Any], directory: Path, numbers: Mapping[str, float], place: int
) -> Scene:
    """The scene with some numbers larger by a factor, that of a place; raises SceneError."""
    beside = copy.deepcopy(dict(tables))
    for key, value in numbers.items():
        written = look(beside, key)
        unit = of_any_dimension(written, key)[1] if isinstance(written, str) else ""
        put(beside, key, float(np.exp(APART * place)) * value, unit)
    return Scene.from_dict(beside, directory)
