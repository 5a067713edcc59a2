"""The reduced model: modal matrices and tensors, the forces they give, and the file `rom.h5`.

    M q'' + C q' + K q + A qq + B qqq = F(t, q)

q in m, forces in N. The nonlinear force is eta_r = sum_jk A[r,j,k] q_j q_k +
sum_jkl B[r,j,k,l] q_j q_k q_l, of Keskekler et al., eq. 3, with symmetric tensors.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import attrs
import numpy as np
from numpy.typing import ArrayLike, NDArray

from nanorom.errors import ModelError
from nanorom.rom import tensors
from nanorom.rom.arrays import (
    as_array,
    as_arrays,
    as_copy,
    as_integers,
    as_names,
    as_optional,
    as_tensor,
    expect,
)
from nanorom.rom.shapes import Shapes
from nanorom.scene.excitation import Damping
from nanorom.types import Array

if TYPE_CHECKING:
    from nanorom.continuation import ModalSystem

UNSORTED = 1e-6  # relative; degenerate frequencies may stand in either order
ASYMMETRIC = 1e-6  # a stiffness, mass or damping matrix beyond this is a mistake
OPTIONAL = {"bending": 2, "stretching": 4, "cubic_damping": 4}  # number of mode indices


class Coefficient(NamedTuple):
    """One coefficient of the paper: b_jkl of equation r, indices 1-based within the model."""

    equation: int
    indices: tuple[int, ...]
    value: float


@attrs.frozen(eq=False, kw_only=True)
class ReducedModel:
    """A modal model of L modes in SI units, valid by construction; raises ModelError.

    Parameters
    ----------
    frequency : (L,) Hz, sorted.
    mass : (L,) kg, modal masses for shapes with max |phi| = 1.
    label : L mode names; number : (L,) positions among all modes, 1-based.
    stiffness, damping : (L, L) N/m and kg/s.
    quadratic, cubic : (L, L, L) N/m^2 and (L, L, L, L) N/m^3.
    drive, parametric : force patterns J (L,) and P (L, L) by name, per unit of their level; the
        modal force is (direct J + parametric P q) cos(omega t).
    shapes : mode shapes, if known.
    bending, stretching : (L, L) N/m and (L, L, L, L) N/m^3, parts of the force that a viscoelastic
        material damps, if known: stretching[r, j, k, l] is the force on mode r from the slope of
        mode l and the stress of the pair jk. Symmetrised, stretching is the cubic tensor.
    cubic_damping : (L, L, L, L) N s/m^3, force sum_jkl D[r,j,k,l] q_l d(q_j q_k)/dt.
    static : the state about which the model is expanded, by name; empty for a flat film.
    diagnostics : what the reduction reports about itself; scene : its TOML text.
    """

    frequency: Array = attrs.field(converter=as_array)
    mass: Array = attrs.field(converter=as_array)
    label: tuple[str, ...] = attrs.field(converter=as_names)
    number: NDArray[np.int64] = attrs.field(converter=as_integers)
    stiffness: Array = attrs.field(converter=as_array)
    damping: Array = attrs.field(converter=as_array)
    quadratic: Array = attrs.field(converter=as_tensor)
    cubic: Array = attrs.field(converter=as_tensor)
    drive: dict[str, Array] = attrs.field(converter=as_arrays, factory=dict)
    parametric: dict[str, Array] = attrs.field(converter=as_arrays, factory=dict)
    shapes: Shapes | None = None
    bending: Array | None = attrs.field(converter=as_optional, default=None)
    stretching: Array | None = attrs.field(converter=as_optional, default=None)
    cubic_damping: Array | None = attrs.field(converter=as_optional, default=None)
    static: dict[str, Array] = attrs.field(converter=as_arrays, factory=dict)
    diagnostics: dict[str, Any] = attrs.field(converter=as_copy, factory=dict)
    scene: str = ""
    method: str = ""
    in_plane: str = ""
    versions: dict[str, str] = attrs.field(converter=as_copy, factory=dict)

    def __attrs_post_init__(self) -> None:
        n = self.size
        if n == 0:
            raise ModelError("frequency: the model has no modes")
        expected: dict[str, tuple[int, ...]] = {"frequency": (n,), "mass": (n,), "number": (n,)}
        expected |= {"stiffness": (n, n), "damping": (n, n)}
        expected |= {"quadratic": (n,) * 3, "cubic": (n,) * 4}
        for name, shape in expected.items():
            expect(name, getattr(self, name), shape)
        for name, rank in OPTIONAL.items():
            if getattr(self, name) is not None:
                expect(name, getattr(self, name), (n,) * rank)
        for name, pattern in self.drive.items():
            expect(f"drive/{name}", pattern, (n,))
        for name, pattern in self.parametric.items():
            expect(f"parametric/{name}", pattern, (n, n))
        if self.shapes is not None:
            expect("shapes/values", self.shapes.values, (n, len(self.shapes.points)))
        if len(self.label) != n:
            raise ModelError(f"label: found {len(self.label)} names for {n} modes")
        if (self.mass <= 0).any() or (self.frequency <= 0).any():
            raise ModelError("mass, frequency: found a value that is not greater than 0")
        if (np.diff(self.frequency) < -UNSORTED * self.frequency[1:]).any():
            raise ModelError("frequency: not sorted")
        if (self.number < 1).any() or len(set(self.number.tolist())) < n:
            raise ModelError("number: found a mode number below 1 or twice the same")
        for name in ("stiffness", "damping"):
            if tensors.asymmetry(getattr(self, name)) > ASYMMETRIC:
                raise ModelError(f"{name}: the matrix is not symmetric")

    @property
    def size(self) -> int:
        """Number of modes L."""
        return len(self.frequency)

    @property
    def asymmetry(self) -> float:
        """How far the tensors are from those of a potential, relative to their largest entry."""
        return max(tensors.asymmetry(self.quadratic), tensors.asymmetry(self.cubic))

    def nonlinear_forces(self, q: ArrayLike) -> Array:
        """eta(q) in N, (..., L), of amplitudes q in m, (..., L)."""
        q = self._amplitudes(q)
        secant = q @ self._matrix(self.quadratic) + self._products(q) @ self._matrix(self.cubic)
        return np.einsum("...rj,...j->...r", secant.reshape(*q.shape, self.size), q)

    def forces(self, q: ArrayLike) -> Array:
        """Restoring force K q + eta(q) in N, (..., L), of amplitudes q in m, (..., L)."""
        q = self._amplitudes(q)
        return q @ self.stiffness.T + self.nonlinear_forces(q)

    def jacobian(self, q: ArrayLike) -> Array:
        """Tangent stiffness d forces / d q in N/m, (..., L, L), at amplitudes q in m, (..., L)."""
        q = self._amplitudes(q)
        tangent = 2 * (q @ self._matrix(self.quadratic))
        tangent += 3 * (self._products(q) @ self._matrix(self.cubic))
        return self.stiffness + tangent.reshape(*q.shape, self.size)

    def energy(self, q: ArrayLike) -> Array:
        """Elastic energy in J, (...), of amplitudes q in m, (..., L).

        Its gradient is the restoring force where the tensors derive from a potential.
        """
        q = self._amplitudes(q)
        secant = self.stiffness / 2 + (
            (q @ self._matrix(self.quadratic)) / 3
            + (self._products(q) @ self._matrix(self.cubic)) / 4
        ).reshape(*q.shape, self.size)
        return np.asarray(np.einsum("...r,...rj,...j->...", q, secant, q))

    def _amplitudes(self, q: ArrayLike) -> Array:
        q = np.asarray(q, dtype=float)
        if q.ndim == 0 or q.shape[-1] != self.size:
            raise ModelError(
                f"amplitudes: found shape {q.shape}; the last axis is the {self.size} modes"
            )
        return q

    def _matrix(self, tensor: Array) -> Array:
        """The tensor with (r, j) as columns and the remaining indices as rows."""
        return tensor.reshape(self.size**2, -1).T

    def _products(self, q: Array) -> Array:
        return (q[..., :, None] * q[..., None, :]).reshape(*q.shape[:-1], self.size**2)

    def alpha(self, r: int) -> dict[tuple[int, int], float]:
        """The paper's alpha_jk of equation r in N/m^2, keys (j, k) with j <= k, 1-based."""
        return self._paper(self.quadratic, r)

    def b(self, r: int) -> dict[tuple[int, int, int], float]:
        """The paper's b_jkl of equation r in N/m^3, keys (j, k, l) with j <= k <= l, 1-based."""
        return self._paper(self.cubic, r)

    def _paper(self, tensor: Array, r: int) -> dict[Any, float]:
        if not 1 <= r <= self.size:
            raise ModelError(f"equation: found {r}; allowed: 1 to {self.size}")
        force = tensor[r - 1]
        return {
            tuple(i + 1 for i in indices): orders * float(force[indices])
            for indices, orders in tensors.monomials(self.size, force.ndim)
        }

    def coefficients(self) -> Iterator[Coefficient]:
        """Every alpha_jk, then every b_jkl, equation by equation."""
        for tensor in (self.quadratic, self.cubic):
            for r in range(1, self.size + 1):
                for indices, value in self._paper(tensor, r).items():
                    yield Coefficient(r, indices, value)

    def select(self, modes: Sequence[int | str]) -> ReducedModel:
        """The model of some of the modes, by number (among all modes) or by label."""
        positions = sorted({self._position(mode) for mode in modes})
        if not positions:
            raise ModelError("select: found no mode; give at least one")
        pick = np.array(positions)
        shapes = self.shapes
        return attrs.evolve(
            self,
            frequency=self.frequency[pick],
            mass=self.mass[pick],
            label=[self.label[i] for i in positions],
            number=self.number[pick],
            stiffness=self.stiffness[np.ix_(pick, pick)],
            damping=self.damping[np.ix_(pick, pick)],
            quadratic=self.quadratic[np.ix_(pick, pick, pick)],
            cubic=self.cubic[np.ix_(pick, pick, pick, pick)],
            **{name: self._part(name, pick) for name in OPTIONAL},
            drive={name: j[pick] for name, j in self.drive.items()},
            parametric={name: p[np.ix_(pick, pick)] for name, p in self.parametric.items()},
            shapes=shapes and attrs.evolve(shapes, values=shapes.values[pick]),
        )

    def _part(self, name: str, pick: NDArray[np.intp]) -> Array | None:
        array: Array | None = getattr(self, name)
        return None if array is None else array[np.ix_(*(pick,) * array.ndim)]

    def _position(self, mode: int | str) -> int:
        if isinstance(mode, str):
            names: list[Any] = list(self.label)
        else:
            names = self.number.tolist()
        if mode not in names:
            raise ModelError(
                f"mode {mode!r}: not in the model; it has {', '.join(map(str, names))}"
            )
        return names.index(mode)

    def with_damping(self, damping: Damping) -> ReducedModel:
        """The model with C = diag(m_r omega_r / Q_r) + tau K_bending and D = tau S.

        Raises ModelError for a viscous material if the model does not know its bending and
        stretching (S) apart.
        """
        quality, time = np.array(damping.per_mode(self.size)), damping.material_time
        linear = np.diag(self.mass * 2 * np.pi * self.frequency / quality)
        if time == 0:
            return attrs.evolve(self, damping=linear, cubic_damping=None)
        if self.bending is None or self.stretching is None:
            raise ModelError(
                "damping.material_time: the model does not know its bending and stretching apart; "
                "reduce a scene that has damping.material_time"
            )
        linear = linear + time * (self.bending + self.bending.T) / 2
        return attrs.evolve(self, damping=linear, cubic_damping=time * self.stretching)

    def patterns(
        self, direct: str = "pressure", parametric: str = "tension"
    ) -> tuple[Array, Array]:
        """Force patterns J (L,) and P (L, L) by name; "paper" is P = diag(J) of Keskekler et al."""
        j = _pattern("drive", self.drive, direct)
        if parametric == "paper":
            return j, np.diag(j)
        return j, _pattern("parametric", self.parametric, parametric)

    def system(
        self, direct: str = "pressure", parametric: str = "tension", damped: bool = True
    ) -> ModalSystem:
        """The modal equations with these drive patterns, ready for continuation.

        ``damped=False`` lets a model without damping pass: for backbones and exports.
        """
        from nanorom.continuation import ModalSystem

        j, p = self.patterns(direct, parametric)
        return ModalSystem(
            mass=np.diag(self.mass),
            damping=self.damping,
            stiffness=self.stiffness,
            quadratic=self.quadratic,
            cubic=self.cubic,
            direct=j,
            parametric=p,
            cubic_damping=self.cubic_damping,
            damped=damped,
        )

    def save(self, path: str | Path) -> None:
        """Write `rom.h5`, whole or not at all; raises FileError."""
        from nanorom.rom import romfile

        romfile.save(self, path)

    @classmethod
    def load(cls, path: str | Path) -> ReducedModel:
        """Read `rom.h5`; raises FileError if it is not a sound reduced model."""
        from nanorom.rom import romfile

        return romfile.load(path)


def _pattern(kind: str, patterns: Mapping[str, Array], name: str) -> Array:
    if name not in patterns:
        found = ", ".join(patterns) or "none"
        raise ModelError(f"{kind}: the model has no pattern {name!r}; it has {found}")
    return patterns[name]
