"""Deflection and frequencies against a static load: a table, a file and a picture of it."""

from __future__ import annotations

from pathlib import Path

import attrs
import numpy as np
from numpy.typing import ArrayLike, NDArray

from nanorom.errors import ModelError
from nanorom.files import atomic_path

FORMAT = "nanorom-loadcurve"
FORMAT_VERSION = 1
UNITS = {"pressure": "Pa", "voltage": "V", "force": "N"}


def _array(value: ArrayLike) -> NDArray[np.float64]:
    return np.array(value, dtype=float)


@attrs.frozen(eq=False)
class LoadCurve:
    """States of a film under a rising load.

    quantity: "pressure" | "voltage" | "force"; load: (n,) Pa, V or N; centre, largest: (n,)
    deflections in m, at the film's centre and where they are largest; frequency: (n, L) Hz.
    """

    quantity: str
    load: NDArray[np.float64] = attrs.field(converter=_array)
    centre: NDArray[np.float64] = attrs.field(converter=_array)
    largest: NDArray[np.float64] = attrs.field(converter=_array)
    frequency: NDArray[np.float64] = attrs.field(converter=_array)

    def __attrs_post_init__(self) -> None:
        if self.quantity not in UNITS:
            raise ModelError(f"quantity: found {self.quantity}; allowed: {' | '.join(UNITS)}")
        n = len(self.load)
        if not len(self.centre) == len(self.largest) == len(self.frequency) == n:
            raise ModelError("load, centre, largest, frequency: not of one length")

    def save_csv(self, path: str | Path) -> None:
        """Write the table, one row per state; raises FileError."""
        names = [f"{self.quantity} ({UNITS[self.quantity]})", "centre (m)", "largest (m)"]
        names += [f"f{i + 1} (Hz)" for i in range(self.frequency.shape[1])]
        rows = np.column_stack([self.load, self.centre, self.largest, self.frequency])
        with atomic_path(path) as temporary:
            np.savetxt(temporary, rows, "%.10g", ",", header=",".join(names), comments="")

    def save(self, path: str | Path) -> None:
        """Write an HDF5 file; raises FileError."""
        from nanorom import hdf5

        units = {"load": UNITS[self.quantity], "centre": "m", "largest": "m", "frequency": "Hz"}
        with hdf5.create(path, FORMAT, FORMAT_VERSION) as file:
            file.attrs["quantity"] = self.quantity
            for name, unit in units.items():
                file[name] = getattr(self, name)
                file[name].attrs["unit"] = unit

    @classmethod
    def load_file(cls, path: str | Path) -> LoadCurve:
        """Read an HDF5 file; raises FileError."""
        from nanorom import hdf5

        with hdf5.opened(path, FORMAT, FORMAT_VERSION) as file:
            columns = {n: hdf5.read(file, n, (None,)) for n in ("load", "centre", "largest")}
            frequency = hdf5.read(file, "frequency", (None, None))
            return cls(hdf5.text(file.attrs["quantity"]), frequency=frequency, **columns)
