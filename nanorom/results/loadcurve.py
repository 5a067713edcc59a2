"""Deflection and frequencies against a static load: a table, a file and a picture of it."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

import attrs
import numpy as np
from numpy.typing import ArrayLike, NDArray

from nanorom.errors import ModelError
from nanorom.files import hdf5, layout, schema, stored
from nanorom.files.schema import array, note
from nanorom.files.whole import atomic_path
from nanorom.rom.arrays import as_names
from nanorom.scene.units import tabulated, with_unit

UNITS = {"voltage": "V", "pressure": "Pa", "force": "N"}
ANY_UNIT = " or ".join(UNITS.values())


def _array(value: ArrayLike) -> NDArray[np.float64]:
    return np.array(value, dtype=float)


@layout.documented
@attrs.frozen(eq=False, repr=False)
class LoadCurve:
    """States of a film along a load path; raises ModelError if the columns do not fit.

    ``lumped`` is sqrt(8 k g^3/(27 eps0 A)) (Nathanson et al. 1967, doi:10.1109/T-ED.1967.15912).
    """

    FORMAT: ClassVar[str] = "nanorom-loadcurve"
    FORMAT_VERSION: ClassVar[int] = 1

    quantity: str = attrs.field(metadata=note("text", " | ".join(UNITS)))
    load: NDArray[np.float64] = attrs.field(
        converter=_array, metadata=array("n", ANY_UNIT, "the load that grows")
    )
    centre: NDArray[np.float64] = attrs.field(
        converter=_array,
        metadata=array("n", "m", "deflection of the centre, NaN in a hole", finite=False),
    )
    largest: NDArray[np.float64] = attrs.field(
        converter=_array, metadata=array("n", "m", "deflection where it is largest")
    )
    frequency: NDArray[np.float64] = attrs.field(
        converter=_array,
        metadata=array("n, L", "Hz", "NaN where the state is not stable", finite=False),
    )
    limits: NDArray[np.float64] = attrs.field(
        converter=_array,
        default=(),
        metadata=array(
            "M", ANY_UNIT, "where the path turns: the film snaps through, or a gate pulls it in"
        ),
    )
    lumped: float | None = attrs.field(
        default=None,
        metadata=note("number", "V, pull-in of a rigid plate on a spring as stiff as the film"),
    )

    label: tuple[str, ...] | None = attrs.field(
        default=None,
        converter=attrs.converters.optional(as_names),
        metadata=array("L", "", "names of the modes where the path begins", kind="name"),
    )
    tension: NDArray[np.float64] | None = attrs.field(
        default=None,
        converter=attrs.converters.optional(_array),
        metadata=array("n", "N/m", "half the trace of the membrane force, the film's mean"),
    )
    cubic: NDArray[np.float64] | None = attrs.field(
        default=None,
        converter=attrs.converters.optional(_array),
        metadata=array(
            "n, L",
            "N/m^3",
            "effective cubic coefficients, all else condensed; NaN where the state is not stable, "
            "or modes exchange energy",
            finite=False,
        ),
    )

    def __attrs_post_init__(self) -> None:
        if self.quantity not in UNITS:
            raise ModelError(f"quantity: found {self.quantity}; allowed: {' | '.join(UNITS)}")
        schema.check(self)

    def __repr__(self) -> str:
        head = f"LoadCurve of {len(self.load)} states against the {self.quantity}"
        return "\n".join([head, *layout.shown(self)])

    def _repr_html_(self) -> str:
        return stored.html(self)

    @property
    def stable(self) -> NDArray[np.bool_]:
        """(n,) which states are stable."""
        return np.asarray(np.isfinite(self.frequency).all(axis=1))

    @property
    def names(self) -> tuple[str, ...]:
        """(L,) names of the modes, "mode 1" ... where they are not known."""
        return self.label or tuple(f"mode {i + 1}" for i in range(self.frequency.shape[1]))

    @property
    def pull_in(self) -> float | None:
        """Voltage in V at which a gate pulls the film in, None where it did not."""
        gated = self.quantity == "voltage" and len(self.limits) > 0
        return float(self.limits[0]) if gated else None

    @property
    def turns(self) -> dict[str, list[float]]:
        """Loads (k,) in SI at which the cubic coefficient of a mode changes its sign, by its name.

        Between two states that lie next to each other on the path, by a straight line.
        """
        found: dict[str, list[float]] = {}
        if self.cubic is None:
            return found
        for name, beta in zip(self.names, self.cubic.T):
            for i in np.flatnonzero(beta[1:] * beta[:-1] < 0).tolist():
                share = beta[i] / (beta[i] - beta[i + 1])
                at = self.load[i] + share * (self.load[i + 1] - self.load[i])
                found.setdefault(name, []).append(float(at))
        return found

    def save_csv(self, path: str | Path) -> None:
        """Write the table, one row per state; raises FileError."""
        names = [f"{self.quantity} ({UNITS[self.quantity]})", "centre (m)", "largest (m)"]
        names += [f"{name} (Hz)" for name in self.names]
        rows = np.column_stack([self.load, self.centre, self.largest, self.frequency])
        if self.tension is not None:
            names.append("tension (N/m)")
            rows = np.column_stack([rows, self.tension])
        if self.cubic is not None:
            names += [f"cubic {name} (N/m^3)" for name in self.names]
            rows = np.column_stack([rows, self.cubic])
        with atomic_path(path) as temporary:
            np.savetxt(temporary, rows, "%.10g", ",", header=",".join(names), comments="")

    def save(self, path: str | Path) -> None:
        """Write an HDF5 file; raises FileError."""
        unit = UNITS[self.quantity]
        stored.save(self, path, units={"load": unit, "limits": unit})

    @classmethod
    def load_file(cls, path: str | Path) -> LoadCurve:
        """Read an HDF5 file; raises FileError."""
        with hdf5.opened(path, cls.FORMAT, cls.FORMAT_VERSION) as file:
            return stored.read(cls, file)

    def text(self) -> str:
        """The table for people, and what there is to say of it."""
        unit, size = UNITS[self.quantity], self.frequency.shape[1]
        columns = [
            (self.quantity, *tabulated(self.load, unit)),
            ("centre", *tabulated(self.centre, "m")),
            ("largest", *tabulated(self.largest, "m")),
        ]
        frequencies, hertz = tabulated(self.frequency, "Hz")
        columns += [(name, frequencies[i::size], hertz) for i, name in enumerate(self.names)]
        if self.tension is not None:
            columns.append(("tension", *tabulated(self.tension, "N/m")))
        if self.cubic is not None:
            cubic, own = tabulated(self.cubic, "N/m^3", 4)
            columns += [(f"cubic {name}", cubic[i::size], own) for i, name in enumerate(self.names)]
        rows = list(zip(*(values for _, values, _ in columns)))
        cells = [tuple(f"{name} ({own})" for name, _, own in columns), *rows]
        widths = [max(map(len, column)) for column in zip(*cells)]
        lines = ["  ".join(c.rjust(w) for c, w in zip(row, widths)) for row in cells]
        if self.pull_in is not None:
            lines += ["", f"pulled in at {with_unit(self.pull_in, 'V', 6)}"]
            if self.lumped is not None:
                excess = f"{100 * (self.lumped / self.pull_in - 1):+.1f} %"
                lumped = f"{with_unit(self.lumped, 'V', 6)} ({excess})"
                lines[-1] += f"; a rigid plate on a spring of the film's mean stiffness: {lumped}"
        elif len(self.limits):
            values = ", ".join(with_unit(limit, unit, 6) for limit in self.limits.tolist())
            lines += ["", f"limit points at {values}: the film snaps through"]
        turned: dict[str, list[str]] = {}  # modes by where: those of a pair turn together
        for name, loads in self.turns.items():
            at = ", ".join(with_unit(load, unit, 4) for load in loads)
            turned.setdefault(at, []).append(name)
        lines += [""] * bool(turned)
        for at, modes in turned.items():
            lines.append(f"the cubic coefficient of {', '.join(modes)} changes its sign at {at}")
        return "\n".join(lines)
