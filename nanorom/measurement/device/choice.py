"""Which model the data are likeliest with: nonlinear damping or none, another mode or none.

By Schwarz' criterion (Ann. Stat. 6 (1978) 461, doi:10.1214/aos/1176344136).  What a step promises
is looked at before it is taken; another mode is tried where what is left is no noise.
"""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.errors import NanoromError
from nanorom.measurement.device.begin import Begin
from nanorom.measurement.device.fit import DeviceFit, Evaluation
from nanorom.measurement.device.parameters import Parameter
from nanorom.measurement.sweeps.peaks import is_alike
from nanorom.types import Array

NEAR = 0.1  # relative, of a range: a mode that may be a part of what is seen there
MULTIPLES = (1.0, 3.0)  # of the drive's frequency, at which a cubic force drives a mode
MOST_PARTNERS = 2
WEAKER = 0.3  # drive and read-out of another mode where it is looked for, by the nearest one's
SIGNS = (1.0, -1.0)  # of its force, by which it adds to what is seen or takes from it


@attrs.frozen
class Choice:
    """A model that was tried: name; evidence: -2 log of its likelihood with what its parameters
    cost, relative to the one taken, a factor on odds of exp(-evidence/2); taken.
    """

    name: str
    evidence: float
    taken: bool


Chosen = tuple[DeviceFit, Evaluation, tuple[Choice, ...]]


def chosen(fit: DeviceFit, found: Evaluation, begin: Begin) -> Chosen:
    """The likeliest of the fit and of what may be added to it, with all that was tried."""
    fit, found, first = _with_nonlinear_damping(fit, found)
    fit, found, second = _with_partner(fit, found, begin)
    return fit, found, first + second


def is_misfit(fit: DeviceFit, found: Evaluation) -> bool:
    """Whether what is left of a part is more than noise."""
    return any(
        is_alike((y - part.trace.amplitude) / fit.deviation(part.place, y), [len(y)])
        for part, y in zip(fit.parts, found.fitted)
    )


def _told(names: tuple[str, str], difference: float) -> tuple[Choice, Choice]:
    """Of what was there and what was added; difference of their evidence."""
    better = difference < 0
    return (
        Choice(names[0], max(-difference, 0.0), not better),
        Choice(names[1], max(difference, 0.0), better),
    )


def _with_nonlinear_damping(fit: DeviceFit, found: Evaluation) -> Chosen:
    """The fit with a viscous film if the data are likelier so."""
    name = "material_time"
    if any(parameter.name == name for parameter in fit.parameters.sought):
        return fit, found, ()
    more = attrs.evolve(
        fit, parameters=fit.parameters.with_(Parameter(name, "", 0.0, "s", logarithm=False))
    )
    start = np.append(found.x, fit.parameters.fixed[name])
    tried = more.evaluate(start, fit)
    step = more.step(tried)
    if step[-1] <= 0 or more.promised(tried) < np.log(fit.rows):
        return fit, found, ()
    end = more.descend(start + step, rounds=1)
    difference = more.evidence(end) - fit.evidence(found) if end.x[-1] > 0 else np.inf
    choices = _told(("linear damping", "nonlinear damping"), float(difference))
    return (more, end, choices) if difference < 0 else (fit, found, choices)


def _with_partner(fit: DeviceFit, found: Evaluation, begin: Begin) -> Chosen:
    """The fit with another mode of the scene, where one is near and the misfit asks for it."""
    if not is_misfit(fit, found):
        return fit, found, ()
    best, choices = (fit, found), list[Choice]()
    for other in _partners(fit, found, begin)[:MOST_PARTNERS]:
        for sign in SIGNS:
            try:
                more, start = _added(fit, found, begin, other, sign)
                end = more.descend(start)
            except NanoromError:  # no motion with such a mode: it is not there
                continue
            difference = more.evidence(end) - best[0].evidence(best[1])
            names = ", ".join(best[0].parameters.label), ", ".join(more.parameters.label)
            choices = (
                list(_told(names, float(difference))) if difference < 0 or not choices else choices
            )
            if difference < 0:
                best = more, end
    return (*best, tuple(choices))


def _partners(fit: DeviceFit, found: Evaluation, begin: Begin) -> list[int]:
    """Modes of the scene near to what was swept, or to three times that, the nearest first."""
    scale = float(found.device.frequency[0] / begin.frequency[begin.index[0]])
    away: dict[int, float] = {}
    for i in set(range(len(begin.label))) - set(begin.index):
        for low, high in fit.ranges:
            for multiple in MULTIPLES:
                place = scale * begin.frequency[i] / multiple
                miss = max(low - place, place - high, 0.0) / place
                away[i] = min(away.get(i, np.inf), miss)
    return sorted((i for i in away if away[i] < NEAR), key=lambda i: away[i])


def _added(
    fit: DeviceFit, found: Evaluation, begin: Begin, other: int, sign: float
) -> tuple[DeviceFit, Array]:
    """The fit with another mode, and where its search begins: like the nearest one, but weaker."""
    old = fit.parameters
    nearest = int(np.abs(found.device.frequency - begin.frequency[other]).argmin())
    like = old.label[nearest]
    wider = attrs.evolve(begin, parameters=old).of_modes([*begin.index, other])
    start = list(found.x)
    for parameter, value in zip(old.sought, found.x.tolist()):
        if parameter.mode == like and parameter.name != "phase":  # that is one of a range
            wider = wider.with_(attrs.evolve(parameter, mode=begin.label[other]))
            weaker = np.log(WEAKER) if parameter.name != "quality_factor" else 0.0
            start.append(value + weaker)
    wider.signs[begin.label[other]] = sign
    return attrs.evolve(fit, parameters=wider, last=None), np.array(start)
