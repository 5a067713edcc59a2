"""From a wish to a device: searches from many starts, a front of two objectives, what is made."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import qmc

from nanorom.devices import made
from nanorom.devices.catalogue import Catalogue, Stopped
from nanorom.devices.search import Device, Explorer, Outcome, Task, climb
from nanorom.devices.study import workers
from nanorom.devices.wish import Objective, Wish
from nanorom.errors import NanoromError
from nanorom.files.lines import Lines
from nanorom.files.whole import check_writable
from nanorom.launch import watched
from nanorom.results.design import NONE, Design
from nanorom.scene.places import put
from nanorom.scene.scene import Scene
from nanorom.types import Array, Progress

PAUSE = 1.0  # s between two looks at what is under way
FINER = 0.1  # of the tolerance at which the best device is computed once more


def design(
    scene: Scene | str | Path,
    vary: Mapping[str, Any],
    *,
    minimize: str | Sequence[str] | None = None,
    maximize: str | Sequence[str] | None = None,
    conditions: str | Sequence[str] | None = None,
    of: str | Sequence[str] | None = None,
    spread: Mapping[str, Any] | None = None,
    processes: int | None = None,
    path: str | Path | None = None,
    progress: Progress | None = None,
    **settings: Any,
) -> Design:
    """The device, among those that keys of a scene allow, that is best at something.

    vary: bounds of keys, ``{"plate.thickness": {"from": "5 nm", "to": "50 nm"}}`` (``"spacing":
    "log"``).  minimize, maximize: a formula of names as for `nanorom.sensitivity` and of keys, such
    as ``"f1 * Q1"``; two formulas for a front.  conditions: what must hold, ``"f2/f1 = 2"``, ``"f1
    >= 20 MHz"``, ``"f2/f1 = 2 +- 0.1 %"`` with what is good enough in a device that is made.  of:
    further formulas to be told.  spread: of keys in such a device, ``{"plate.thickness": "3 %"}``,
    beside what the scene says.  settings: of `nanorom.devices.wish.Settings`.  processes: that work
    at once, the cores at hand if left out.

    Derivatives are exact where `nanorom.sensitivity` has them.  With a path the design is saved
    there; devices are kept beside it until then, and the same call goes on from them if it was
    interrupted.  Raises SceneError, ModelError for what is asked, FileError if the file cannot be
    written, NanoromError under MPI or if no device at all could be computed.
    """
    given = {
        "vary": vary,
        "minimize": minimize,
        "maximize": maximize,
        "conditions": conditions,
        "of": of,
        "spread": spread or {},
        **settings,
    }
    return carry_out(Wish.of_table(scene, given), processes, path, progress)


def carry_out(
    wish: Wish,
    processes: int | None = None,
    path: str | Path | None = None,
    progress: Progress | None = None,
) -> Design:
    """The design of a wish; parameters and errors as of `design`."""
    count = workers(processes)
    if path is not None:
        check_writable(path)
    kept, settings = Lines(path, wish.key), wish.settings
    limits = settings.seconds, settings.hours
    with (
        watched(progress) as told,
        Catalogue(wish.names, wish.directory, kept, count, *limits) as catalogue,
    ):
        run = _Run(Explorer(wish, catalogue), told)
        outcomes = run.front() if len(wish.objectives) == 2 else run.starts()
        found = _assembled(run.explorer, outcomes)
    if path is not None:
        found.save(path)
        kept.finished()
    return found


class _Run:
    """Searches of a wish, side by side."""

    def __init__(self, explorer: Explorer, told: Progress) -> None:
        self.explorer, self._told, self._count = explorer, told, 0

    def starts(self, objective: Objective | None = None) -> list[Outcome]:
        """The best of one objective, from the scene itself and from points between the bounds."""
        wish = self.explorer.wish
        objective = objective or next(iter(wish.objectives), None)
        more = _points(wish.settings.starts - 1, len(wish.varied), wish.settings.seed)
        return self._searched([self._task(begin, objective) for begin in (wish.start, *more)])

    def front(self) -> list[Outcome]:
        """Each objective alone, then the first below limits of the second."""
        first, second = self.explorer.wish.objectives
        alone = self.starts(first), self.starts(second)
        ends = [_best(found, self.explorer) for found in alone]
        outcomes = [*alone[0], *alone[1]]
        if ends[0] is None or ends[1] is None:
            return outcomes
        devices = [end.device for end in ends if end is not None and end.device is not None]
        places = [device.places for device in devices]
        low, high = ([_signed(each, device) for device in devices] for each in (first, second))
        # at its own best, an objective leaves the other one free
        tasks = [self._task(places[0], second, (first.expression, first.sign, low[0]))]
        for share in np.linspace(0, 1, self.explorer.wish.settings.points)[1:]:
            limit = float((1 - share) * high[0] + share * high[1])
            begin = (1 - share) * places[0] + share * places[1]
            tasks.append(self._task(begin, first, (second.expression, second.sign, limit)))
        return [*outcomes, *self._searched(tasks)]

    def _task(self, begin: Array, objective: Objective | None, limit: Any = None) -> Task:
        self._count += 1
        if objective is None:
            return Task(self._count - 1, np.asarray(begin), None, 1.0, limit)
        return Task(self._count - 1, np.asarray(begin), objective.expression, objective.sign, limit)

    def _searched(self, tasks: Sequence[Task]) -> list[Outcome]:
        done = self._count - len(tasks)
        with ThreadPoolExecutor(len(tasks)) as threads:
            left = {threads.submit(climb, self.explorer, task) for task in tasks}
            found: list[Outcome] = []
            try:
                while left:
                    ended, left = wait(left, PAUSE)
                    found += [future.result() for future in ended]
                    devices = self.explorer.catalogue.computed
                    self._told(f"searches, {devices} devices", done + len(found), self._count)
            except BaseException:
                self.explorer.catalogue.stop("interrupted")
                raise
        return sorted(found, key=lambda outcome: outcome.task.number)


def _points(count: int, dimensions: int, seed: int) -> Array:
    """Evenly spread places (n, p); the same ones, and more, where more are asked for."""
    power = max(int(np.ceil(np.log2(max(count, 1)))), 0)
    return np.asarray(qmc.Sobol(dimensions, seed=seed).random_base2(power)[:count])


def _rating(outcome: Outcome, explorer: Explorer) -> float:
    """What the first objective comes to, infinite where conditions are not met."""
    if outcome.device is None or outcome.violation > explorer.wish.settings.precision:
        return float(np.inf)
    task = outcome.task
    if task.objective is None:  # the device that is nearest to the scene
        return float(np.linalg.norm(outcome.device.places - explorer.wish.start))
    return task.sign * task.objective.value(outcome.device.known)


def _signed(objective: Objective, device: Device) -> float:
    return objective.sign * objective.expression.value(device.known)


def _best(outcomes: Sequence[Outcome], explorer: Explorer) -> Outcome | None:
    rated = [(_rating(outcome, explorer), outcome) for outcome in outcomes]
    if not any(np.isfinite(rating) for rating, _ in rated):
        return None
    return min(rated, key=lambda pair: pair[0])[1]


def _on_front(outcomes: Sequence[Outcome], explorer: Explorer) -> tuple[Array, int]:
    """Which searches ended at the best, or on the front; and which one is chosen of them.

    Of a front that with the smallest sum of squares, each objective by its range on the front.
    """
    good = np.array([np.isfinite(_rating(outcome, explorer)) for outcome in outcomes])
    objectives = explorer.wish.objectives
    if not good.any():
        return np.zeros(len(outcomes), dtype=bool), NONE
    if len(objectives) < 2:
        best = int(np.argmin([_rating(outcome, explorer) for outcome in outcomes]))
        return np.arange(len(outcomes)) == best, best
    values = np.full((len(outcomes), 2), np.inf)
    for row, outcome in zip(values, outcomes):
        if outcome.device is not None:
            row[:] = [_signed(each, outcome.device) for each in objectives]
    values[~good] = np.inf
    scale = np.ptp(values[good], axis=0)
    room = 2 * explorer.wish.settings.precision * np.abs(values[good]).max(axis=0)
    front = good.copy()
    for number in np.flatnonzero(good):
        better = (values <= values[number] + room).all(axis=1)
        better &= (values < values[number] - room).any(axis=1)
        front[number] = not better[good].any()
    scaled = (values - values[front].min(axis=0)) / np.where(scale > 0, scale, 1.0)
    scaled[~front] = np.inf
    return front, int(np.argmin(np.sum(scaled**2, axis=1)))


def _assembled(explorer: Explorer, outcomes: Sequence[Outcome]) -> Design:
    wish = explorer.wish
    front, chosen = _on_front(outcomes, explorer)
    history = [(n, device) for n in sorted(explorer.history) for device in explorer.history[n]]
    if not history:
        raise NanoromError(f"design: no device could be computed; the first: {outcomes[0].remark}")
    ended = [outcome.device for outcome in outcomes]
    none = np.full(len(wish.varied) + len(wish.told), np.nan)
    rows = np.array([none if device is None else _row(wish, device) for device in ended])
    reached = [bool(outcome.violation <= wish.settings.precision) for outcome in outcomes]
    nearest = int(np.argmin([outcome.violation for outcome in outcomes]))
    best = outcomes[chosen if chosen != NONE else nearest]
    assert best.device is not None
    table = np.array([_row(wish, device) for _, device in history])
    keys = len(wish.varied)
    return Design(
        scene=Scene.from_dict(wish.document, wish.directory).to_toml(),
        best=wish.scene(best.device.places).to_toml(),
        wish={
            "": [objective.text for objective in wish.objectives],
            "with": [condition.text for condition in wish.conditions],
        },
        by=tuple(each.key for each in wish.varied),
        by_unit=tuple(each.unit for each in wish.varied),
        low=wish.setting(np.zeros(keys)),
        high=wish.setting(np.ones(keys)),
        of=tuple(expression.text for expression in wish.told),
        of_unit=tuple(_unit(expression.text, best.device) for expression in wish.told),
        search=np.array([number for number, _ in history]),
        setting=table[:, :keys],
        value=table[:, keys:],
        violation=np.array([explorer.violation(device) for _, device in history]),
        ended_setting=rows[:, :keys],
        ended_value=rows[:, keys:],
        ended_violation=np.array([outcome.violation for outcome in outcomes]),
        reached=np.array(reached),
        front=front,
        remark=tuple(outcome.remark for outcome in outcomes),
        chosen=chosen,
        **_about(explorer, best),
    )


def _about(explorer: Explorer, best: Outcome) -> dict[str, Any]:
    """Derivatives at the best device, a finer run of it, and what spreads make of it."""
    wish, device = explorer.wish, best.device
    assert device is not None
    keys, formulas = len(wish.varied), wish.told
    slope, exact = np.full((len(formulas), keys), np.nan), np.zeros(keys, dtype=bool)
    share, yields, told = np.zeros((len(formulas), len(wish.spread))), dict[str, Any](), []
    try:
        found = explorer.slopes(device)
        by_key = [found.value[each.key][n] for n, each in enumerate(wish.varied)]
        slope = np.array([_padded(e.slope(device.known, found.value), keys) for e in formulas])
        slope, exact = slope / np.array(by_key), np.array(found.exact)
        if not exact.all() and found.why:
            told.append(f"derivatives are differences of devices: {found.why}")
        if wish.spread:
            off = made.shares(explorer, device)
            share = np.array(
                [_padded(e.slope(device.known, off), len(wish.spread)) for e in formulas]
            )
            yields = made.yields(explorer, device, off)
    except (NanoromError, Stopped) as error:
        told.append(f"sensitivity and spread of the best device: {error}")
    finer, remark = _finer(explorer, device)
    known = made.spreads(wish, device)
    return {
        "slope": slope,
        "exact": exact,
        "finer": finer,
        "source": tuple(known),
        "source_unit": tuple(spread.unit for spread in known.values()),
        "spread": np.array([spread.deviation for spread in known.values()]),
        "share": share,
        "made": yields,
        "told": "; ".join(filter(None, [device.remark, *told, remark])),
    }


def _finer(explorer: Explorer, device: Device) -> tuple[Array, str]:
    """Formulas of a device at a tenth of the tolerance, or why there are none."""
    wish = explorer.wish
    none = np.full(len(wish.told), np.nan)
    tolerance = wish.scene(device.places).accuracy.tolerance
    if tolerance is None:
        return none, "no finer run: the scene says its mesh itself"
    put(tables := wish.tables(device.places), "accuracy.tolerance", FINER * tolerance)
    try:
        finer = explorer.device_of(tables, device.places)
    except (NanoromError, Stopped) as error:
        return none, f"no finer run: {error}"
    return np.array([expression.value(finer.known) for expression in wish.told]), ""


def _row(wish: Wish, device: Device) -> Array:
    """Keys and formulas of a device."""
    values = [expression.value(device.known) for expression in wish.told]
    return np.array([*wish.setting(device.places), *values])


def _unit(text: str, device: Device) -> str:
    """Of a formula that is a single quantity or key; "" for others."""
    return device.units.get(text, "")


def _padded(slope: Array, count: int) -> Array:
    """A formula of numbers alone has no derivatives: zeros."""
    return slope if len(slope) else np.zeros(count)
