"""Modal forces of the drive patterns of a model: those that it was reduced with, and others.

J_r is the virtual work on mode r per unit of the level.  The reduction computes it from the modes'
own polynomials: for every pattern that needs no aim, and for the drive of its scene.  For any other
aim it is taken from the shapes that the model keeps, linear on their fine triangles, right to about
1e-3.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, TypeVar

import attrs
import numpy as np

from nanorom.errors import AccuracyWarning, ModelError, SceneError
from nanorom.rom.heat import heated
from nanorom.rom.model import ReducedModel
from nanorom.rom.shapes import Shapes
from nanorom.scene import fields as v
from nanorom.scene.drive import Drive
from nanorom.scene.load import Load
from nanorom.scene.patterns import DIRECT, PARAMETRIC
from nanorom.scene.patterns.gate import GateForce
from nanorom.scene.patterns.pattern import NO_GATE, Absent, Areal, Pattern, VirtualWork
from nanorom.types import Array

if TYPE_CHECKING:
    from nanorom.continuation import Drive as Term
    from nanorom.continuation import FirstOrder, ModalSystem

AnyPattern = TypeVar("AnyPattern", bound=Pattern)


class ModalWork(VirtualWork[Array, Array]):
    """Virtual work on L modes: a force is J (L,) in N, an operator P (L, L) in N/m."""

    def proportional(self, force: Array) -> Array:
        """P (L, L) in N/m of a force (L,) in N on each mode that its amplitude multiplies."""
        return np.diag(force)


@attrs.frozen(eq=False)
class DrawnWork(ModalWork):
    """Virtual work on drawn shapes, linear on their triangles, unless it is known better.

    area: (L,) in m^2, int phi dA; slope: (L, L), int grad phi . grad phi dA; momentum: (L,) in kg,
    int m phi dA.
    """

    shapes: Shapes
    area: Array | None = None
    slope: Array | None = None
    momentum: Array | None = None

    def uniform(self, pressure: float = 1.0) -> Array:
        """J (L,) in N of a pressure in Pa."""
        known = self._integral(self.shapes.values) if self.area is None else self.area
        return pressure * known

    def areal(self, pattern: Areal) -> Array:
        """J (L,) in N of a force per area at level 1."""
        density = pattern.density(self.shapes.points[:, :2])
        pattern.check_meets(float(self._integral(density[None])[0]))
        return self._integral(self.shapes.values * density)

    def points(self, places: Array, weights: Array, key: str) -> Array:
        """J (L,) in N of forces (n,) at places (n, 2) in m; raises SceneError off the film."""
        try:
            values = [self.shapes.at((x, y)) for x, y in places.tolist()]
        except ModelError as error:
            raise SceneError(f"{key}: it is not on the film") from error
        return np.asarray(weights @ np.array(values))

    def inertia(self, acceleration: float = 1.0) -> Array:
        """J (L,) in N of the frame's acceleration in m/s^2; raises Absent if no mass is known."""
        if self.momentum is None:
            return super().inertia()
        return -acceleration * self.momentum

    def stretch(self, tension: float = 1.0) -> Array:
        """P (L, L) in N/m of a change of tension in N/m."""
        return -tension * (self._slope() if self.slope is None else self.slope)

    def _integral(self, values: Array) -> Array:
        """Integral (L,) over the film of values (L, P) at its points."""
        return np.asarray(values[:, self.shapes.cells].mean(axis=2) @ self._sides()[1])

    def _slope(self) -> Array:
        """int grad phi . grad phi dA (L, L), by the constant slopes of each triangle."""
        sides, area = self._sides()
        corners = self.shapes.values[:, self.shapes.cells]
        rises = np.moveaxis(corners[..., 1:] - corners[..., :1], 0, -1)  # (C, 2, L)
        slopes = np.linalg.solve(sides, rises)
        return np.asarray(np.einsum("c,cdr,cds->rs", area, slopes, slopes, optimize=True))

    def _sides(self) -> tuple[Array, Array]:
        """Two sides (C, 2, 2) of each triangle in m, and its area (C,) in m^2."""
        corners = self.shapes.points[self.shapes.cells, :2]
        sides = corners[:, 1:] - corners[:, :1]
        (x1, y1), (x2, y2) = (sides[:, i].T for i in (0, 1))
        return sides, 0.5 * np.abs(x1 * y2 - x2 * y1)


def reduced(work: ModalWork, drive: Drive | None) -> tuple[dict[str, Array], dict[str, Array]]:
    """The direct patterns (L,) in N and the parametric ones (L, L) in N/m of a model, by name.

    Those that need no key, the parametric ones beside the first direct one, and those of the
    drive.  Raises SceneError for a place beside the film.  Collective where the work is.
    """
    direct = _present(DIRECT, lambda one: one.force(work))
    usual = next(iter(direct.values()))
    parametric = _present(PARAMETRIC, lambda one: one.stiffness(work, usual))
    if drive is not None and drive.pattern.aimed():
        direct[drive.direct_pattern] = drive.pattern.force(work)
    if drive is not None and drive.modulation.aimed():
        force = direct[drive.direct_pattern]
        parametric[drive.parametric_pattern] = drive.modulation.stiffness(work, force)
    return direct, parametric


def _present(
    kinds: Mapping[str, type[AnyPattern]], made: Callable[[AnyPattern], Array]
) -> dict[str, Array]:
    """What is made of those patterns that need no key and that the film has."""
    found = {}
    for name, kind in kinds.items():
        if not kind.needs():
            with suppress(Absent):  # who drives by it is told then
                found[name] = made(kind())
    return found


