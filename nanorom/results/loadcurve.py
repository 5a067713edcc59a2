"""Deflection and frequencies against a static load: a table, a file and a picture of it."""

from __future__ import annotations

from pathlib import Path

import attrs
import numpy as np
from numpy.typing import ArrayLike, NDArray

from nanorom.errors import ModelError
from nanorom.files.whole import atomic_path

FORMAT = "nanorom-loadcurve"
FORMAT_VERSION = 1
UNITS = {"voltage": "V", "pressure": "Pa", "force": "N"}
COLUMNS = ("load", "centre", "largest")


def _array(value: ArrayLike) -> NDArray[np.float64]:
    return np.array(value, dtype=float)


@attrs.frozen(eq=False)
class LoadCurve:
    """States of a film along a load path.

    quantity : "voltage" | "pressure" | "force".
    load : (n,) V, Pa or N.
    centre, largest : (n,) deflections in m, at the film's centre (nan in a hole) and where they are
        largest.
    frequency : (n, L) Hz, nan where the state is not stable.
    limits : (m,) loads at which the path turns: the film snaps through, or a gate pulls it in.
    lumped : of a gate, the pull-in voltage of a rigid plate on a spring as stiff as the film is in
        the mean, sqrt(8 k g^3/(27 eps0 A)) (Nathanson et al. 1967, doi:10.1109/T-ED.1967.15912).
    """

    quantity: str
    load: NDArray[np.float64] = attrs.field(converter=_array)
    centre: NDArray[np.float64] = attrs.field(converter=_array)
    largest: NDArray[np.float64] = attrs.field(converter=_array)
    frequency: NDArray[np.float64] = attrs.field(converter=_array)
    limits: NDArray[np.float64] = attrs.field(converter=_array, default=())
    lumped: float | None = None

    def __attrs_post_init__(self) -> None:
        if self.quantity not in UNITS:
            raise ModelError(f"quantity: found {self.quantity}; allowed: {' | '.join(UNITS)}")
        n = len(self.load)
        if not len(self.centre) == len(self.largest) == len(self.frequency) == n:
            raise ModelError("load, centre, largest, frequency: not of one length")

    @property
    def stable(self) -> NDArray[np.bool_]:
        """(n,) which states are stable."""
        return np.asarray(np.isfinite(self.frequency).all(axis=1))

    @property
    def pull_in(self) -> float | None:
        """Voltage in V at which a gate pulls the film in, None where it did not."""
        gated = self.quantity == "voltage" and len(self.limits) > 0
        return float(self.limits[0]) if gated else None

    def save_csv(self, path: str | Path) -> None:
        """Write the table, one row per state; raises FileError."""
        names = [f"{self.quantity} ({UNITS[self.quantity]})", "centre (m)", "largest (m)"]
        names += [f"f{i + 1} (Hz)" for i in range(self.frequency.shape[1])]
        rows = np.column_stack([self.load, self.centre, self.largest, self.frequency])
        with atomic_path(path) as temporary:
            np.savetxt(temporary, rows, "%.10g", ",", header=",".join(names), comments="")

    def save(self, path: str | Path) -> None:
        """Write an HDF5 file; raises FileError."""
        from nanorom.files import hdf5

        unit = UNITS[self.quantity]
        units = {"load": unit, "centre": "m", "largest": "m", "frequency": "Hz", "limits": unit}
        with hdf5.create(path, FORMAT, FORMAT_VERSION) as file:
            file.attrs["quantity"] = self.quantity
            if self.lumped is not None:
                file.attrs["lumped"] = self.lumped
            for name, unit in units.items():
                hdf5.write(file, name, getattr(self, name), unit)

    @classmethod
    def load_file(cls, path: str | Path) -> LoadCurve:
        """Read an HDF5 file; raises FileError."""
        from nanorom.files import hdf5

        with hdf5.opened(path, FORMAT, FORMAT_VERSION) as file:
            columns = {name: hdf5.read(file, name, (None,)) for name in (*COLUMNS, "limits")}
            frequency = hdf5.read(file, "frequency", (None, None))
            lumped = float(file.attrs["lumped"]) if "lumped" in file.attrs else None
            quantity = hdf5.text(file.attrs["quantity"])
            return cls(quantity, frequency=frequency, lumped=lumped, **columns)

    def text(self) -> str:
        """The table for people, and what there is to say of it."""
        unit = UNITS[self.quantity]
        names = [f"f{i + 1} (Hz)" for i in range(self.frequency.shape[1])]
        head = [f"{self.quantity} ({unit})", "centre (m)", "largest (m)", *names]
        rows = np.column_stack([self.load, self.centre, self.largest, self.frequency])
        cells = [head, *[["-" if np.isnan(x) else f"{x:.6g}" for x in row] for row in rows]]
        widths = [max(map(len, column)) for column in zip(*cells)]
        lines = ["  ".join(c.rjust(w) for c, w in zip(row, widths)) for row in cells]
        if self.pull_in is not None:
            lines += ["", f"pulled in at {self.pull_in:.6g} V"]
            if self.lumped is not None:
                lines[-1] += (
                    f"; a rigid plate on a spring of the film's mean stiffness: {self.lumped:.6g} V"
                    f" ({100 * (self.lumped / self.pull_in - 1):+.1f} %)"
                )
        elif len(self.limits):
            values = ", ".join(f"{limit:.6g}" for limit in self.limits)
            lines += ["", f"limit points at {values} {unit}: the film snaps through"]
        return "\n".join(lines)
