"""Effective coefficients of one mode: what a fit of a single oscillator to it returns.

    m q'' + (c + eta q^2) q' + k q + beta q^3 + delta q^5 = F

The manifold of the mode gives its frequency and its decay rate as series of the squared amplitude
of its first harmonic, as a lock-in measures it. The coefficients follow from the series of the
oscillator above: omega / omega_0 = 1 + 3/8 e - 15/256 e^2 + 5/16 delta a^4 / k, e = beta a^2 / k,
and decay rate c / 2 m + eta a^2 / 8 m. Source of the averages: Nayfeh and Mook, Nonlinear
Oscillations, 1979, doi:10.1002/9783527617586.
"""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np
from scipy.constants import hbar

from nanorom.errors import ModelError
from nanorom.rom.manifold.equations import Equations, equations_of
from nanorom.rom.manifold.invariance import NEAR, expand
from nanorom.rom.manifold.monomials import Index
from nanorom.rom.modal import FOLLOWING
from nanorom.types import Array, Numbers

SERIES_ORDER = 5  # of the manifold: as far as the quintic coefficient needs
KERR_ORDER = 3
ROUND_OFF = 1e-10  # of a coefficient's own size: what differences leave of a zero
NAMELESS = "what has no name"  # fields of a film: in-plane motion, and modes that are not named
DISPERSIVE = 0.02  # of the first mode's frequency: nearer to a resonance, modes exchange energy


@attrs.frozen(eq=False)
class Series:
    """Coefficients by powers of a^2, a the amplitude of the first harmonic of q: frequency, decay
    rate, and mean q by a^2, in the units of the equations.
    """

    frequency: Array
    decay: Array
    offset: float


def series(equations: Equations, place: int, coordinate: int, order: int = SERIES_ORDER) -> Series:
    """The series of the manifold of one mode, whose places are those of `manifold`."""
    undamped = equations.undamped()
    own = expand(undamped, np.array([place]), order, "normal")
    damped = expand(equations, np.array([place]), order, "normal")
    powers = own.monomials.powers
    count = (order + 1) // 2
    # of z |z|^2k: places, the first harmonic of q, and the dynamics
    places = [own.monomials.place((k + 1, k)) for k in range(count)]
    q = own.shape @ undamped.basis.shapes[coordinate]
    first = 2 * q[places]
    squared = np.zeros(count + 1)
    for i, a in enumerate(first):
        for j, b in enumerate(first):
            if i + j < count:
                squared[i + j + 1] += (a * b.conj()).real
    by_amplitude = _inverted(squared[1:])
    frequency = _composed(own.dynamics[places, 0].imag, by_amplitude)
    decay = _composed(-damped.dynamics[places, 0].real, by_amplitude)
    offset = float(q[powers.tolist().index([1, 1])].real / squared[1])
    return Series(frequency, decay, offset)


def _inverted(terms: Array) -> Array:
    """s = sum_k result_k A^k, k from 0, where A = sum_k terms_k s^(k + 1)."""
    count = len(terms) + 1
    result = np.zeros(count)
    for _ in range(count):
        power, rest = result.copy(), np.zeros(count)
        rest[1] = 1.0
        for term in terms[1:]:
            power = np.convolve(power, result)[:count]
            rest -= term * power
        result = rest / terms[0]
    return result


def _composed(terms: Array, inner: Array) -> Array:
    """sum_k terms_k s^k of a series s of A, by powers of A."""
    result, power = np.zeros(len(terms)), np.zeros(len(terms))
    power[0] = 1.0
    for term in terms:
        result += term * power
        power = np.convolve(power, inner)[: len(terms)]
    return result


@attrs.frozen(eq=False)
class Oscillator:
    """Coefficients of the oscillator that moves as a mode does.

    cubic: beta in N/m^3; quintic: delta in N/m^5; damping: eta in N s/m^3; offset: mean q by a^2 in
    1/m, which rests on the quadratic force.
    """

    cubic: float
    quintic: float
    damping: float
    offset: float

    @classmethod
    def of(cls, equations: Equations, place: int, coordinate: int, mass: float) -> Oscillator:
        """The oscillator of a mode with a modal mass in kg."""
        found = series(equations, place, coordinate)
        omega, first, second = found.frequency[:3]
        x, rate = equations.amplitude, equations.frequency
        k = mass * (omega * rate) ** 2
        e = 8 / 3 * first / omega
        return cls(
            cubic=e * k / x**2,
            quintic=(16 / 5) * k * (second / omega + 15 / 256 * e**2) / x**4,
            damping=8 * mass * found.decay[1] * rate / x**2,
            offset=found.offset / x,
        )

    def minus(self, other: Oscillator) -> Oscillator:
        """The differences of all coefficients."""
        values = (attrs.asdict(self)[name] - value for name, value in attrs.asdict(other).items())
        return Oscillator(*values)


@attrs.frozen(eq=False)
class Coefficients:
    """Effective coefficients of a mode of a model, and what causes them.

    total; parts: by name, what each adds: the mode's own cubic force, what lies outside the modes,
    its own quadratic force, the fields of a film that are no modes, and every other mode;
    together: what these do only together (of the quintic coefficient).  kerr (L,): change of the
    frequencies of all modes in rad/s by the squared amplitude of the mode in m^2; photon (L,): by a
    quantum of its energy, rad/s; dispersive (L,): False where a mode is so near to a resonance that
    the two exchange energy.
    """

    mode: int
    total: Oscillator
    parts: dict[str, Oscillator]
    together: Oscillator
    kerr: Array
    photon: Array
    dispersive: Array


