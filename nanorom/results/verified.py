"""Modal responses beside the whole film's own orbits: a table, a file and what there is to say."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

import attrs
import numpy as np
from numpy.typing import NDArray

from nanorom.continuation.orbits.bifurcations import turns
from nanorom.files import hdf5, layout, schema, stored
from nanorom.files.schema import array, note
from nanorom.rom.arrays import as_optional
from nanorom.scene.units import tabulated, with_unit
from nanorom.types import Array

NONE = -1  # branch of an orbit that lies on none
LARGE_SHARE = 0.01  # of the largest amplitude: a mode outside that takes part


@layout.documented
@attrs.frozen(eq=False, kw_only=True, repr=False)
class Verified:
    """Orbits of a modal model and, near them, of the film in all its degrees of freedom.

    One row per orbit; what was not found, or not asked for, is NaN.  Raises ModelError if the
    columns do not fit.
    """

    FORMAT: ClassVar[str] = "nanorom-verified"
    FORMAT_VERSION: ClassVar[int] = 1

    scene: str = attrs.field(metadata=note("text", "the scene they are of, as TOML"))
    versions: dict[str, str] = attrs.field(metadata=note("words", "of what made it"))
    label: tuple[str, ...] = attrs.field(
        metadata=array("L", "", "names of the model's modes", kind="name")
    )
    frequency: Array = attrs.field(metadata=array("L", "Hz", "their natural frequencies"))
    outside_label: tuple[str, ...] = attrs.field(
        metadata=array("K", "", "names of modes that the model lacks", kind="name")
    )
    level: NDArray[np.int64] = attrs.field(
        metadata=array("n", "", "number of the drive level, from 0", kind="whole")
    )
    direct: Array = attrs.field(metadata=array("n", "SI", "direct drive"))
    parametric: Array = attrs.field(metadata=array("n", "SI", "parametric drive"))
    branch: NDArray[np.int64] = attrs.field(
        metadata=array("n", "", "number of the branch of the response, from 0", kind="whole")
    )
    type: tuple[str, ...] = attrs.field(
        metadata=array("n", "", "of a special point, - for any other", kind="name")
    )
    omega: Array = attrs.field(metadata=array("n", "rad/s", "drive frequency of the modal orbit"))
    period_multiple: NDArray[np.int64] = attrs.field(
        metadata=array("n", "", "periods of the drive in one of the orbit", kind="whole")
    )
    harmonics: NDArray[np.int64] = attrs.field(metadata=array("n", "", "H", kind="whole"))
    modal: Array = attrs.field(metadata=array("n, L", "m", "max |q_r| in the modal model"))
    full: Array = attrs.field(
        metadata=array("n, L", "m", "max |q_r| in the film, projected", finite=False)
    )
    omega_full: Array = attrs.field(
        metadata=array(
            "n", "rad/s", "drive frequency of the film's orbit: another at a fold", finite=False
        )
    )
    outside: Array = attrs.field(
        metadata=array(
            "n, K", "m", "max |q_r| in the film of modes that the model lacks", finite=False
        )
    )
    deflection: Array = attrs.field(
        metadata=array("n, 2", "m", "largest |w| of film and model", finite=False)
    )
    residual: Array = attrs.field(
        metadata=array("n", "", "of the film's equations, by the drive", finite=False)
    )
    modal_residual: Array = attrs.field(
        metadata=array("n", "", "that which the modal orbit leaves", finite=False)
    )
    estimate: Array = attrs.field(
        metadata=array("n", "", "estimated relative error of the largest amplitude", finite=False)
    )
    error: Array = attrs.field(metadata=array("n", "", "the true one", finite=False))
    estimate_omega: Array = attrs.field(
        metadata=array("n", "", "estimated relative shift of a fold's frequency", finite=False)
    )
    takes_part: Array = attrs.field(
        metadata=array(
            "n, K", "m", "estimated amplitude of modes that the model lacks", finite=False
        )
    )
    largest_multiplier: Array = attrs.field(
        metadata=array(
            "n",
            "",
            "largest modulus of a Floquet multiplier of the modal orbit, outside modes included",
            finite=False,
        )
    )

    left: Array | None = attrs.field(
        default=None,
        converter=as_optional,
        metadata=array(
            "n", "", "residual, by the drive, at which the search ended in vain", finite=False
        ),
    )
    named: Array | None = attrs.field(
        default=None,
        converter=as_optional,
        metadata=array("n", "", "modes, the model's among them, that led to the film's orbit"),
    )
    multiplier_model: Array | None = attrs.field(
        default=None,
        converter=as_optional,
        metadata=array("n", "", "largest modulus of a Floquet multiplier in the model"),
    )
    multiplier_film: Array | None = attrs.field(
        default=None,
        converter=as_optional,
        metadata=array(
            "n",
            "",
            "the same of the film's orbit, all modes that led to it being free to grow",
            finite=False,
        ),
    )

    def __attrs_post_init__(self) -> None:
        schema.check(self)

    def __len__(self) -> int:
        return len(self.level)

    def _repr_html_(self) -> str:
        return stored.html(self)

    def __repr__(self) -> str:
        return f"Verified: {len(self)} orbits of {len(self.label)} modes\n{self.text()}"

    @property
    def error_omega(self) -> Array:
        """(n,) relative shift of the frequency from the modal orbit to the film's."""
        return np.asarray(self.omega_full / self.omega - 1)

    @property
    def largest(self) -> NDArray[np.int64]:
        """(n,) the mode that the errors are of: the one of largest amplitude in the model."""
        return np.asarray(self.modal.argmax(axis=1))

    @property
    def solved(self) -> NDArray[np.bool_]:
        """(n,) whether an orbit of the film was found."""
        return np.asarray(np.isfinite(self.residual))

    def missing(self, row: int) -> list[tuple[str, float]]:
        """Modes that the model lacks and that take part in an orbit, the largest first, in m.

        As the film has them, or, where it was not solved for, as estimated.
        """
        found = self.outside[row] if self.solved[row] else self.takes_part[row]
        order = np.argsort(-np.nan_to_num(found))
        limit = LARGE_SHARE * self.modal[row].max()
        return [(self.outside_label[k], float(found[k])) for k in order if found[k] > limit]

    def save(self, path: str | Path) -> None:
        """Write `verified.h5`, whole or not at all; raises FileError."""
        stored.save(self, path)

    @classmethod
    def load(cls, path: str | Path) -> Verified:
        """Read `verified.h5`; raises FileError."""
        with hdf5.opened(path, cls.FORMAT, cls.FORMAT_VERSION) as file:
            return stored.read(cls, file)

    def rows(self) -> list[tuple[str, ...]]:
        """The table for people: names of the columns, their units, and a row for each orbit."""
        head = ("level", "branch", "type", "frequency", "mode", "model", "film", "error")
        more = ("estimate", "multiplier", "in the film", "residual", "outside the model")
        places = np.arange(len(self)), self.largest
        frequency, hertz = tabulated(self.omega / (2 * np.pi), "Hz", 8)
        amplitudes, metre = tabulated([self.modal[places], self.full[places]], "m")
        modal, full = amplitudes[: len(self)], amplitudes[len(self) :]
        units = ("", "", "", hertz, "", metre, metre, "", "", "", "", "by drive", "")
        found: list[tuple[str, ...]] = [head + more, units]
        for row in range(len(self)):
            mode = self.largest[row]
            names = [
                f"{label} {with_unit(value, 'm', 3)}" for label, value in self.missing(row)[:3]
            ]
            error, estimate = self.error[row], self.estimate[row]
            if turns(self.type[row]):
                error, estimate = self.error_omega[row], self.estimate_omega[row]
            found.append(
                (
                    str(self.level[row] + 1),
                    str(self.branch[row]),
                    self.type[row],
                    frequency[row],
                    self.label[mode],
                    modal[row],
                    full[row],
                    _number(error, "+.1e") + ("*" if turns(self.type[row]) else ""),
                    _number(estimate, ".1e"),
                    *(_number(column[row], ".4f") for column in self._multipliers()),
                    _number(self.residual[row], ".0e"),
                    ", ".join(names) or "-",
                )
            )
        return found

    def text(self) -> str:
        """The table, and what it comes to."""
        rows = self.rows()
        widths = [max(map(len, column)) for column in zip(*rows)]
        lines = ["  ".join(c.ljust(w) for c, w in zip(row, widths)).rstrip() for row in rows]
        return "\n".join([*lines, "", *self.facts()])

    def facts(self) -> list[str]:
        """What there is to say of all rows."""
        left = np.empty(0) if self.left is None else self.left[np.isfinite(self.left)]
        lines = [f"{int(self.solved.sum())} of {len(self)} orbits found in the film"]
        if not len(left) and not self.solved.any():
            lines = [f"{len(self)} orbits, none of them solved for in the film"]
        if any(turns(each) for each in self.type):
            lines.append("* of a fold: the error of its frequency")
        errors = np.abs(self.error[self.solved])
        if len(errors):
            worst = f"median {np.median(errors):.1e}, largest {errors.max():.1e}"
            lines.append(f"error of the largest amplitude: {worst}")
        named = np.empty(0) if self.named is None else self.named[self.solved]
        for count in sorted(set(named) - {min(named, default=0)}):
            lines.append(f"{int((named == count).sum())} of them by way of {count:.0f} modes")
        lines += self._stability()
        if len(left):
            ends = f"{left.min():.0e} to {left.max():.0e}" if len(left) > 1 else f"{left[0]:.0e}"
            lines.append(f"{len(left)} not found: the search ended at a residual of {ends}")
        unsure = np.flatnonzero(~self.solved & np.isnan(self.estimate))
        if len(unsure):
            lines.append(f"{len(unsure)} without any estimate")
        return lines

    def _multipliers(self) -> tuple[Array, Array]:
        """(n,) largest moduli in the model and in the film, NaN where they are not known."""
        unknown = np.full(len(self), np.nan)
        model, film = self.multiplier_model, self.multiplier_film
        return (unknown if model is None else model), (unknown if film is None else film)

    def _stability(self) -> list[str]:
        """Which orbits are stable in the model or in the film alone."""
        model, film = (np.nan_to_num(column, nan=np.inf) <= 1 for column in self._multipliers())
        counts = int((self.solved & model & ~film).sum()), int((self.solved & film & ~model).sum())
        where = ("model", "film")
        return [
            f"{count} stable in the {name} alone" for count, name in zip(counts, where) if count
        ]


def _number(value: float, form: str) -> str:
    return format(value, form) if np.isfinite(value) else "-"
