"""Bifurcations between two members of a family of invariant curves: folds, doublings, third
frequencies.

A fold is where the parameter turns back; elsewhere an exponent passes zero. A single one belongs to
a real direction: a torus of twice the length ("PD") or another of the same length ("BP") branches;
of two that pass together a torus with a third frequency does ("TR").
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from scipy.optimize import brentq

from nanorom.continuation.tori.family import Family, Member
from nanorom.continuation.tori.stability import doubles
from nanorom.errors import ContinuationError

STEP = 1e-7  # of the step between the members: error of a located place
TOGETHER = 0.02  # difference of two exponents of a complex pair, relative to all losses
AT_FOLD = 0.02  # of the step: an exponent that passes zero there does so because of the fold


@dataclass(frozen=True, eq=False)
class Event:
    """A bifurcation of tori: "LP", "PD", "BP" or "TR", and the member at it."""

    type: str
    member: Member


def events(family: Family, before: Member, after: Member) -> list[Event]:
    """The bifurcations in the step that led from one member to the next, in order."""
    found = []
    fold = None
    if before.tangent.parameter * after.tangent.parameter < 0:
        fold = _locate(family, before, after.step, lambda member: member.tangent.parameter)
        if fold is not None:
            found.append(Event("LP", fold))
    if before.unstable != after.unstable:
        found += _crossings(family, before, after, fold)
    return sorted(found, key=lambda event: event.member.step)


def _crossings(family: Family, before: Member, after: Member, fold: Member | None) -> list[Event]:
    low, high = sorted((before.unstable, after.unstable))
    found: list[Event] = []
    k = low
    while k < high:
        paired = k + 1 < high and _is_pair(before, k) and _is_pair(after, k)
        chosen = slice(k, k + 2) if paired else slice(k, k + 1)
        place = _locate(family, before, after.step, partial(_growth, chosen))
        k = chosen.stop
        if place is None:
            continue
        if fold is not None and abs(place.step - fold.step) < AT_FOLD * after.step:
            continue
        kind = "TR" if paired else "PD" if doubles(place.curve, place.factors.maps) else "BP"
        found.append(Event(kind, place))
    return found


def _growth(chosen: slice, member: Member) -> float:
    return float(member.exponents[chosen].sum())


def _is_pair(member: Member, k: int) -> bool:
    exponents = member.exponents
    return bool(abs(exponents[k] - exponents[k + 1]) < TOGETHER * abs(exponents.sum()))


def _locate(
    family: Family, before: Member, step: float, test: Callable[[Member], float]
) -> Member | None:
    """The member within a step at which a test function vanishes, or None."""
    known: dict[float, Member] = {0.0: before}

    def value(s: float) -> float:
        if s not in known:
            known[s] = family.beside(before, s)
        return test(known[s])

    try:
        root = float(brentq(value, 0.0, step, xtol=STEP * step, rtol=1e-15))
    except (ContinuationError, ValueError):
        return None
    return known.get(root) or family.beside(before, root)
