"""The modal equations of motion, from plain arrays in any units, and their scaled form.

    M q'' + C q' + K q + A qq + B qqq + D q d(qq)/dt = (direct_level J + parametric_level P q)
    cos(omega t)

Inside the package time is counted in units of the lowest natural frequency and amplitude in units
of the displacement at which the cubic force equals the linear one, so that a diagram does not
depend on the units of the arrays.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import attrs
import numpy as np

from nanorom.errors import ContinuationError
from nanorom.types import Array, Numbers

BITS = 43
REAL = 1e-9  # imaginary part of a squared frequency that is round-off
TENSORS = ("damping", "stiffness", "quadratic", "cubic", "cubic_damping")


def finite(value: object) -> bool:
    """Whether a value is one finite real number."""
    try:
        return bool(np.isfinite(float(value)))  # type: ignore[arg-type]
    except (TypeError, ValueError):  # no number
        return False


def without_round_off(values: Array | float) -> Array:
    """The first 43 bits (13 digits) of every number.

    Systems that differ by their units alone become the same to the last bit, and so do their
    diagrams: at a threshold, round-off would otherwise change the steps taken.
    """
    if not np.any(values):
        return np.asarray(values, dtype=float)
    mantissa, exponent = np.frexp(values)
    return np.asarray(np.ldexp(np.round(np.ldexp(mantissa, BITS)), exponent - BITS))


def _array(value: object, shape: tuple[int, ...], name: str) -> Array:
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise ContinuationError(f"{name}: not an array of real numbers") from None
    if array.shape != shape:
        raise ContinuationError(f"{name}: shape {array.shape}, expected {shape}")
    if not np.all(np.isfinite(array)):
        raise ContinuationError(
            f"{name}: contains NaN or infinite entries; check the reduction it comes from"
        )
    return array


def _matrix(value: object, size: int, name: str) -> Array:
    """A square matrix from a matrix, a diagonal or one number for all modes."""
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise ContinuationError(f"{name}: not an array of real numbers") from None
    if array.ndim == 0:
        array = np.full(size, float(array))
    if array.ndim == 1 and array.shape == (size,):
        array = np.diag(array)
    return _array(array, (size, size), name)


def symmetrise_quadratic(tensor: Array) -> Array:
    """A[r, j, k] averaged over the order of j, k: the force A qq is unchanged."""
    return (tensor + tensor.transpose(0, 2, 1)) / 2


def symmetrise_cubic(tensor: Array) -> Array:
    """B[r, j, k, l] averaged over the order of j, k, l: the force B qqq is unchanged."""
    total = tensor + tensor.transpose(0, 1, 3, 2)
    for order in ((0, 2, 1, 3), (0, 2, 3, 1), (0, 3, 1, 2), (0, 3, 2, 1)):
        total += tensor.transpose(order)
    total /= 6
    return np.asarray(total)


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
            mass=_matrix(1.0 if mass is None else mass, size, "mass"),
            damping=_matrix(damping, size, "damping"),
            stiffness=_matrix(stiffness, size, "stiffness"),
            quadratic=zero(shape3) if quadratic is None else _array(quadratic, shape3, "quadratic"),
            cubic=zero(shape4) if cubic is None else _array(cubic, shape4, "cubic"),
            direct=zero(size) if direct is None else _array(direct, (size,), "direct"),
            parametric=zero(shape2)
            if parametric is None
            else _matrix(parametric, size, "parametric"),
            cubic_damping=zero(shape4)
            if cubic_damping is None
            else _array(cubic_damping, shape4, "cubic_damping"),
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
        arrays = {name: getattr(self, name) for name in TENSORS}
        arrays["direct"], arrays["parametric"] = direct * self.direct, parametric * self.parametric
        arrays = _over_mass(self.mass, arrays)
        return _non_dimensional(arrays, frequency, _nonlinear_amplitude(arrays, frequency))

    def change(self, arrays: Mapping[str, object], unit: ScaledSystem) -> ScaledSystem:
        """What arrays of the names damping ... cubic_damping, added to those of this system, add to
        its scaled equations `unit`; direct and parametric forces at level 1.

        Raises ContinuationError for another name or a wrong shape.
        """
        added: dict[str, Array] = {}
        for name in (*TENSORS, "direct", "parametric"):
            shape = getattr(self, name).shape
            if name not in arrays:
                added[name] = np.zeros(shape)
            elif len(shape) == 2:
                added[name] = _matrix(arrays[name], self.size, name)
            else:
                added[name] = _array(arrays[name], shape, name)
        unknown = sorted(set(arrays) - set(added))
        if unknown:
            raise ContinuationError(f"{unknown[0]}: no array of {', '.join(sorted(added))}")
        return _non_dimensional(_over_mass(self.mass, added), unit.frequency, unit.amplitude)


def _over_mass(mass: Array, arrays: Mapping[str, Array]) -> dict[str, Array]:
    """The arrays of the equations divided by the mass, symmetric where they act symmetrically."""
    inverse = np.linalg.inv(mass)
    divided = {
        # zeros, most often: they stay memory that is not touched
        name: np.tensordot(inverse, array, axes=1) if array.any() else np.zeros(array.shape)
        for name, array in arrays.items()
    }
    divided["quadratic"] = symmetrise_quadratic(divided["quadratic"])
    divided["cubic"] = symmetrise_cubic(divided["cubic"])
    loss = divided.pop("cubic_damping")
    if loss.any():
        loss = loss + loss.transpose(0, 2, 1, 3)
        # loss[r, k, j, l] multiplies q_j q_l dq_k/dt; only its part symmetric in j, l acts
        loss = (loss + loss.transpose(0, 1, 3, 2)) / 2
    divided["loss"] = loss
    return divided


def _non_dimensional(
    arrays: Mapping[str, Array], frequency: float, amplitude: float
) -> ScaledSystem:
    return ScaledSystem(
        frequency=frequency,
        amplitude=amplitude,
        damping=without_round_off(arrays["damping"] / frequency),
        stiffness=without_round_off(arrays["stiffness"] / frequency**2),
        quadratic=without_round_off(arrays["quadratic"] * (amplitude / frequency**2)),
        cubic=without_round_off(arrays["cubic"] * (amplitude / frequency) ** 2),
        loss=without_round_off(arrays["loss"] * (amplitude**2 / frequency)),
        force=without_round_off(arrays["direct"] / (amplitude * frequency**2)),
        parametric=without_round_off(arrays["parametric"] / frequency**2),
    )


def _nonlinear_amplitude(arrays: Mapping[str, Array], frequency: float) -> float:
    """The displacement at which the nonlinear force reaches the linear one (of the forced response
    if linear).
    """
    stiffness, quadratic, cubic = (arrays[name] for name in ("stiffness", "quadratic", "cubic"))
    modes = np.arange(len(stiffness))
    diagonal = np.abs(cubic[modes, modes, modes, modes])
    squares = np.abs(np.diag(stiffness))
    if diagonal.max() > 0:
        return float(np.sqrt((squares[diagonal > 0] / diagonal[diagonal > 0]).max()))
    if np.abs(cubic).max() > 0:
        return float(frequency / np.sqrt(np.abs(cubic).max()))
    if np.abs(quadratic).max() > 0:
        return float(frequency**2 / np.abs(quadratic).max())
    return float(np.abs(arrays["direct"]).max() / frequency**2) or 1.0


@dataclass(frozen=True, eq=False)
class ScaledSystem:
    """q'' + C q' + K q + A qq + B qqq + W(q, q) q' = (f + P q) cos(omega t), non-dimensional, unit
    mass.

    `quadratic` is symmetric in its last two and `cubic` in its last three indices; `loss[r, k, j,
    l]` gives W_rk = sum_jl loss[r, k, j, l] q_j q_l. `frequency` and `amplitude` are the units of
    1/time and displacement.
    """

    frequency: float
    amplitude: float
    damping: Array
    stiffness: Array
    quadratic: Array
    cubic: Array
    loss: Array
    force: Array
    parametric: Array
    shapes: Array | None = None  # (L, L): of the model, by those of the equations (columns)

    @property
    def size(self) -> int:
        return len(self.force)

    def given(self, motion: Array) -> Array:
        """A motion (..., L) of these equations in the coordinates and units of the model."""
        own = motion if self.shapes is None else motion @ self.shapes.T
        return np.asarray(own * self.amplitude)

    def inner(self, motion: Array) -> Array:
        """A motion (..., L) of the model in the coordinates and units of these equations."""
        own = motion if self.shapes is None else np.linalg.solve(self.shapes, motion.T).T
        return np.asarray(own / self.amplitude)

    @property
    def nonlinear(self) -> bool:
        return bool(self.quadratic.any() or self.cubic.any() or self.loss.any())

    def plus(self, change: ScaledSystem, factor: float) -> ScaledSystem:
        """The equations with `factor` times a change of all their arrays."""
        return replace(
            self,
            **{name: getattr(self, name) + factor * getattr(change, name) for name in ARRAYS},
        )

    def times(self, factor: float) -> ScaledSystem:
        """A change of all arrays, `factor` times as large."""
        return replace(self, **{name: factor * getattr(self, name) for name in ARRAYS})

    def pattern(self) -> ScaledSystem:
        """The same entries without their signs: what may act on what."""
        return replace(self, **{name: np.abs(getattr(self, name)) for name in ARRAYS})

    def restrict(self, modes: Numbers) -> ScaledSystem:
        """The same equations with every mode outside `modes` at rest."""
        m = np.asarray(modes)
        if len(m) == self.size:
            return self
        return ScaledSystem(
            self.frequency,
            self.amplitude,
            self.damping[np.ix_(m, m)],
            self.stiffness[np.ix_(m, m)],
            self.quadratic[np.ix_(m, m, m)],
            self.cubic[np.ix_(m, m, m, m)],
            self.loss[np.ix_(m, m, m, m)],
            self.force[m],
            self.parametric[np.ix_(m, m)],
        )


UNITS = ("frequency", "amplitude", "shapes")
ARRAYS = tuple(f.name for f in fields(ScaledSystem) if f.name not in UNITS)
