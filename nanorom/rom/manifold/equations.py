"""The equations of motion that a manifold is of, from a model of modes, in units of their own."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import attrs
import numpy as np

from nanorom.errors import ModelError
from nanorom.rom import tensors
from nanorom.rom.manifold.basis import Basis, basis
from nanorom.rom.manifold.forces import PolynomialForces
from nanorom.rom.manifold.monomials import Index, Monomials
from nanorom.types import Array

UNITS = "units"  # key of a field's metadata


def _scaled(displacement: int, time: int) -> Any:
    """A field that is divided by the mass and these powers of the units of displacement and
    1/time.
    """
    return attrs.field(metadata={UNITS: (displacement, time)})


@attrs.frozen(eq=False, slots=False)
class Equations:
    """Equations of L modes, all arrays over one modal mass and non-dimensional.

    frequency, amplitude: the units of 1/time and displacement; direct (L,), parametric (L, L):
    amplitudes of cos(omega t) at level 1 of either drive.
    """

    frequency: float
    amplitude: float
    basis: Basis
    mass: Array
    damping: Array = _scaled(0, 1)
    stiffness: Array = _scaled(0, 2)
    quadratic: Array = _scaled(-1, 2)
    cubic: Array = _scaled(-2, 2)
    cubic_damping: Array = _scaled(-2, 1)
    direct: Array = _scaled(1, 2)
    parametric: Array = _scaled(0, 2)

    @classmethod
    def of(cls, arrays: dict[str, Array], frequency: float, amplitude: float) -> Equations:
        """From arrays of a system in any units; raises ModelError for modes that do not do."""
        mass = float(arrays["mass"][0, 0])
        own = {"mass": arrays["mass"] / mass}
        for name in SCALED:
            x, t = getattr(attrs.fields(cls), name).metadata[UNITS]
            own[name] = arrays[name] / (mass * amplitude**x * frequency**t)
        own["cubic"] = tensors.symmetrise(own["cubic"])
        linear = basis(own["mass"], own["damping"], own["stiffness"])
        return cls(frequency, amplitude, basis=linear, **own)

    def undamped(self) -> Equations:
        """The same without damping."""
        zero = np.zeros_like
        return attrs.evolve(
            self,
            damping=zero(self.damping),
            cubic_damping=zero(self.cubic_damping),
            basis=basis(self.mass, zero(self.damping), self.stiffness),
        )

    def of_modes(self, places: Index) -> Equations:
        """The same of some modes alone, as if the others were held."""
        own: dict[str, Array] = {}
        for field in attrs.fields(type(self)):
            array = getattr(self, field.name)
            if isinstance(array, np.ndarray):
                own[field.name] = array[np.ix_(*(places,) * array.ndim)]
        linear = basis(own["mass"], own["damping"], own["stiffness"])
        return Equations(self.frequency, self.amplitude, basis=linear, **own)

    @property
    def size(self) -> int:
        """Number of modes L."""
        return len(self.mass)

    def forces(self, monomials: Monomials) -> PolynomialForces:
        return PolynomialForces(monomials, self.quadratic, self.cubic, self.cubic_damping)

    def nonlinear_force(self, q: Array, speed: Array) -> Array:
        """N(q, q') (..., L) at places (..., L)."""
        size = self.size
        first, second = np.triu_indices(size)
        pairs = q[..., first] * q[..., second]
        quadratic, cubic, loss = self._by_pairs
        secant = pairs @ cubic
        if self.cubic_damping.any():
            rates = q[..., first] * speed[..., second] + speed[..., first] * q[..., second]
            secant += rates @ loss
        secant = secant.reshape(*q.shape, size)
        return np.asarray(pairs @ quadratic + np.einsum("...rl,...l->...r", secant, q))

    @cached_property
    def _by_pairs(self) -> tuple[Array, Array, Array]:
        """A (pairs j <= k, L), B and D (pairs, L * L), each for the sum of both orders."""
        size = self.size
        first, second = np.triu_indices(size)
        weight = np.where(first == second, 0.5, 1.0)[:, None]
        found = []
        for tensor in (self.quadratic, self.cubic, self.cubic_damping):
            pairs = tensor + tensor.swapaxes(1, 2)
            rows = np.moveaxis(pairs[:, first, second], 0, 1).reshape(len(first), -1)
            found.append(np.ascontiguousarray(weight * rows))
        return found[0], found[1], found[2]


SCALED = tuple(field.name for field in attrs.fields(Equations) if UNITS in field.metadata)


def equations_of(
    model: Any, masters: Sequence[int | str], direct: str | None, parametric: str | None
) -> tuple[Equations, Index, tuple[str, ...]]:
    """Equations, places of the masters among their modes, and the names of the modes.

    model : ReducedModel, masters by number or label; or ModalSystem, masters 1, 2, ... by
    frequency.  Raises ModelError.
    """
    reduced = hasattr(model, "label")
    if not reduced and not hasattr(model, "stiffness"):
        raise ModelError(
            f"manifold: found a {type(model).__name__}; allowed: a ReducedModel, a ModalSystem, a "
            "Scene, or the file of a model or a scene"
        )
    arrays = _of_model(model, direct, parametric) if reduced else _of_system(model)
    squares = np.linalg.eigvals(np.linalg.solve(arrays["mass"], arrays["stiffness"]))
    if np.any(squares.real <= 0):
        raise ModelError("manifold: the model is not about a stable state; a stiffness is negative")
    linear = basis(arrays["mass"], 0 * arrays["damping"], arrays["stiffness"])
    if reduced:
        coordinates = [model._position(master) for master in masters]
        places = [int(np.abs(linear.shapes[c, : len(squares)]).argmax()) for c in coordinates]
        label = model.label
    else:
        places = [_by_frequency(linear, master) for master in masters]
        label = tuple(f"mode {number + 1}" for number in range(len(squares)))
    if not places or len(set(places)) < len(places):
        raise ModelError(f"masters: found {list(masters)}; allowed: one or more different modes")
    frequency = float(linear.rates[places[0]].imag)
    place = int(np.abs(linear.shapes[:, places[0]]).argmax())
    amplitude = displacement_unit(arrays["stiffness"], arrays["quadratic"], arrays["cubic"], place)
    return Equations.of(arrays, frequency, amplitude), np.array(places), label


def _of_model(model: Any, direct: str | None, parametric: str | None) -> dict[str, Array]:
    """Arrays of a ReducedModel; of drives, those of the names or its first ones."""
    arrays = {name: getattr(model, name) for name in SCALED if hasattr(model, name)}
    arrays["mass"] = np.diag(model.mass)
    arrays["cubic"] = model.cubic_of(True)
    if model.cubic_damping is None:
        arrays["cubic_damping"] = np.zeros_like(model.cubic)
    direct = direct or next(iter(model.drive), None)
    parametric = parametric or next(iter(model.parametric), None)
    zero = np.zeros(model.size), np.zeros((model.size, model.size))
    if direct is None:
        found = zero
    elif parametric is None:
        found = model.drive[direct] if direct in model.drive else zero[0], zero[1]
    else:
        found = model.patterns(direct, parametric)
    arrays["direct"], arrays["parametric"] = found
    return arrays


def _of_system(system: Any) -> dict[str, Array]:
    if system.states is not None or system.drives:
        raise ModelError(
            "manifold: found states of first order or drives of other harmonics; allowed: a system "
            "without (condensed() lets states follow at once)"
        )
    return {name: getattr(system, name) for name in ("mass", *SCALED)}


def _by_frequency(linear: Basis, master: int | str) -> int:
    if not isinstance(master, int) or not 1 <= master <= linear.size:
        raise ModelError(f"masters: found {master!r}; allowed: numbers from 1 to {linear.size}")
    return int(np.argsort(linear.rates[: linear.size].imag, kind="stable")[master - 1])


def displacement_unit(stiffness: Array, quadratic: Array, cubic: Array, place: int) -> float:
    """The displacement of a mode at which its cubic (or the quadratic) force equals the linear."""
    linear = abs(float(stiffness[place, place]))
    own = float(np.abs(cubic[place, place, place, place]))
    own = own or float(np.abs(cubic).max(initial=0.0))
    if own > 0:
        return float(np.sqrt(linear / own))
    largest = float(np.abs(quadratic).max(initial=0.0))
    return linear / largest if largest > 0 else 1.0
