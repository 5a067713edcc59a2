"""Finished parts of a long computation, kept beside its output until that is written.

A run that is killed leaves ``OUTPUT.partial``; the same command finds there what was finished and
goes on with the rest.  Work of a few seconds is not worth a file and leaves none.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np

from nanorom.errors import FileError
from nanorom.files import hdf5
from nanorom.files.whole import clear_temporary, make_directory
from nanorom.types import Array

FORMAT = "nanorom-partial"
FORMAT_VERSION = 1
KEY = "key"  # attribute: what the tables were computed from
SECONDS = 5.0  # of work that may be lost
SHARE = 0.05  # of the run time that may be spent on keeping


def partial(output: str | Path) -> Path:
    """Where the finished parts of an output are kept."""
    output = Path(output)
    return output.with_name(f"{output.name}.partial")


class Journal:
    """Tables of one computation, columns not yet computed at NaN.

    Parameters
    ----------
    output : file that the computation is for; None keeps nothing.
    key : digest of everything that the tables depend on: those of another key are not used.
    comm : communicator whose first rank reads and writes, or None; every method is collective.
    """

    def __init__(self, output: str | Path | None = None, key: str = "", comm: Any = None) -> None:
        self._path = None if output is None else partial(output)
        self._key, self._comm = key, comm
        self._tables: dict[str, Array] = self._first(self._read)
        self._due = time.monotonic() + SECONDS

    def table(self, name: str, shape: tuple[int, int]) -> Array:
        """What is known of a table: all of it NaN if nothing is."""
        found = self._tables.get(name)
        if found is None or found.shape != shape:
            found = self._tables[name] = np.full(shape, np.nan)
        return found

    def keep(self) -> None:
        """Write the tables if the last time was long ago; raises FileError on every rank."""
        if self._path is not None:
            error = self._first(self._write)
            if error is not None:
                raise FileError(error)

    def _first(self, action: Any) -> Any:
        """What an action of the first rank gives, on every rank."""
        if self._comm is None:
            return action()
        return self._comm.bcast(action() if self._comm.rank == 0 else None)

    def _read(self) -> dict[str, Array]:
        if self._path is None:
            return {}
        try:
            with hdf5.opened(self._path, FORMAT, FORMAT_VERSION) as file:
                if hdf5.text(file.attrs.get(KEY, "")) != self._key:
                    return {}
                tables = hdf5.group(file, "tables")
                return {name: hdf5.read(tables, name, (None, None)) for name in tables}
        except FileError:  # nothing to go on from; it is replaced
            return {}

    def _write(self) -> str | None:
        start = time.monotonic()
        if start < self._due:
            return None
        assert self._path is not None
        try:
            make_directory(self._path.parent)
            with hdf5.create(self._path, FORMAT, FORMAT_VERSION) as file:
                file.attrs[KEY] = self._key
                tables = file.create_group("tables")
                for name, table in self._tables.items():
                    hdf5.write(tables, name, table)
        except FileError as error:
            return str(error)
        now = time.monotonic()
        self._due = now + max(SECONDS, (now - start) / SHARE)
        return None


def finished(output: str | Path) -> None:
    """Remove the parts of an output that has been written."""
    path = partial(output)
    clear_temporary(path)
    if path.is_file() and hdf5.kind_of(path) == FORMAT:
        path.unlink(missing_ok=True)
