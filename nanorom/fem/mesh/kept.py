"""Meshes that are kept for the films to come: many devices of a study have one.

A process that reduces one scene says nothing and keeps nothing; what is kept is of one rank.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

MOST = 16  # meshes, the last ones used, with what was made on them
MOST_CELLS = 200  # of such a mesh: on larger ones solutions take the time, and factors the memory

Found = TypeVar("Found")
Made = dict[Hashable, Any]  # what was made on a mesh, by what it is

_meshes: OrderedDict[Hashable, Any] = OrderedDict()
_more = False


@contextmanager
def for_more() -> Iterator[None]:
    """Within it meshes are kept, also for the next time."""
    global _more
    before, _more = _more, True
    try:
        yield
    finally:
        _more = before


def found(what: Hashable, make: Callable[[Made | None], Found]) -> Found:
    """A mesh by what it is, made with room for what is made on it, or without if none is kept."""
    if not _more:
        return make(None)
    if what not in _meshes:
        _meshes[what] = make({})
    _meshes.move_to_end(what)
    while len(_meshes) > MOST:
        _meshes.popitem(last=False)
    mesh: Found = _meshes[what]
    return mesh
