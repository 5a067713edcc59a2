"""What spreads make of a device: deviations to first order, and how many meet the conditions."""

from __future__ import annotations

import copy
import warnings
from functools import partial
from typing import Any

import numpy as np
from scipy.special import ndtri
from scipy.stats import qmc

from nanorom.devices.derivatives import Line
from nanorom.devices.expression import Condition
from nanorom.devices.search import Device, Explorer
from nanorom.devices.wish import Wish
from nanorom.errors import NanoromError
from nanorom.scene.places import look, put
from nanorom.scene.spread import Spread
from nanorom.scene.units import of_any_dimension
from nanorom.types import Array

LINEAR = 2**14  # devices of the linear model: their share is known to half a per cent
OUTERMOST = 1e-9  # probability that is not drawn


def spreads(wish: Wish, device: Device) -> dict[str, Spread]:
    """Spreads by key about a device: those of keys that vary are as wide as they were, relative."""
    found = {}
    for key, spread in wish.spread.items():
        mean = device.known.get(key, spread.mean)
        wide = spread.deviation * (abs(mean / spread.mean) if key in device.known else 1.0)
        found[key] = Spread(mean, wide, spread.unit)
    return found


def lines(wish: Wish, device: Device) -> list[Line]:
    """Scenes along each spread, in its deviations."""
    found = []
    for key, spread in spreads(wish, device).items():
        found.append(Line(partial(_along, wish, device, key, spread)))
    return found


def _along(wish: Wish, device: Device, key: str, spread: Spread, place: float) -> dict[str, Any]:
    return _off(wish, device, {key: (spread, place)})


def _off(wish: Wish, device: Device, off: dict[str, tuple[Spread, float]]) -> dict[str, Any]:
    """Tables of a device whose keys are off by numbers of deviations."""
    tables = copy.deepcopy(wish.tables(device.places))
    for key, (spread, place) in off.items():
        put(tables, key, spread.mean + place * spread.deviation, spread.unit)
    return tables


def shares(explorer: Explorer, device: Device) -> dict[str, Array]:
    """Change of each quantity, and of each key, by one deviation of each spread (d,)."""
    along = lines(explorer.wish, device)
    found = dict(explorer.along(along, device).value)
    known = spreads(explorer.wish, device)
    for each in explorer.wish.varied:
        own = [spread.deviation * (key == each.key) for key, spread in known.items()]
        found[each.key] = np.array(own)
    return found


def yields(explorer: Explorer, device: Device, share: dict[str, Array]) -> dict[str, Any]:
    """Which part of devices meets the conditions: of the linear model, and of samples computed.

    An equality counts where it has a width, an inequality that the best device just meets counts
    from there on.
    """
    wish, settings = explorer.wish, explorer.wish.settings
    counted = [c for c in wish.conditions if c.relation != "=" or c.width is not None]
    if not counted or not wish.spread:
        return {}
    draws = _normal(LINEAR, len(wish.spread), settings.seed)
    good = np.ones(len(draws), dtype=bool)
    for condition in counted:
        gaps = condition.gap(device.known) + draws @ condition.slope(device.known, share)
        good &= _meets(condition, gaps, device.known, settings.precision)
    found: dict[str, Any] = {"linear": float(good.mean())}
    if settings.samples:
        found |= _sampled(explorer, device, counted)
    return found


def _sampled(explorer: Explorer, device: Device, counted: list[Condition]) -> dict[str, Any]:
    wish, settings = explorer.wish, explorer.wish.settings
    known = spreads(wish, device)
    draws = _normal(settings.samples, len(known), settings.seed)
    tables = [
        _off(wish, device, {key: (s, float(z)) for (key, s), z in zip(known.items(), row)})
        for row in draws
    ]
    good = 0
    for own, found in zip(tables, explorer.catalogue.each(tables)):
        good += _is_good(wish, own, found, device, counted)
    return {"sampled": good / len(tables), "samples": len(tables)}


def _is_good(
    wish: Wish, tables: Any, found: dict[str, Any], device: Device, counted: list[Condition]
) -> bool:
    if "failure" in found:
        return False
    known = dict(device.known) | dict(zip(wish.names, found["values"]))
    for each in wish.varied:
        known[each.key] = of_any_dimension(look(tables, each.key), each.key)[0]
    try:
        return all(
            bool(_meets(c, np.array(c.gap(known)), device.known, wish.settings.precision))
            for c in counted
        )
    except NanoromError:  # a formula has no value there: it is no device that meets the conditions
        return False


def _meets(condition: Condition, gaps: Array, known: dict[str, float], precision: float) -> Array:
    if condition.relation == "=":
        return np.asarray(np.abs(gaps) <= condition.width)
    size = max(abs(side.value(known)) for side in condition.expressions) or 1.0
    return np.asarray(gaps >= -precision * size)


def _normal(count: int, dimensions: int, seed: int) -> Array:
    """Points (n, d) of the standard normal distribution, evenly spread."""
    with warnings.catch_warnings():  # counts that are no power of two serve as well here
        warnings.filterwarnings("ignore", message=".*balance properties")
        share = qmc.Sobol(dimensions, seed=seed).random(count)
    return np.asarray(ndtri(np.clip(share, OUTERMOST, 1 - OUTERMOST)))