def driven(model: ReducedModel, drive: Drive, damped: bool = True) -> ModalSystem:
    """The modal equations under a drive of a scene, aimed before, with its harmonics.

    Raises ModelError for a gate or a laser that the model was not reduced with.
    """
    if drive.voltage is not None and GateForce.name not in model.drive:
        raise ModelError(NO_GATE)
    if drive.laser is not None:
        model = _warmed(model, drive)
    system = model.system(drive.direct_pattern, drive.parametric_pattern, damped)
    terms = _terms(model, drive, system.direct, system.parametric)
    if terms is None:
        return system
    return attrs.evolve(
        system,
        direct=np.zeros_like(system.direct),
        parametric=np.zeros_like(system.parametric),
        drives=terms,
        states=_states(model, drive) if drive.laser is not None else None,
        damped=damped,
    )


def _terms(model: ReducedModel, drive: Drive, j: Array, p: Array) -> list[Term] | None:
    """Harmonics of a drive of patterns J (L,) and P (L, L); None for cos(omega t) alone."""
    from nanorom.continuation import Drive as Term

    if drive.voltage is not None:
        # half of (V + v cos)^2 - V^2, by powers of the level v
        load = v.from_table(Load, "load", v.parse_toml(model.scene).get("load"))
        constant = load.electrodes[drive.electrode - 1].voltage
        return [
            Term(k, direct=factor * j, parametric=factor * p, power=power)
            for k, factor, power in ((0, 0.25, 2), (1, constant, 1), (2, 0.25, 2))
        ]
    if drive.laser is not None:
        assert model.heat is not None
        return [Term(1, direct=j, states=model.heat.feed)]
    if drive.harmonics is None:
        return None
    return [
        Term(each.harmonic, each.phase, direct=each.direct * j, parametric=each.parametric * p)
        for each in drive.harmonics
    ]


def _warmed(model: ReducedModel, drive: Drive) -> ReducedModel:
    """The model about the state that the mean power of a laser makes; raises ModelError."""
    if model.heat is None:
        raise ModelError(
            "drive.laser: the model knows no heat; reduce a scene that has drive.laser"
        )
    given = model.stiffness, model.quadratic, model.cubic_of(), model.heat
    stiffness, quadratic = heated(*given, float(drive.power))
    return attrs.evolve(model, stiffness=stiffness, quadratic=quadratic)


def _states(model: ReducedModel, drive: Drive) -> FirstOrder:
    """Heat as states, fed by the motion in a cavity; raises ModelError if that is not known."""
    from nanorom.continuation import FirstOrder

    heat = model.heat
    assert heat is not None
    fed = {}
    if drive.cavity is not None:
        if heat.feed_by_mode is None or heat.feed_by_pair is None:
            raise ModelError(
                "drive.cavity: the model does not know what its modes do to the light; reduce its "
                "scene again"
            )
        slope, curvature = (float(drive.power) * slope for slope in drive.cavity.slopes)
        fed = {
            "displacement": slope * heat.feed_by_mode,
            "squares": curvature / 2 * heat.feed_by_pair,
        }
    return FirstOrder(heat.rate, force=heat.force, stiffness=heat.stiffness, **fed)


def aimed(model: ReducedModel, drive: Drive) -> ReducedModel:
    """The model with the drive's patterns; raises ModelError if it has no shapes to aim at.

    Warns with AccuracyWarning where a pattern has to be taken from the drawn shapes.
    """
    missing = _not_made_for(model, drive)
    if not missing:
        return model
    key = f"drive.{missing[0].keys()[0]}"
    if drive.laser is not None:
        raise ModelError(
            f"{key}: the model was reduced without this laser; reduce a scene with its position, "
            "radius, power and absorption"
        )
    if drive.voltage is not None:
        if GateForce.name not in model.drive:
            raise ModelError(NO_GATE)
        raise ModelError(
            f"drive.gate: found {drive.electrode}, but the model was reduced with another one's "
            "force; reduce a scene with this drive.gate"
        )
    if model.shapes is None:
        raise ModelError(f"{key}: the model has no mode shapes to aim at")
    work = DrawnWork(model.shapes)
    direct, parametric = dict(model.drive), dict(model.parametric)
    if drive.pattern in missing:
        direct[drive.direct_pattern] = drive.pattern.force(work)
    if drive.modulation in missing:
        force = direct[drive.direct_pattern]
        parametric[drive.parametric_pattern] = drive.modulation.stiffness(work, force)
    warnings.warn(
        f"{key}: the model was not reduced with this aim; its modal forces are taken from "
        "the drawn shapes, right to about 1e-3",
        AccuracyWarning,
        stacklevel=3,
    )
    return attrs.evolve(model, drive=direct, parametric=parametric)


def _not_made_for(model: ReducedModel, drive: Drive) -> list[Pattern]:
    """Aimed patterns that the reduction did not compute: its scene's drive has another aim."""
    asked = [each for each in (drive.pattern, drive.modulation) if each.aimed()]
    if not asked:
        return []
    own = v.parse_toml(model.scene).get("drive")
    made = Drive(**own) if own else None
    known = {**model.drive, **model.parametric}
    computed = [made.pattern, made.modulation] if made else []
    names = [each.name for each in computed]
    kinds = (*DIRECT.values(), *PARAMETRIC.values())
    computed += [kind() for kind in kinds if kind.name not in names and not kind.needs()]
    return [each for each in asked if each.name not in known or each not in computed]
