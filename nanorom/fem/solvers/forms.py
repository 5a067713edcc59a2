"""Forms that are written and looked up once in a process, whatever the mesh.

To write a form in UFL and to find what was compiled for it takes longer than to assemble it on a
small mesh.  Forms of one kind have one kernel; what differs from mesh to mesh is only what they are
about: spaces, functions, constants and tagged facets, in places that the first form shows.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from typing import Any

import attrs
from mpi4py import MPI

from nanorom.fem.solvers import compat


@attrs.frozen(eq=False)
class Operands:
    """What forms on one mesh are about; tags are those of its exterior facets."""

    spaces: Sequence[Any]
    functions: Sequence[Any]
    constants: Sequence[Any]
    tags: Any


@attrs.frozen(eq=False)
class _Known:
    """A kernel, and the places of its spaces, functions and constants among operands."""

    kernel: compat.Kernel
    places: tuple[list[int], list[int], list[int]]

    def form(self, about: Operands) -> Any:
        """The form about operands."""
        spaces, functions, constants = self.places
        return self.kernel.bound(
            [about.spaces[i] for i in spaces],
            [about.functions[i] for i in functions],
            [about.constants[i] for i in constants],
            about.tags,
        )


_known: dict[Hashable, _Known] = {}


def compiled(kind: Hashable, write: Callable[[], Any], about: Operands) -> Any:
    """Form of a kind about operands, ready to be assembled; only the first is written.

    All forms of a kind are the same but for their operands.  Collective.
    """
    found = _known.get(kind)
    if about.spaces[0].mesh.comm.allreduce(found is not None, op=MPI.LAND):
        assert found is not None
        return found.form(about)
    expression = write()
    form = compat.form(expression)
    spaces, functions, constants = compat.operands(expression, form)
    places = (
        _places(spaces, about.spaces),
        _places(functions, about.functions),
        _places(constants, about.constants),
    )
    _known[kind] = _Known(compat.Kernel.of(expression, form), places)
    return form


def _places(some: Sequence[Any], among: Sequence[Any]) -> list[int]:
    """Numbers of objects among others, which all of them must be."""
    numbers = {id(one): i for i, one in enumerate(among)}
    return [numbers[id(one)] for one in some]
