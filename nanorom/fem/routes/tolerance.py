"""The loop that meets a tolerance: solve, estimate, refine."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Protocol, TypeVar

import attrs
import numpy as np
from petsc4py import PETSc

from nanorom.errors import AccuracyWarning, NanoromError
from nanorom.scene.geometry import MeshFile
from nanorom.scene.scene import Scene


class Attempt(Protocol):
    """A solution on one mesh: its estimated error, the part of it that no mesh makes less, and that
    which modes of nearly one frequency cause.
    """

    @property
    def error(self) -> float: ...

    @property
    def rounding(self) -> float: ...

    @property
    def mixing(self) -> float: ...


Solved = TypeVar("Solved", bound=Attempt)

LEAST_AIM = 1e-14  # a hundred roundings: no mesh is made for less
APART = 0.1  # of the tensor: what modes mix by that are told apart


@attrs.frozen
class Refinement:
    """How meshes follow one another.

    most : attempts; finer : the aim of the next is lower by that at least; told : what is wrong.
    """

    most: int
    finer: float
    told: str


def solved_to_tolerance(
    scene: Scene,
    solve: Callable[[float | None], Solved],
    how: Refinement,
    discard: Callable[[Solved], None] = lambda _: None,
    same: Callable[[Solved, float], bool] = lambda *_: False,
) -> Solved:
    """A solution that meets the scene's tolerance, on as many meshes as it takes. Collective.

    Where none does, the best: it is told with AccuracyWarning, also if a refinement breaks off.
    ``solve`` takes the error that its mesh is made for; ``discard`` frees what a solution holds
    beyond its results, before the next; ``same`` tells whether another error is that of a mesh
    which a solution has been found on.  Raises what the first attempt raises.
    """
    tolerance = aim = scene.accuracy.tolerance
    if tolerance is None or aim is None:
        return solve(None)
    best, broken, slow = solve(aim), "", False
    last = best
    for _ in range(how.most - 1):
        if last.error <= tolerance:
            return last
        if last.rounding > tolerance / 2 or not can_refine(scene):
            break
        finest = aim <= LEAST_AIM
        aim = power_below(aim * min(how.finer, tolerance / last.error))
        while aim > LEAST_AIM and same(last, aim):
            aim = power_below(aim * how.finer)
        if tolerance / 2 < last.mixing < APART and not finest:
            aim = max(aim, LEAST_AIM)  # modes that a mesh tells apart, a finer one tells better
        slow = aim < LEAST_AIM
        if slow:
            break
        discard(last)
        try:
            last = solve(aim)
        except (NanoromError, PETSc.Error) as error:
            broken = f"; a finer mesh failed: {error}"
            break
        best = min(best, last, key=lambda solution: solution.error)
    if best.error > tolerance:
        rounding = f" (of which rounding {best.rounding:.1e})" if best.rounding else ""
        remedy = _remedy(scene, best, tolerance, slow)
        told = f"{how.told} {best.error:.1e}{rounding}{broken}; {remedy}"
        warnings.warn(
            f"tolerance {tolerance:g} is not met: {told}",
            AccuracyWarning,
            stacklevel=2,
        )
    return best


def _remedy(scene: Scene, best: Attempt, tolerance: float, slow: bool) -> str:
    """What to do about a tolerance that is not met."""
    met = f"accuracy.tolerance = {_rounded_up(best.error):g} is met"
    if best.mixing > tolerance / 2:
        return (
            "modes whose frequencies differ by less than their errors (an exact pair?) may be any "
            "combinations of each other, and so may their entries of the tensor, which together "
            f"are right to {best.error - best.mixing:.1e}; ask for none of them, or for a tension "
            "that separates them"
        )
    if slow:
        return (
            "finer meshes hardly make it smaller, as where the film's strain is infinite at a sharp"
            f" re-entrant corner: round such corners; {met}"
        )
    if best.rounding > tolerance / 2:
        return f"no mesh has more digits; {met}"
    if not can_refine(scene):
        return f"give a finer mesh, or its .geo file, which is refined as far as it takes; {met}"
    return f"{met}, or ask for fewer modes"


def _rounded_up(value: float) -> float:
    """To one digit."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(np.ceil(value / power) * power)


def power_below(value: float) -> float:
    """The next power of two: the same for estimates that differ in rounding, as of other ranks."""
    return float(2.0 ** np.floor(np.log2(value)))


def can_refine(scene: Scene) -> bool:
    """Whether a finer mesh can be made: not from a mesh that is given as such."""
    geometry = scene.geometry
    return not (isinstance(geometry, MeshFile) and geometry.file.suffix == ".msh")
