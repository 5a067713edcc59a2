"""From a first device to the best one near it: sequential quadratic programming (SciPy's SLSQP)."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np
from scipy.optimize import minimize

from nanorom.devices.catalogue import Catalogue, Stopped
from nanorom.devices.derivatives import Derivatives, Line, along
from nanorom.devices.expression import Condition, Expression
from nanorom.devices.wish import Wish
from nanorom.errors import ModelError, NanoromError
from nanorom.types import Array

ACCURACY = 1e-3  # of the precision: change of a scaled objective at which a search ends
WORSE = 10.0  # times the scaled objective: what a device costs that cannot be computed
EXPLICIT = 1e-5  # between the bounds: step of what keys are there


@attrs.frozen(eq=False)
class Device:
    """A device that was computed: places and values of its keys, what is known of it by name."""

    places: Array
    known: dict[str, float]
    units: dict[str, str]
    remark: str
    found: dict[str, Any]


@attrs.frozen(eq=False)
class Task:
    """One search: what is to be small, what must hold, and where it begins.

    limit: of a second objective (times its sign), on a front.
    """

    number: int
    begin: Array
    objective: Expression | None
    sign: float
    limit: tuple[Expression, float, float] | None = None


@attrs.frozen(eq=False)
class Outcome:
    """Where a search ended.

    device: the best that meets the conditions, else the nearest to that; None if there was none;
    violation: relative, the largest; reached: whether the conditions are met; remark: why it ended,
    if not at a best device; inexact: why derivatives were not exact.
    """

    task: Task
    device: Device | None
    violation: float
    remark: str
    inexact: str


class Explorer:
    """Devices of a wish with their derivatives, and the history of all searches; for threads."""

    def __init__(self, wish: Wish, catalogue: Catalogue) -> None:
        self.wish, self.catalogue = wish, catalogue
        self.history: dict[int, list[Device]] = {}
        self._lock = threading.Lock()

    def device(self, places: Array) -> Device:
        """The device at places (p,); raises SceneError, ModelError, Stopped."""
        return self.device_of(self.wish.tables(places), places)

    def device_of(self, tables: dict[str, Any], places: Array) -> Device:
        """The device of tables that are those of places (p,), or near them."""
        found = self.catalogue.at(tables, slopes=True)
        if "failure" in found:
            raise ModelError(found["failure"])
        known = dict(zip(self.wish.names, found["values"]))
        units = dict(zip(self.wish.names, found["units"]))
        for each, value in zip(self.wish.varied, self.wish.setting(places)):
            known[each.key], units[each.key] = float(value), each.unit
        return Device(np.array(places), known, units, found.get("remark", ""), found)

    def slopes(self, device: Device) -> Derivatives:
        """Derivatives by the places, of quantities and of keys."""
        lines = []
        for number, place in enumerate(device.places):
            step = np.eye(len(device.places))[number]
            lines.append(Line(_tables(self.wish, device.places, step), -place, 1.0 - place))
        found = along(lines, device.found, self.wish.names, self.catalogue, self.wish.directory)
        for number, each in enumerate(self.wish.varied):
            low, high = lines[number].around(EXPLICIT)
            ends = device.places[number] + np.array([low, high])
            assert each.quantile is not None
            first, second = each.quantile(ends)
            found.value[each.key] = np.eye(len(lines))[number] * (second - first) / (high - low)
        return found

    def along(self, lines: Sequence[Line], device: Device) -> Derivatives:
        """Derivatives along lines of scenes from a device on."""
        return along(lines, device.found, self.wish.names, self.catalogue, self.wish.directory)

    def noted(self, task: Task, device: Device) -> None:
        """Add a device to the history of a search."""
        with self._lock:
            self.history.setdefault(task.number, []).append(device)

    def violation(self, device: Device, task: Task | None = None) -> float:
        """The largest relative one of all conditions, and of a task's limit."""
        found = [condition.violation(device.known) for condition in self.wish.conditions]
        if task is not None and task.limit is not None:
            expression, sign, limit = task.limit
            found.append(
                max(sign * expression.value(device.known) - limit, 0.0) / (abs(limit) or 1.0)
            )
        return max(found, default=0.0)


def _tables(wish: Wish, places: Array, step: Array) -> Any:
    return lambda place: wish.tables(places + place * step)