def oscillator(model: Any, place: int) -> Oscillator:
    """The oscillator of the mode of a ReducedModel at a place from 0, without what is round-off.

    Raises the errors of `coefficients`.
    """
    equations, places, _ = equations_of(model, [int(model.number[place])], None, None)
    mass = float(model.mass[place])
    found = Oscillator.of(equations, int(places[0]), int(places[0]), mass)
    k, c = (
        mass * (2 * np.pi * float(model.frequency[place])) ** 2,
        float(model.damping[place, place]),
    )
    sizes = {"quintic": found.cubic**2 / k, "damping": c * found.cubic / k}
    small = {n: 0.0 for n, size in sizes.items() if abs(getattr(found, n)) < ROUND_OFF * abs(size)}
    return attrs.evolve(found, **small)


def shift(model: Any, place: int, other: int) -> float:
    """Change of a mode's frequency in rad/s by the squared amplitude in m^2 of another one.

    Of modes of a ReducedModel at places from 0, `other` the one whose frequency it is: at one and
    the same place the curvature of its backbone.  Raises the errors of `coefficients`, and
    ModelError where a third mode is in resonance with the two.
    """
    equations, places, _ = equations_of(model, [int(model.number[place])], None, None)
    if place == other:
        cubic = oscillator(model, place).cubic
        return (
            3 / 8 * cubic / (float(model.mass[place]) * 2 * np.pi * float(model.frequency[place]))
        )
    units = equations.frequency / equations.amplitude**2
    return _cross_shift(equations.undamped(), int(places[0]), other, units)


def coefficients(model: Any, mode: int | str) -> Coefficients:
    """The effective coefficients of a mode of a ReducedModel, by number or label.

    Raises ModelError for a mode that does not exist, or in resonance with another: such a mode has
    no oscillator of its own.
    """
    equations, places, label = equations_of(model, [mode], None, None)
    place = int(places[0])
    mass = float(model.mass[place])
    total = Oscillator.of(equations, place, place, mass)
    alone = Oscillator.of(equations.of_modes(np.array([place])), 0, 0, mass)
    parts = _own(model, place, alone)
    follows = np.flatnonzero(model.number > FOLLOWING)
    if len(follows):
        group = np.append(place, follows)
        beside = Oscillator.of(equations.of_modes(group), 0, 0, mass)
        parts[NAMELESS] = beside.minus(alone)
        alone = beside
    others = np.setdiff1d(np.arange(len(label)), [place, *follows])
    for other in others:
        group = np.concatenate([[place, other], follows])
        both = Oscillator.of(equations.of_modes(group), 0, 0, mass)
        parts[label[other]] = both.minus(alone)
    rest = total
    for part in parts.values():
        rest = rest.minus(part)
    kerr, dispersive = _kerr(equations, place, others, total, mass)
    omega = 2 * np.pi * model.frequency[place]
    return Coefficients(
        mode=place,
        total=total,
        parts=parts,
        together=rest,
        kerr=kerr,
        photon=kerr * 2 * hbar / (mass * omega),
        dispersive=dispersive,
    )


def _own(model: Any, place: int, alone: Oscillator) -> dict[str, Oscillator]:
    """What a mode's own forces make, by name."""
    index = (place,) * 4
    cubic = float(model.cubic[index])
    loss = 0.0 if model.cubic_damping is None else 2 * float(model.cubic_damping[index])
    found = {"own cubic force": Oscillator(cubic, 0.0, loss, 0.0)}
    outside = 0.0 if model.outside_cubic is None else float(model.outside_cubic[index])
    if outside:
        found["outside the modes"] = Oscillator(outside, 0.0, 0.0, 0.0)
    rest = alone
    for part in found.values():
        rest = rest.minus(part)
    if model.quadratic[index[:3]]:
        found["own quadratic force"] = rest
    return found


def _kerr(
    equations: Equations, place: int, others: Index, total: Oscillator, mass: float
) -> tuple[Array, Array]:
    """Shifts of the frequencies of one mode and of others by the squared amplitude of the one, NaN
    of all else and where a third mode is in resonance; and whether the mode only shifts them.
    """
    undamped = equations.undamped()
    rates = undamped.basis.rates.imag[: undamped.size]
    units = equations.frequency / equations.amplitude**2
    kerr = np.full(undamped.size, np.nan)
    dispersive = np.ones(undamped.size, dtype=bool)
    kerr[place] = 3 / 8 * total.cubic / (mass * rates[place] * equations.frequency)
    for other in others:
        try:
            kerr[other] = _cross_shift(undamped, place, int(other), units)
        except ModelError:
            dispersive[other] = False  # a third mode is in resonance with the two
            continue
        dispersive[other] = _apart(rates[place], rates[other])
    return kerr, dispersive


def _cross_shift(undamped: Equations, place: int, other: int, units: float) -> float:
    """Shift of another mode's frequency by the squared amplitude of one; raises ModelError."""
    masters: Index = np.array([place, other])
    found = expand(undamped, masters, KERR_ORDER, "normal")
    moved: Numbers = found.dynamics[found.monomials.place((1, 1, 1, 0)), 1]
    return float(moved.imag) * units


def _apart(first: float, other: float) -> bool:
    """Whether no resonance of two modes up to the third order is near."""
    ratios = np.array([1.0, 2.0, 0.5, 3.0, 1 / 3])
    return bool(np.abs(other - ratios * first).min() > min(DISPERSIVE, NEAR) * first)
