"""The reduced model: modal matrices and tensors, the forces they give, and the file `rom.h5`.

    M q'' + C q' + K q + A qq + B qqq = F(t, q)

q in m, forces in N. The nonlinear force is eta_r = sum_jk A[r,j,k] q_j q_k +
sum_jkl B[r,j,k,l] q_j q_k q_l, of Keskekler et al., eq. 3, with symmetric tensors.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import attrs
import numpy as np
from numpy.typing import ArrayLike

from nanorom.errors import FileError, ModelError
from nanorom.files import hdf5, layout, schema, stored
from nanorom.files.schema import POTENTIAL, SYMMETRIC, Item, members, note, part
from nanorom.rom import tensors
from nanorom.rom.arrays import (
    as_arrays,
    as_copy,
)
from nanorom.rom.coefficients import Coefficient, Coefficients, place
from nanorom.rom.heat import Heat
from nanorom.rom.larger import Larger
from nanorom.rom.modal import Modal
from nanorom.rom.names import index_of
from nanorom.rom.shapes import Shapes
from nanorom.scene.excitation import Damping
from nanorom.scene.patterns import PARAMETRIC
from nanorom.scene.scene import MOST_MODES
from nanorom.scene.units import with_unit
from nanorom.types import Array

if TYPE_CHECKING:
    from nanorom.continuation import ModalSystem

UNSORTED = 1e-3  # relative: near modes rank by name, as a mesh may not tell which is the lower
ASYMMETRIC = 1e-6  # a stiffness, mass or damping matrix beyond this is a mistake
NORMALIZATION = "max"  # of the mode shapes: max |phi| = 1
MORE_THAN_REPORTED = 2.0  # a file may measure its asymmetry in another norm
ROUND_OFF = 1e-9


@layout.documented
@attrs.frozen(eq=False, kw_only=True, repr=False)
class ReducedModel(Modal):
    """A modal model of L modes in SI units, valid by construction; raises ModelError.

    The modal force of a drive is (direct J + parametric P q) cos(omega t).
    """

    FORMAT: ClassVar[str] = "nanorom-rom"
    FORMAT_VERSION: ClassVar[int] = 1

    heat: Heat | None = attrs.field(default=None, metadata=part(Heat))
    shapes: Shapes | None = attrs.field(default=None, metadata=part(Shapes))
    larger: Larger | None = attrs.field(default=None, metadata=part(Larger))
    static: dict[str, Array] = attrs.field(
        converter=as_arrays,
        factory=dict,
        metadata=members(
            {
                "deflection": Item("P", "m", "of the state about which the model is expanded"),
                "largest_deflection": Item("", "m", "of that state"),
                "centre_deflection": Item("", "m", "of that state, at the film's centre"),
                "mean_tension": Item("", "N/m", "of that state"),
                "other_deflection": Item(
                    "", "m", "largest of the state on the other side, of a buckled film"
                ),
            }
        ),
    )
    diagnostics: dict[str, Any] = attrs.field(
        converter=as_copy,
        factory=dict,
        metadata=note("facts", "what the reduction reports about itself"),
    )
    scene: str = attrs.field(default="", metadata=note("text", "the scene it is of, as TOML"))
    method: str = attrs.field(default="", metadata=note("text", "how it was reduced"))
    in_plane: str = attrs.field(default="", metadata=note("text", "free or fixed"))
    versions: dict[str, str] = attrs.field(
        converter=as_copy, factory=dict, metadata=note("words", "of what made it")
    )

    def __attrs_post_init__(self) -> None:
        if self.size == 0:
            raise ModelError("frequency: the model has no modes")
        schema.check(self)
        if (self.mass <= 0).any() or (self.frequency <= 0).any():
            raise ModelError("mass, frequency: found a value that is not greater than 0")
        if (np.diff(self.frequency) < -UNSORTED * self.frequency[1:]).any():
            raise ModelError("frequency: not sorted")
        if (self.number < 1).any() or len(set(self.number.tolist())) < self.size:
            raise ModelError("number: found a mode number below 1 or twice the same")
        for path, item, matrix in schema.leaves(self):
            if item.symmetry == SYMMETRIC and tensors.asymmetry(matrix) > ASYMMETRIC:
                raise ModelError(f"{path}: the matrix is not symmetric")

    def __repr__(self) -> str:
        low, high = (with_unit(float(f), "Hz", 6) for f in self.frequency[[0, -1]])
        modes = ", ".join(f"{n} {name}" for n, name in zip(self.number, self.label))
        head = f"ReducedModel of {self.size} modes, {low} to {high}"
        shown = layout.shown(attrs.evolve(self, larger=None))
        if self.larger is not None:
            shown.append(f"larger: a model of {len(self.larger.label)} modes, for estimates")
        return "\n".join([head, *textwrap.wrap(f"modes: {modes}", 96), *shown])

    def _repr_html_(self) -> str:
        return stored.html(self)

    @property
    def size(self) -> int:
        """Number of modes L."""
        return len(self.frequency)

    @property
    def asymmetry(self) -> float:
        """How far the tensors are from those of a potential, relative to their largest entry."""
        return max(
            tensors.asymmetry(tensor)
            for _, item, tensor in schema.leaves(self)
            if item.symmetry == POTENTIAL
        )

    def nonlinear_forces(self, q: ArrayLike, outside: bool = True) -> Array:
        """eta(q) in N, (..., L), of amplitudes q in m, (..., L); ``outside`` as for `system`."""
        q, cubic = self._amplitudes(q), self.cubic_of(outside)
        secant = q @ self._matrix(self.quadratic) + self._products(q) @ self._matrix(cubic)
        return np.einsum("...rj,...j->...r", secant.reshape(*q.shape, self.size), q)

    def forces(self, q: ArrayLike, outside: bool = True) -> Array:
        """Restoring force K q + eta(q) in N, (..., L), of amplitudes q in m, (..., L).

        ``outside`` as for `system`, here and in `jacobian` and `energy`.
        """
        q = self._amplitudes(q)
        return q @ self.stiffness.T + self.nonlinear_forces(q, outside)

    def jacobian(self, q: ArrayLike, outside: bool = True) -> Array:
        """Tangent stiffness d forces / d q in N/m, (..., L, L), at amplitudes q in m, (..., L)."""
        q = self._amplitudes(q)
        tangent = 2 * (q @ self._matrix(self.quadratic))
        tangent += 3 * (self._products(q) @ self._matrix(self.cubic_of(outside)))
        return self.stiffness + tangent.reshape(*q.shape, self.size)

    def energy(self, q: ArrayLike, outside: bool = True) -> Array:
        """Elastic energy in J, (...), of amplitudes q in m, (..., L).

        Its gradient is the restoring force where the tensors derive from a potential.
        """
        q = self._amplitudes(q)
        secant = self.stiffness / 2 + (
            (q @ self._matrix(self.quadratic)) / 3
            + (self._products(q) @ self._matrix(self.cubic_of(outside))) / 4
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

    def alpha(self, r: int | str) -> Coefficients:
        """The paper's alpha_jk of equation r in N/m^2, alpha(r)[j, k]: 1-based or names of modes.

        Raises ModelError for a mode that the model lacks.
        """
        return self._paper(self.quadratic, r)

    def b(self, r: int | str) -> Coefficients:
        """The paper's b_jkl of equation r in N/m^3, b(r)[j, k, l]: 1-based or names of modes.

        Raises ModelError for a mode that the model lacks.
        """
        return self._paper(self.cubic, r)

    def _paper(self, tensor: Array, r: int | str) -> Coefficients:
        return Coefficients(tensor[place(self.label, r, "equation") - 1], self.label)

    def coefficients(self) -> Iterator[Coefficient]:
        """Every alpha_jk, then every b_jkl, equation by equation."""
        for tensor in (self.quadratic, self.cubic):
            for r in range(1, self.size + 1):
                for indices, value in self._paper(tensor, r).items():
                    yield Coefficient(r, indices, value)

    def select(self, modes: int | str | Sequence[int | str]) -> ReducedModel:
        """The model of some modes or of one, by number (among all) or by label; raises ModelError.

        Where the model knows what lies outside its modes, the others become a part of that.
        """
        chosen = [modes] if isinstance(modes, (int, str)) else modes
        positions = sorted({self._position(mode) for mode in chosen})
        if not positions:
            raise ModelError("select: found no mode; give at least one")
        picked = schema.picked(self, "L", positions)
        if self.outside_cubic is not None:
            kept = np.array(positions)
            dropped = np.setdiff1d(np.arange(self.size), kept)
            pull = self.quadratic[np.ix_(kept, kept, dropped)]
            compliance = np.linalg.inv(self.stiffness[np.ix_(dropped, dropped)])
            picked["outside_cubic"] = picked["outside_cubic"] + tensors.condensed(pull, compliance)
        return attrs.evolve(self, **picked)

    def _position(self, mode: int | str) -> int:
        names: list[Any] = list(self.label)
        if isinstance(mode, str):
            found = index_of(self.label, mode)
        else:
            names = self.number.tolist()
            found = names.index(mode) if mode in names else None
        if found is None:
            raise ModelError(
                f"mode {mode!r}: not in the model; it has {', '.join(map(str, names))}"
            )
        return found

    def with_damping(self, damping: Damping) -> ReducedModel:
        """The model with C = diag(m_r omega_r (1/Q_r + losses)) + tau K_bending and D = tau S.

        Raises ModelError for a viscous material whose bending and stretching S are not known apart.
        """
        inverse = 1 / np.array(damping.per_mode(self.size)) + sum(self.losses.values())
        linear = np.diag(self.mass * 2 * np.pi * self.frequency * inverse)
        time = damping.material_time
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
        """Force patterns J (L,) in N and P (L, L) in N/m per unit of the level, by name.

        P of a pattern that is proportional to the direct one goes with the J that is asked for.
        Raises ModelError if the model has no pattern of that name.
        """
        j = _pattern("drive", self.drive, direct)
        kind = PARAMETRIC.get(parametric)
        p = kind.beside(j) if kind is not None else None
        return j, _pattern("parametric", self.parametric, parametric) if p is None else p

    def system(
        self,
        direct: str = "pressure",
        parametric: str = "tension",
        damped: bool = True,
        outside: bool = True,
    ) -> ModalSystem:
        """The modal equations with these drive patterns, ready for continuation.

        ``damped=False`` lets a model without damping pass: for backbones and exports.
        ``outside`` says whether what lies outside the modes follows them statically, where the
        model knows how, or stays at rest.
        """
        from nanorom.continuation import ModalSystem

        j, p = self.patterns(direct, parametric)
        return ModalSystem(
            mass=np.diag(self.mass),
            damping=self.damping,
            stiffness=self.stiffness,
            quadratic=self.quadratic,
            cubic=self.cubic_of(outside),
            direct=j,
            parametric=p,
            cubic_damping=self.cubic_damping,
            damped=damped,
        )

    def cubic_of(self, outside: bool = True) -> Array:
        """B (L, L, L, L) in N/m^3, with or without what the response outside the modes adds."""
        if outside and self.outside_cubic is not None:
            return self.cubic + self.outside_cubic
        return self.cubic

    def mass_responsivity(self, position: Sequence[float]) -> Array:
        """df/dm (L,) in Hz/kg of a small mass that lands at a position (x, y) in m.

        -f phi^2/(2 m_r), what Rayleigh's quotient gives to first order.  Raises ModelError for a
        point off the film, or a model without shapes.
        """
        if self.shapes is None:
            raise ModelError("shapes: this model keeps none, which a place on the film needs")
        return np.asarray(-self.frequency * self.shapes.at(position) ** 2 / (2 * self.mass))

    def save(self, path: str | Path) -> None:
        """Write `rom.h5`, whole or not at all; raises FileError."""
        stored.save(self, path, normalization=NORMALIZATION)

    @classmethod
    def load(cls, path: str | Path) -> ReducedModel:
        """Read `rom.h5`; raises FileError if it is not a sound reduced model."""
        with hdf5.opened(path, cls.FORMAT, cls.FORMAT_VERSION) as file:
            normalization = hdf5.text(file.attrs.get("normalization", ""))
            if normalization != NORMALIZATION:
                raise FileError(
                    f"normalization: found {normalization!r}; expected {NORMALIZATION!r}"
                )
            model = stored.read(cls, file, most={"L": MOST_MODES})
            model._check_potential()
        return model

    def _check_potential(self) -> None:
        """Raise FileError if the tensors of a file are not what it reports of them."""
        reported = self.diagnostics.get("asymmetry", 0.0)
        reported = float(reported) if isinstance(reported, (int, float)) else 0.0
        if not self.asymmetry <= MORE_THAN_REPORTED * reported + ROUND_OFF:
            raise FileError(
                f"quadratic, cubic: deviate from a potential by {self.asymmetry:.1e}, but the file "
                f"reports {reported:.1e}; reduce the scene again"
            )


def _pattern(kind: str, patterns: Mapping[str, Array], name: str) -> Array:
    if name not in patterns:
        found = ", ".join(patterns) or "none"
        raise ModelError(f"{kind}: the model has no pattern {name!r}; it has {found}")
    return patterns[name]