class Search:
    """One search, as SciPy sees it: functions of the places, each device computed once."""

    def __init__(self, explorer: Explorer, task: Task) -> None:
        self.explorer, self.task, self.inexact = explorer, task, ""
        self._devices: dict[bytes, Device | None] = {}
        self._slopes: dict[bytes, Derivatives] = {}
        self._last: Device | None = None
        self._first = self._device(task.begin)
        self._size = abs(self._objective(self._first)) or 1.0
        self._sizes = [self._sides(condition) for condition in explorer.wish.conditions]

    def _sides(self, condition: Condition) -> float:
        known = self._first.known
        return max(abs(side.value(known)) for side in condition.expressions) or 1.0

    def _objective(self, device: Device) -> float:
        if self.task.objective is None:
            return 0.0
        return self.task.sign * self.task.objective.value(device.known)

    def _device(self, places: Array) -> Device:
        """At places; the last one that there was where there is none, the first must be."""
        places = np.clip(places, 0.0, 1.0)
        key = places.tobytes()
        if key not in self._devices:
            if len(self._devices) >= self.explorer.wish.settings.evaluations:
                raise Stopped(f"after {len(self._devices)} devices (evaluations)")
            self._devices[key] = None
            try:
                device = self.explorer.device(places)
                self.explorer.violation(device, self.task)
                self._objective(device)
            except NanoromError:
                if self._last is None:
                    raise
            else:
                self._devices[key] = device
                self.explorer.noted(self.task, device)
        self._last = self._devices[key] or self._last
        assert self._last is not None
        return self._last

    def _missing(self, places: Array) -> bool:
        return self._devices[np.clip(places, 0.0, 1.0).tobytes()] is None

    def _derived(self, device: Device) -> Derivatives:
        key = device.places.tobytes()
        if key not in self._slopes:
            self._slopes[key] = self.explorer.slopes(device)
            if not all(self._slopes[key].exact):
                self.inexact = self._slopes[key].why or "differences of devices"
        return self._slopes[key]

    def value(self, places: Array) -> float:
        """The scaled objective."""
        found = self._objective(self._device(places)) / self._size
        return found + WORSE if self._missing(places) else found

    def gradient(self, places: Array) -> Array:
        """Of the scaled objective, (p,)."""
        device = self._device(places)
        if self.task.objective is None:
            return np.zeros(len(places))
        slope = self.task.objective.slope(device.known, self._derived(device).value)
        return self.task.sign * slope / self._size

    def constraints(self) -> list[dict[str, Any]]:
        """Conditions, and the limit, as SciPy has them."""
        found = []
        for condition, size in zip(self.explorer.wish.conditions, self._sizes):
            found.append(self._constraint(condition, size))
        if self.task.limit is not None:
            expression, sign, limit = self.task.limit
            size = abs(limit) or 1.0
            found.append(
                {
                    "type": "ineq",
                    "fun": lambda x: (
                        (limit - sign * expression.value(self._device(x).known)) / size
                    ),
                    "jac": lambda x: -sign * self._slope(expression, x) / size,
                }
            )
        return found

    def _constraint(self, condition: Condition, size: float) -> dict[str, Any]:
        def slope(x: Array) -> Array:
            device = self._device(x)
            return condition.slope(device.known, self._derived(device).value) / size

        return {
            "type": "eq" if condition.relation == "=" else "ineq",
            "fun": lambda x: condition.gap(self._device(x).known) / size,
            "jac": slope,
        }

    def _slope(self, expression: Expression, places: Array) -> Array:
        device = self._device(places)
        return expression.slope(device.known, self._derived(device).value)

    def best(self) -> tuple[Device, float]:
        """The best device that meets the conditions, else the nearest to that; its violation."""
        precision = self.explorer.wish.settings.precision
        known = [device for device in self._devices.values() if device is not None]
        rated = [(self.explorer.violation(device, self.task), device) for device in known]
        good = [pair for pair in rated if pair[0] <= precision]
        if good:
            violation, device = min(good, key=lambda pair: self._objective(pair[1]))
        else:
            violation, device = min(rated, key=lambda pair: pair[0])
        return device, violation


def climb(explorer: Explorer, task: Task) -> Outcome:
    """Carry one search out; what ends it before is told."""
    try:
        search = Search(explorer, task)
    except (NanoromError, Stopped) as error:
        return Outcome(task, None, np.inf, str(error), "")
    settings = explorer.wish.settings
    remark = ""
    try:
        found = minimize(
            search.value,
            task.begin,
            jac=search.gradient,
            method="SLSQP",
            bounds=[(0.0, 1.0)] * len(task.begin),
            constraints=search.constraints(),
            options={
                "ftol": ACCURACY * settings.precision,
                "maxiter": settings.evaluations,
            },
        )
    except (NanoromError, Stopped) as error:
        remark = f"ended {error}"
    else:
        if not found.success:
            remark = f"ended: {found.message}"
    device, violation = search.best()
    if violation > settings.precision and not remark:
        remark = "no device near meets the conditions"
    return Outcome(task, device, violation, remark, search.inexact)
