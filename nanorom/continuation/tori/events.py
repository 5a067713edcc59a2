"""Bifurcations between two members of a family of invariant curves: folds, doublings, third
frequencies.

A fold is where the parameter turns back; elsewhere an exponent passes zero. A single one belongs to
a real direction: a torus of twice the length ("PD") or another of the same length ("BP") branches;
of two that pass together a torus with a third frequency does ("TR").
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

from scipy.optimize import brentq

from nanorom.continuation.tori.family import Family, Member
from nanorom.continuation.tori.stability import doubles
from nanorom.errors import ContinuationError

STEP = 1e-6  # of the step between the members: error of a located place
TOGETHER = 0.02  # difference of two exponents of a complex pair, relative to all losses
AT_FOLD = 0.01  # exponent relative to all losses that is zero because of the fold


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
        fold = _locate(family, before, after, lambda member: member.tangent.parameter)
        found.append(Event("LP", fold))
    if before.unstable != after.unstable:
        found += _crossings(family, before, after, fold)
    return sorted(found, key=lambda event: event.member.step)


def _crossings(family: Family, before: Member, after: Member, fold: Member | None) -> list[Event]:
    low, high = sorted((before.unstable, after.unstable))
    found: list[Event] = []
    k = low
    if fold is not None and abs(_growth(slice(k, k + 1), fold)) < AT_FOLD * _losses(fold):
        k += 1  # the one that passes at the fold
    while k < high:
        paired = k + 1 < high and _is_pair(before, k) and _is_pair(after, k)
        chosen = slice(k, k + 2) if paired else slice(k, k + 1)
        place = _locate(family, before, after, partial(_growth, chosen))
        k = chosen.stop
        kind = (
            "TR"
            if paired
            else "PD"
            if doubles(place.curve, place.factors.maps, place.free)
            else "BP"
        )
        found.append(Event(kind, place))
    return found


def _single(place: Member) -> str:
    return "PD" if doubles(place.curve, place.factors.maps, place.free) else "BP"


def _growth(chosen: slice, member: Member) -> float:
    return float(member.exponents[chosen].sum())


def _losses(member: Member) -> float:
    return abs(float(member.exponents.sum()))


def _is_pair(member: Member, k: int) -> bool:
    gap = member.exponents[k] - member.exponents[k + 1]
    return bool(abs(gap) < TOGETHER * _losses(member))


def _locate(
    family: Family, before: Member, after: Member, test: Callable[[Member], float]
) -> Member:
    """The member between two at which a test function vanishes."""
    step = after.step
    known = {0.0: before, step: after}
    start = replace(before, bend=after.bend)

    def value(s: float) -> float:
        if s not in known:
            known[s] = family.beside(start, s)
        return test(known[s])

    try:
        root = float(brentq(value, 0.0, step, xtol=STEP * step, rtol=1e-15))
        return known.get(root) or family.beside(start, root)
    except ContinuationError:  # no curve between: the nearest that there is
        return min(known.values(), key=lambda member: abs(test(member)))
