"""Modal forces of the drive patterns of a model: those that it was reduced with, and others.

J_r is the virtual work on mode r per unit of the level.  The reduction computes it from the modes'
own polynomials: for every pattern that needs no aim, and for the drive of its scene.  For any other
aim it is taken from the shapes that the model keeps, linear on their fine triangles, right to about
1e-3.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from functools import singledispatch
from typing import TYPE_CHECKING

import attrs
import numpy as np

from nanorom.errors import AccuracyWarning, ModelError, SceneError
from nanorom.rom.model import ReducedModel
from nanorom.rom.shapes import Shapes
from nanorom.scene import fields as v
from nanorom.scene.drive import Drive
from nanorom.scene.patterns import DIRECT, PARAMETRIC
from nanorom.scene.patterns.pattern import (
    Areal,
    Concentrated,
    DirectPattern,
    ParametricPattern,
    Proportional,
    Stretch,
    Uniform,
)
from nanorom.types import Array

if TYPE_CHECKING:
    from nanorom.continuation import ModalSystem

# -- what every reduction computes ----------------------------------------------------------------


def unaimed(area: Array, slope: Array) -> tuple[dict[str, Array], dict[str, Array]]:
    """The direct patterns (L,) and the parametric ones (L, L) that need no aim, by name.

    area: (L,) in m^2, int phi dA; slope: (L, L), int grad phi . grad phi dA.
    """
    direct = {name: area for name, kind in DIRECT.items() if issubclass(kind, Uniform)}
    parametric = {name: stiffness(kind(), area, slope) for name, kind in PARAMETRIC.items()}
    return direct, parametric


@singledispatch
def stiffness(pattern: ParametricPattern, area: Array, slope: Array) -> Array:
    """P (L, L) in N/m per unit of the level, beside a uniform pressure; see `unaimed`."""
    raise TypeError(f"no parametric pattern: {pattern!r}")


@stiffness.register
def _(pattern: Stretch, area: Array, slope: Array) -> Array:
    return -slope


@stiffness.register
def _(pattern: Proportional, area: Array, slope: Array) -> Array:
    return np.diag(area)


# -- from the drawn shapes ------------------------------------------------------------------------


@singledispatch
def force(pattern: DirectPattern, shapes: Shapes) -> Array:
    """J (L,) in N per unit of the level, from drawn shapes; SceneError for a place beside them."""
    raise TypeError(f"no direct pattern: {pattern!r}")


@force.register
def _(pattern: Uniform, shapes: Shapes) -> Array:
    return _integral(shapes, shapes.values)


@force.register
def _(pattern: Areal, shapes: Shapes) -> Array:
    return _integral(shapes, shapes.values * pattern.density(shapes.points[:, :2]))


@force.register
def _(pattern: Concentrated, shapes: Shapes) -> Array:
    return point(shapes, pattern.position)


def _integral(shapes: Shapes, values: Array) -> Array:
    """Integral (L,) over the film of values (L, P) at its points."""
    corners = shapes.points[shapes.cells, :2]
    (x1, y1), (x2, y2) = (corners[:, i].T - corners[:, 0].T for i in (1, 2))
    area = 0.5 * np.abs(x1 * y2 - x2 * y1)
    return np.asarray(values[:, shapes.cells].mean(axis=2) @ area)


def point(shapes: Shapes, position: Sequence[float]) -> Array:
    """J (L,) of a force at a position (x, y) in m: phi_r there.  Raises SceneError outside."""
    try:
        return shapes.at(position)
    except ModelError as error:
        raise SceneError(f"drive.{error}") from None


def driven(model: ReducedModel, drive: Drive, damped: bool = True) -> ModalSystem:
    """The modal equations under a drive of a scene, aimed before, with its harmonics."""
    from nanorom.continuation import Drive as Term

    system = model.system(drive.direct_pattern, drive.parametric_pattern, damped)
    if drive.harmonics is None:
        return system
    terms = [
        Term(
            each.harmonic,
            each.phase,
            direct=each.direct * system.direct,
            parametric=each.parametric * system.parametric,
        )
        for each in drive.harmonics
    ]
    return attrs.evolve(
        system,
        direct=np.zeros_like(system.direct),
        parametric=np.zeros_like(system.parametric),
        drives=terms,
        damped=damped,
    )


def aimed(model: ReducedModel, drive: Drive) -> ReducedModel:
    """The model with the drive's direct pattern; raises ModelError if it has no shapes.

    Warns with AccuracyWarning where the pattern has to be taken from the drawn shapes.
    """
    pattern = drive.pattern
    if not pattern.keys() or _made_for(model, pattern):
        return model
    if model.shapes is None:
        raise ModelError("drive.position: the model has no mode shapes to aim at")
    found = force(pattern, model.shapes)
    warnings.warn(
        "drive.position: the model was not reduced with this aim; its modal forces are taken from "
        "the drawn shapes, right to about 1e-3",
        AccuracyWarning,
        stacklevel=3,
    )
    return attrs.evolve(model, drive=model.drive | {pattern.name: found})


def _made_for(model: ReducedModel, pattern: DirectPattern) -> bool:
    """Whether the reduction computed this pattern: its scene's drive has the same aim."""
    own = v.parse_toml(model.scene).get("drive", {})
    return pattern.name in model.drive and Drive(**own).pattern == pattern
