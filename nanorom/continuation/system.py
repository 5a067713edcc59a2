"""The modal equations of motion, from plain arrays in any units.

    M q'' + C q' + K q + A qq + B qqq + D q d(qq)/dt = (direct_level J + parametric_level P q)
    cos(omega t)

Inside the package time is counted in units of the lowest natural frequency and amplitude in units
of the displacement at which the cubic force equals the linear one (`scaled`), so that a diagram
does not depend on the units of the arrays.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from weakref import WeakKeyDictionary

import attrs
import numpy as np

from nanorom.continuation.arrays import checked, finite, nothing, square, times
from nanorom.continuation.drive import CARRIER, Drive, padded, terms
from nanorom.continuation.first_order import FASTEST, FirstOrder, joined, units_of, widened
from nanorom.continuation.scaled import (
    ScaledSystem,
    non_dimensional,
    nonlinear_amplitude,
    over_mass,
)
from nanorom.errors import ContinuationError
from nanorom.types import Array

REAL = 1e-9  # imaginary part of a squared frequency that is round-off
TENSORS = ("damping", "stiffness", "quadratic", "cubic", "cubic_damping")
LEVELS = ("direct", "parametric")


@attrs.frozen(eq=False, init=False)
class ModalSystem:
    """A small polynomial modal system with direct and parametric drive, in any consistent units.

    Parameters
    ----------
    mass : (L, L), (L,) or number, optional
        Modal mass; the identity if left out.
    damping : (L, L), (L,) or number
        Viscous damping C; every mode must lose energy, if only by `cubic_damping` at large
        amplitudes.
    stiffness : (L, L), (L,) or number
        Linear stiffness K, with positive natural frequencies.
    quadratic : (L, L, L), optional
        A[r, j, k]; the force on mode r is sum_jk A[r, j, k] q_j q_k.
    cubic : (L, L, L, L), optional
        B[r, j, k, l]; the force on mode r is sum_jkl B[r, j, k, l] q_j q_k q_l. It need not derive
        from a potential.
    direct : (L,), optional
        J, the force pattern of the direct drive at level 1.
    parametric : (L, L) or (L,), optional
        P, the stiffness pattern of the parametric drive at level 1 (a vector is its diagonal).
    cubic_damping : (L, L, L, L), optional
        D[r, j, k, l]; the force on mode r is sum_jkl D[r, j, k, l] q_l d(q_j q_k)/dt. Kelvin-Voigt:
        D = tau B.
    drives : sequence of Drive, optional
        Further harmonics of the drive, with phases; the two levels multiply them, too.
    states : FirstOrder, optional
        S states of first order beside the modes. Where results have L modes, they follow as
        coordinates L + 1 ... L + S; of each, one multiplier is zero.
    damped : bool, optional
        False lets C be zero, for what needs no damping: backbones, exports, free vibration.

    Raises
    ------
    ContinuationError
        for wrong shapes, NaN, non-positive natural frequencies, zero or negative damping.
    """

    mass: Array
    damping: Array
    stiffness: Array
    quadratic: Array
    cubic: Array
    direct: Array
    parametric: Array
    cubic_damping: Array
    drives: tuple[Drive, ...]
    states: FirstOrder | None

    def __init__(
        self,
        mass: object = None,
        damping: object = None,
        stiffness: object = None,
        quadratic: object = None,
        cubic: object = None,
        direct: object = None,
        parametric: object = None,
        cubic_damping: object = None,
        drives: Sequence[Drive] = (),
        states: FirstOrder | None = None,
        damped: bool = True,
    ) -> None:
        if stiffness is None:
            raise ContinuationError("stiffness: missing; give K as an (L, L) array")
        if damping is None:
            raise ContinuationError("damping: missing; give C as an (L, L) array")
        size = self._size(stiffness, direct, cubic, quadratic)
        if size == 0:
            raise ContinuationError("stiffness: no mode; give K as an (L, L) array")
        shape2, shape3, shape4 = (size,) * 2, (size,) * 3, (size,) * 4
        zero = np.zeros
        self.__attrs_init__(  # type: ignore[attr-defined]
            mass=square(1.0 if mass is None else mass, size, "mass"),
            damping=square(damping, size, "damping"),
            stiffness=square(stiffness, size, "stiffness"),
            quadratic=zero(shape3)
            if quadratic is None
            else checked(quadratic, shape3, "quadratic"),
            cubic=zero(shape4) if cubic is None else checked(cubic, shape4, "cubic"),
            direct=zero(size) if direct is None else checked(direct, (size,), "direct"),
            parametric=zero(shape2)
            if parametric is None
            else square(parametric, size, "parametric"),
            cubic_damping=zero(shape4)
            if cubic_damping is None
            else checked(cubic_damping, shape4, "cubic_damping"),
            drives=tuple(drive.filled(size, states.size if states else 0) for drive in drives),
            states=states,
        )
        self._check()
        if damped:
            self._check_damping()

    @staticmethod
    def _size(*candidates: object) -> int:
        for value in candidates:
            if value is not None and np.ndim(value) >= 1:  # type: ignore[arg-type]
                return int(np.shape(value)[0])  # type: ignore[arg-type]
        return 1

    def _check(self) -> None:
        if self.states is not None and self.states.modes != self.size:
            raise ContinuationError(
                f"states: found coupling to {self.states.modes} modes; allowed {self.size}"
            )
        if np.linalg.eigvalsh((self.mass + self.mass.T) / 2).min() <= 0:
            raise ContinuationError(
                "mass: not positive definite; every modal mass must be positive"
            )
        squares = self.natural_frequencies_squared()
        if squares.min() <= 0:
            raise ContinuationError(
                "stiffness: a natural frequency is zero, imaginary or complex; "
                "expand about a stable equilibrium"
            )

    def _check_damping(self) -> None:
        losses = np.linalg.solve(self.mass, self.damping)
        if np.diag(losses).min() <= 0 or np.linalg.eigvals(losses).real.min() <= 0:
            if self._limits_itself(losses):
                return
            raise ContinuationError(
                "damping: zero or negative for at least one mode; "
                "a steady response needs every mode damped (a quality factor, say), or positive "
                "cubic_damping in its place"
            )

    def _limits_itself(self, losses: Array) -> bool:
        """Whether cubic damping takes energy out of every motion that linear damping feeds."""
        values, vectors = np.linalg.eigh((losses + losses.T) / 2)
        cubic = np.tensordot(np.linalg.inv(self.mass), self.cubic_damping, axes=1)
        fed = [*vectors.T[values <= 0], *np.eye(self.size)[np.diag(losses) <= 0]]
        return all(float(np.einsum("rjkl,r,j,k,l->", cubic, v, v, v, v)) > 0 for v in fed)

    def natural_frequencies_squared(self) -> Array:
        """Eigenvalues (L,) of M^-1 K, ascending, in rad^2 per squared unit of time.

        Negative where they are not real and positive.
        """
        values = np.linalg.eigvals(np.linalg.solve(self.mass, self.stiffness))
        bad = np.abs(values.imag) > REAL * np.abs(values)
        return np.sort(np.where(bad, -np.abs(values), values.real))

    @property
    def size(self) -> int:
        """Number of modes L."""
        return int(self.stiffness.shape[0])

    @property
    def direct_drive(self) -> Array:
        """Force patterns (L + S, 2K + 1) at direct level 1, in the units of `direct`, by the terms
        1, cos(omega t), sin, cos(2 omega t), ...; the last rows are what feeds the states.
        """
        return self.direct_at(1.0)

    def direct_at(self, level: float) -> Array:
        """The same (L + S, 2K + 1) per unit of a level."""
        own = terms(self.drives, "direct", self.direct, level)
        count = self.states.size if self.states else 0
        return np.concatenate([own, terms(self.drives, "states", np.zeros(count), level)])

    @property
    def proportional(self) -> bool:
        """All of the drive goes with its levels, none of it with a power of them."""
        return all(drive.power == 1 for drive in self.drives)

    def check_proportional(self) -> None:
        """Raise ContinuationError if a level is no factor on the drive."""
        if not self.proportional:
            raise ContinuationError(
                "drives: found one of a power of the level; allowed here: power 1, as the level is "
                "varied as a factor"
            )

    @property
    def parametric_drive(self) -> Array:
        """Stiffness patterns (L, L, 2K + 1) at parametric level 1, in the units of `parametric`, by
        the terms of `direct_drive`.
        """
        return self.parametric_at(1.0)

    def parametric_at(self, level: float) -> Array:
        """The same (L, L, 2K + 1) per unit of a level."""
        return terms(self.drives, "parametric", self.parametric, level)

    def arrays(self) -> dict[str, Array]:
        """All arrays of the equations by name, in the shapes and units of their fields;
        those of the states as "states.rate" (S, S), ...
        """
        own = {name: getattr(self, name) for name in ("mass", *TENSORS)}
        own |= {"direct": self.direct_drive, "parametric": self.parametric_drive}
        if self.states is not None:
            states = attrs.asdict(self.states, recurse=False)
            own |= {f"states.{name}": array for name, array in states.items()}
        return own

    def scaled(self, direct: float = 0.0, parametric: float = 0.0) -> ScaledSystem:
        """The equations at given drive levels (in units of the patterns), made non-dimensional.

        Raises ContinuationError for levels or a damping that do not do.
        """
        for name, level in (("direct", direct), ("parametric", parametric)):
            if not finite(level):
                raise ContinuationError(f"{name}: drive level {level!r} is not a finite number")
        if direct or parametric:
            self._check_damping()
        frequency = float(np.sqrt(self.natural_frequencies_squared()[0]))
        if self in _scaled:  # the tensors are large, and the same at all levels
            return self._driven(_scaled[self], direct, parametric)
        arrays = self._at_levels(direct, parametric, frequency)
        amplitude = nonlinear_amplitude(self._of_modes(arrays), frequency)
        system = non_dimensional(arrays, frequency, amplitude, self.size)
        if self.states is None:
            if system.cubic.any() or system.quadratic.any():  # the units depend on no level
                _scaled[self] = system
            return system
        units = units_of(system.stiffness, system.quadratic, system.force, self.size)
        self._check_states(system)
        return system.turned(np.diag(units))

    def _driven(self, system: ScaledSystem, direct: float, parametric: float) -> ScaledSystem:
        """Scaled equations of this system, at other levels."""
        inverse, columns = np.linalg.inv(self.mass), system.force.shape[-1]
        over = {
            "force": (direct * self.direct_at(direct), system.amplitude * system.frequency**2),
            "parametric": (parametric * self.parametric_at(parametric), system.frequency**2),
        }
        patterns = {
            name: times(padded(np.tensordot(inverse, pattern, axes=1), columns), 1 / unit)
            for name, (pattern, unit) in over.items()
        }
        return replace(system, **patterns)

    def _at_levels(self, direct: float, parametric: float, frequency: float) -> dict[str, Array]:
        """The arrays of modes and states over their mass."""
        arrays = {name: getattr(self, name) for name in TENSORS}
        arrays["direct"] = direct * self.direct_at(direct)
        arrays["parametric"] = parametric * self.parametric_at(parametric)
        over = self._over_mass(arrays, frequency)
        return over if self.states is None else joined(over, self.states, self.mass, frequency)

    def _over_mass(self, arrays: Mapping[str, Array], frequency: float) -> dict[str, Array]:
        """Arrays over the mass, widened by zeros for the states but for what feeds these."""
        size = self.size
        feeds = frequency * arrays["direct"][size:]
        columns = max(arrays[name].shape[-1] for name in LEVELS)
        over = over_mass(self.mass, {**arrays, "direct": arrays["direct"][:size]})
        over |= {name: padded(over[name], columns) for name in LEVELS}
        over = widened(over, len(feeds))
        over["direct"][size:] = padded(feeds, columns)
        return over

    def _of_modes(self, arrays: Mapping[str, Array]) -> dict[str, Array]:
        """Of arrays over the mass, those of the modes, with what the states add to their tensors
        if they follow at once.
        """
        modes = slice(self.size)
        own = {name: a[(modes,) * (a.ndim - (name in LEVELS))] for name, a in arrays.items()}
        if self.states is not None:
            inverse = np.linalg.inv(self.mass)
            for name, added in zip(("stiffness", "quadratic", "cubic"), self.states.condensed()):
                own[name] = own[name] + np.tensordot(inverse, added, axes=1)
        return own

    def _check_states(self, system: ScaledSystem) -> None:
        highest = float(np.sqrt(np.abs(system.restrict(np.arange(self.size)).stiffness).max()))
        if system.fastest > FASTEST * max(highest, 1.0):
            raise ContinuationError(
                f"states.rate: a state relaxes more than {FASTEST:g} times faster than the fastest "
                "mode moves; let it follow at once, by condensed() of the system"
            )

    def condensed(self) -> ModalSystem:
        """The system without its states of first order, as if they followed the modes at once:
        where they relax much faster than anything moves.

        Raises ContinuationError where a drive of the states modulates a stiffness: at which level
        is then not to be told.
        """
        if self.states is None:
            return self
        stiffness, quadratic, cubic, force, stretch = self.states.condensed()
        if any(np.any(stretch @ drive.states) for drive in self.drives):
            raise ContinuationError(
                "drives.states: found states that modulate a stiffness; give what they do as "
                "drives.parametric"
            )
        drives = [
            attrs.evolve(drive, direct=drive.direct + force @ drive.states, states=None)
            for drive in self.drives
        ]
        return attrs.evolve(
            self,
            stiffness=self.stiffness + stiffness,
            quadratic=self.quadratic + quadratic,
            cubic=self.cubic + cubic,
            drives=drives,
            states=None,
        )

    def change(self, arrays: Mapping[str, object], unit: ScaledSystem) -> ScaledSystem:
        """What arrays of the names damping ... cubic_damping, added to those of this system, add to
        its scaled equations `unit`; direct and parametric forces at level 1, patterns of
        cos(omega t) or with a last axis of all terms of the drive.

        Raises ContinuationError for another name or a wrong shape.
        """
        columns = unit.force.shape[-1]
        added = {name: nothing(getattr(self, name).shape) for name in TENSORS}
        added["direct"] = np.zeros((unit.size, columns))
        added["parametric"] = np.zeros((self.size, self.size, columns))
        for name, value in arrays.items():
            if name not in added:
                raise ContinuationError(f"{name}: no array of {', '.join(sorted(added))}")
            if name in LEVELS:
                added[name] += self._pattern(value, added[name].shape, name)
            elif added[name].ndim == 2:
                added[name] = square(value, self.size, name)
            else:
                added[name] = checked(value, added[name].shape, name)
        over = self._over_mass(added, unit.frequency)
        return unit.changed(non_dimensional(over, unit.frequency, unit.amplitude, self.size))

    def _pattern(self, value: object, shape: tuple[int, ...], name: str) -> Array:
        """A pattern of cos(omega t), or of all terms, as one of all terms (and states)."""
        if np.ndim(value) == len(shape) and np.shape(value)[0] == shape[0]:  # type: ignore[arg-type]
            return checked(padded(np.asarray(value), shape[-1]), shape, name)
        modes = square(value, self.size, name) if len(shape) == 3 else None
        pattern = checked(value, (self.size,), name) if modes is None else modes
        result = np.zeros(shape)
        result[(slice(self.size),) * (len(shape) - 1) + (CARRIER,)] = pattern
        return result

    def towards(
        self, other: ModalSystem, unit: ScaledSystem, direct: float = 0.0, parametric: float = 0.0
    ) -> ScaledSystem:
        """What another system has more than this one, both at the same levels, in the scaled
        equations `unit` of this one.

        Raises ContinuationError for another number of modes, states or harmonics, or another mass.
        """
        mine, theirs = (
            system._at_levels(direct, parametric, unit.frequency) for system in (self, other)
        )
        for name, array in mine.items():
            if theirs[name].shape != array.shape:
                raise ContinuationError(
                    f"parameter: {name} of shape {theirs[name].shape}; allowed {array.shape}"
                )
        if not np.array_equal(self.mass, other.mass):
            raise ContinuationError("parameter: another mass; allowed the same one")
        more = {name: theirs[name] - array for name, array in mine.items()}
        return unit.changed(non_dimensional(more, unit.frequency, unit.amplitude, self.size))


_scaled: WeakKeyDictionary[ModalSystem, ScaledSystem] = WeakKeyDictionary()
