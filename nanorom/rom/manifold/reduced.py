"""A manifold of a modal model: its backbone, its range, its coefficients."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from math import comb
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
from numpy.typing import ArrayLike

from nanorom.errors import ModelError
from nanorom.rom.manifold.equations import Equations, equations_of
from nanorom.rom.manifold.invariance import NEAR, STYLES, Expansion, expand
from nanorom.rom.manifold.lifted import lifted
from nanorom.rom.manifold.monomials import Index
from nanorom.rom.manifold.orbit import Motion, errors, free, motion
from nanorom.rom.manifold.oscillators import Oscillators, oscillators
from nanorom.rom.manifold.response import ManifoldResponse, response
from nanorom.types import Array, Numbers

if TYPE_CHECKING:
    from nanorom.continuation.orbits.orbit import PeriodicOrbit

LOWEST_ORDER, HIGHEST_ORDER = 1, 21
MOST_DOUBLES = 2e8  # of the matrices on a manifold, 1.6 GB
MOST_MONOMIALS = 5100  # minutes: order 9 of three masters
TOLERANCE = 1e-4  # relative error of frequency and motion that a validity is for
FIRST, GROWTH = 1e-2, 1.15  # sizes at which motions are sampled, in units of displacement
FARTHEST = 30.0  # units of displacement: no order holds there
MARGIN = 1.25  # of the estimate: it is one
HALVINGS = 9  # of the interval in which the range ends
LEAST = 1e-9  # units of displacement: an amplitude of zero
WITHOUT_GAIN = 4  # orders without a larger validity after which none is expected
ORDER, MASTERS = "manifold_order", "manifold_masters"  # diagnostics of a model of fields
WHOLE = 4  # parts of the first master's frequency that others may be multiples of


@attrs.frozen(eq=False, slots=False, repr=False)
class Reduced:
    """The motion of a modal model on the manifold of some masters.

    masters (m,): places of the masters among the modes, from 0; coordinates (m,): those that are
    largest in them; label: names of the modes; equations, expansion: in units of
    equations.frequency and equations.amplitude, with damping; model: whose modes these are.
    """

    masters: Index
    coordinates: Index
    order: int
    style: str
    label: tuple[str, ...]
    equations: Equations
    expansion: Expansion
    tolerance: float = TOLERANCE
    model: Any = None

    def __repr__(self) -> str:
        masters = ", ".join(self.label[place] for place in self.coordinates)
        slaves = len(self.label) - len(self.coordinates)
        return f"Manifold of {masters}, order {self.order}, style {self.style}, {slaves} slaves"

    @cached_property
    def undamped(self) -> Equations:
        return self.equations.undamped()

    @cached_property
    def conservative(self) -> Expansion:
        """The manifold without damping, in normal form: of periodic free motions."""
        return expand(self.undamped, self.masters, self.order, "normal")

    @cached_property
    def turns(self) -> Array:
        """Frequencies (m,) of the masters in resonance, by that of the first.

        Raises ModelError where their resonances are none of one common frequency.
        """
        return _turns(self.undamped.basis.rates[self.masters].imag, self.conservative)

    @property
    def near(self) -> list[tuple[str, str, float]]:
        """Slaves nearly in resonance with the masters: name, combination of frequencies, distance
        by the first master's frequency.
        """
        names = [self.label[c] for c in self.coordinates]
        return [
            (self.label[place], combination(powers, names), distance)
            for place, powers, distance in self.expansion.near
        ]

    def _at(self, size: float, guess: Numbers) -> tuple[Numbers, Motion]:
        z = free(self.conservative, size, self.turns, guess)
        return z, motion(self.undamped, self.conservative, z, self.turns)

    @cached_property
    def _samples(self) -> tuple[list[Numbers], Array]:
        """Masters z, and the largest q of the first, as both rise, to where the expansion ends."""
        masters, largest = [np.zeros(len(self.masters), dtype=complex)], [0.0]
        size, guess = FIRST, masters[0]
        while size < FARTHEST:
            try:
                z, found = self._at(size, guess * size)
            except ModelError:
                break  # where the expansion ends
            x = float(found.largest[self.coordinates[0]])
            if not (x > largest[-1] and found.rate > 0):
                break
            masters.append(z)
            largest.append(x)
            guess, size = z / size, size * GROWTH
        return masters, np.array(largest)

    @cached_property
    def validity(self) -> float:
        """Largest q of the first master in m up to which frequency and motion are right to
        `tolerance`, by an estimate from what the equations of motion leave.
        """
        _, largest = self._samples
        low, unit = 0.0, self.equations.amplitude
        for x in largest[1:]:
            if self.error(x * unit)[0] * MARGIN <= self.tolerance:
                low = float(x)
                continue
            high = float(x)
            for _ in range(HALVINGS):
                middle = (low + high) / 2
                if self.error(middle * unit)[0] * MARGIN <= self.tolerance:
                    low = middle
                else:
                    high = middle
            break
        return low * unit

    def error(self, x: ArrayLike) -> Array:
        """Estimated relative error (n,) of frequency or motion, the larger, where the largest q of
        the first master is x (n,) in m.
        """
        places = self.conservative.masters
        return np.array([max(errors(self.undamped, places, found)) for found in self.motions(x)])

    def backbone(self, x: ArrayLike) -> tuple[Array, Array]:
        """Angular frequencies (n,) in rad/s and largest |q| (n, L) in m of free motions without
        damping, by the largest q (n,) in m of the first master.

        Raises ModelError for amplitudes that the expansion does not reach.
        """
        found = self.motions(x)
        omega = np.array([m.rate for m in found]) * self.equations.frequency
        return omega, np.array([m.largest for m in found]) * self.equations.amplitude

    def state(self, z: ArrayLike) -> Array:
        """q and q' (..., 2L) in units of the model where the masters are z (..., m), complex, in m:
        near rest, a master's own q is Re(z).
        """
        u = self._values(z) @ self.expansion.shape
        basis, unit = self.equations.basis, self.equations.amplitude
        q, speed = ((u @ matrix.T).real for matrix in (basis.shapes, basis.speeds))
        return np.concatenate([q * unit, speed * unit * self.equations.frequency], axis=-1)

    def flow(self, z: ArrayLike) -> Numbers:
        """dz/dt (..., m) in m/s of the masters z (..., m) in m, without drive."""
        found = self._values(z) @ self.expansion.dynamics[:, : len(self.masters)]
        return np.asarray(found * self.equations.amplitude * self.equations.frequency)

    def _values(self, z: ArrayLike) -> Numbers:
        scaled = np.asarray(z, dtype=complex) / self.equations.amplitude
        both = np.concatenate([scaled, scaled.conj()], axis=-1)
        return self.expansion.monomials.values(both)

    def system(self) -> Oscillators:
        """The masters as oscillators, which `explore` and `sweep` take: x'' = P(x, x') with the
        manifold of style "graph". Raises ModelError for orders above 7.
        """
        return oscillators(self.equations, self._graph)

    @cached_property
    def _graph(self) -> Expansion:
        if self.style == "graph":
            return self.expansion
        return expand(self.equations, self.masters, self.order, "graph")

    def lifted(
        self,
        orbit: PeriodicOrbit,
        direct: float = 0.0,
        parametric: float = 0.0,
        instants: int = 256,
    ) -> Array:
        """q (n, L) in m of all modes at equal instants of a period of an orbit of `system`, which
        levels of the drives make; from where the drive is largest.
        """
        size, unit = 2 * len(self.masters), self.equations.amplitude
        q = orbit.time_series(instants)[1][:instants, :size] / unit
        omega, multiple = orbit.omega / self.equations.frequency, orbit.period_multiple
        levels = direct, parametric
        return lifted(self.equations, self._graph, q, omega, multiple, levels) * unit

    def deflection(self, q: ArrayLike) -> Array:
        """w (..., P) in m at the points of the model's shapes, of q (..., L) in m of all modes.

        Raises ModelError for a model without shapes.
        """
        shapes = getattr(self.model, "shapes", None)
        if shapes is None:
            raise ModelError("shapes: the model has none, so the motion cannot be rebuilt")
        return np.asarray(np.asarray(q) @ shapes.values)

    def response(
        self,
        omega: tuple[float, float],
        direct: float = 0.0,
        parametric: float = 0.0,
        **options: Any,
    ) -> ManifoldResponse:
        """Driven motions over a range of drive frequencies: `nanorom.rom.manifold.response`."""
        return response(self, omega, direct, parametric, **options)

    def motions(self, x: ArrayLike) -> list[Motion]:
        """The free motions of a backbone, in units of the equations; arguments and errors as of
        `backbone`.
        """
        _, largest = self._samples
        unit = self.equations.amplitude
        values = np.atleast_1d(np.asarray(x, dtype=float))
        wrong = values[~((values >= 0) & (values <= largest[-1] * unit))]
        if len(wrong):
            raise ModelError(
                f"x: found {wrong[0]:.4g}; allowed: 0 to {largest[-1] * unit:.4g}, where order "
                f"{self.order} ends; raise the order"
            )
        return [self._reaching(max(float(value) / unit, LEAST)) for value in values]

    def _reaching(self, x: float) -> Motion:
        """The motion whose first master reaches x, by a secant iteration."""
        masters, largest = self._samples
        place = min(max(int(np.searchsorted(largest, x)), 1), len(largest) - 1)
        guess = masters[place] / masters[place][0]
        sizes = [abs(z[0]) for z in masters]
        size, before = float(np.interp(x, largest, sizes)), (0.0, 0.0)
        for _ in range(20):
            _, found = self._at(size, guess * size)
            value = float(found.largest[self.coordinates[0]])
            if abs(value - x) <= 1e-13 * x or size == before[0]:
                break
            slope = (value - before[1]) / (size - before[0])
            before = size, value
            size += (x - value) / slope
        return found


def manifold(
    model: Any,
    masters: Sequence[int | str] = (1,),
    order: int = 7,
    style: str = "normal",
    *,
    direct: str | None = None,
    parametric: str | None = None,
    tolerance: float = TOLERANCE,
    reach: float | None = None,
) -> Reduced:
    """The invariant manifold of some modes: what all others do, as polynomials of these.

    Parameters
    ----------
    model : ReducedModel, or ModalSystem
    masters : numbers or labels of modes (of a system: 1, 2, ... by frequency)
    order : of the polynomials, from 1
    style : "normal" keeps resonant terms in the dynamics of the masters, "real" these and their
        conjugates, "graph" all: the masters' modal coordinates stay what they are
    direct, parametric : names of the drive patterns of a ReducedModel; its first ones if left out
    tolerance : relative error of frequency and motion that `validity` is for
    reach : amplitude in m; the order is raised from `order` until `validity` is as large

    Raises
    ------
    ModelError
        for masters that do not exist, an unknown style, an order out of range, a slave in resonance
        with the masters, modes that do not oscillate, or a reach that no order has.
    """
    if reach is not None:
        options: dict[str, Any] = {"direct": direct, "parametric": parametric}
        options["tolerance"] = tolerance
        return reaching(lambda o: manifold(model, masters, o, style, **options), order, reach)
    check(order, style)
    _check_fields(model, masters, order)
    equations, places, label = equations_of(model, masters, direct, parametric)
    check_size(len(places), equations.size, order)
    shapes = equations.basis.shapes[:, places]
    return Reduced(
        masters=places,
        coordinates=np.abs(shapes).argmax(axis=0),
        order=order,
        style=style,
        label=label,
        equations=equations,
        expansion=expand(equations, places, order, style),
        tolerance=tolerance,
        model=model,
    )


def check(order: int, style: str) -> None:
    """Raise ModelError for an order or a style that no manifold has."""
    if style not in STYLES:
        raise ModelError(f"style: found {style!r}; allowed: {', '.join(STYLES)}")
    if not LOWEST_ORDER <= order <= HIGHEST_ORDER:
        raise ModelError(f"order: found {order}; allowed: {LOWEST_ORDER} to {HIGHEST_ORDER}")


def check_size(masters: int, modes: int, order: int) -> None:
    """Raise ModelError where the polynomials would need too much time or memory."""
    monomials = comb(2 * masters + order, order)
    if monomials > MOST_MONOMIALS:
        raise ModelError(
            f"order: found {order} of {masters} masters, {monomials} monomials; allowed: up to "
            f"{MOST_MONOMIALS}"
        )
    doubles = 2 * monomials * modes**2
    if doubles > MOST_DOUBLES:
        raise ModelError(
            f"order: found {order} of {masters} masters and {modes} modes, which "
            f"needs {8e-9 * doubles:.0f} GB; allowed: up to {8e-9 * MOST_DOUBLES:.1f} GB"
        )


def reaching(made: Callable[[int], Reduced], order: int, reach: float) -> Reduced:
    """The manifold of the lowest order, from one on, whose validity is an amplitude in m.

    Raises ModelError where none is.
    """
    best = 0.0, order
    for higher in range(order, HIGHEST_ORDER + 1, 2):
        found = made(higher)
        if found.validity >= reach:
            return found
        best = max(best, (found.validity, higher))
        if higher - best[1] >= WITHOUT_GAIN:
            break
    raise ModelError(
        f"reach: found {reach:g}; allowed: up to {best[0]:.4g}, by order {best[1]}; higher orders "
        "diverge before"
    )


def _check_fields(model: Any, masters: Sequence[int | str], order: int) -> None:
    """Raise ModelError for what the fields of a model do not know, which are of one manifold."""
    told = getattr(model, "diagnostics", {})
    if ORDER not in told:
        return
    if order > told[ORDER]:
        raise ModelError(
            f"order: found {order}; allowed: up to {told[ORDER]}, for which the fields of this "
            "model were made; reduce the scene again"
        )
    known = str(told[MASTERS]).split()
    for master in masters:
        name = model.label[model._position(master)]
        if name not in known:
            raise ModelError(
                f"masters: found {name}; allowed: {' | '.join(known)}, whose manifold the fields "
                "of this model are of; take these of the scene"
            )


def combination(powers: Sequence[int], names: Sequence[str]) -> str:
    """A combination of the masters' frequencies in words: "2 f01 - f11"."""
    half = len(powers) // 2
    text = ""
    for name, plus, minus in zip(names, powers[:half], powers[half:]):
        count = plus - minus
        if count:
            sign = ("-" if count < 0 else "") if not text else (" - " if count < 0 else " + ")
            text += sign + (f"{abs(count)} " if abs(count) > 1 else "") + name
    return text or "0"


def _turns(frequencies: Array, expansion: Expansion) -> Array:
    """Ratios of frequencies with which all terms of a normal form turn alike."""
    ratios = frequencies / frequencies[0]
    powers, half = expansion.monomials.powers, len(ratios)
    signed = powers[:, :half] - powers[:, half:]
    for parts in range(1, WHOLE + 1):
        whole = np.round(parts * ratios) / parts
        turns = np.where(np.abs(whole - ratios) < NEAR, whole, ratios)
        turning = np.abs(signed @ turns[:, None] - turns) < 1e-9
        if not np.any(expansion.dynamics[:, :half][~turning]):
            return np.asarray(turns)
    raise ModelError(
        "masters: their resonances are none of one common frequency; take fewer masters, or "
        'style="graph"'
    )
