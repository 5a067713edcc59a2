"""Finished rows of a long computation, a line each, kept beside its output until that is written.

A run that is killed leaves ``OUTPUT.partial``; a line that was being written is no row.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

from nanorom.errors import FileError
from nanorom.files.partial import partial
from nanorom.files.whole import check_writable

FORMAT = "nanorom-lines"


class Lines:
    """Rows of one computation, by their number.

    Parameters
    ----------
    output : file that the computation is for; None keeps nothing.
    key : digest of everything that the rows depend on: those of another key are not used.
    """

    def __init__(self, output: str | Path | None, key: str) -> None:
        self._path = None if output is None else partial(output)
        self.found: dict[int, dict[str, Any]] = {}
        if self._path is None:
            return
        check_writable(self._path)
        head = json.dumps({"format": FORMAT, "key": key}) + "\n"
        whole = self._read(head)
        try:
            with open(self._path, "ab") as file:
                file.truncate(whole)  # half a line
                if not whole:
                    file.write(head.encode())
        except OSError as error:
            raise FileError(f"{self._path}: cannot be written: {error.strerror}") from None

    def _read(self, head: str) -> int:
        """Take the rows that are whole; how many bytes of the file are."""
        assert self._path is not None
        if not self._path.is_file():
            return 0
        with open(self._path, "rb") as file:
            if file.readline(len(head) + 1) != head.encode():
                return 0
            whole = file.tell()
            for line in file:
                try:
                    row = json.loads(line) if line.endswith(b"\n") else None
                    self.found[int(row["row"])] = dict(row["found"])
                except (ValueError, TypeError, KeyError, RecursionError):  # from there on, no rows
                    break
                whole += len(line)
        return whole

    def keep(self, row: int, found: dict[str, Any]) -> None:
        """Add a row; raises FileError."""
        self.found[row] = found
        if self._path is not None:
            try:
                with open(self._path, "ab") as file:
                    file.write(json.dumps({"row": row, "found": found}).encode() + b"\n")
            except OSError as error:
                raise FileError(f"{self._path}: cannot be written: {error.strerror}") from None

    def each(
        self, rows: Iterable[int], solve: Callable[[int], dict[str, Any]]
    ) -> Iterator[dict[str, Any]]:
        """Rows by their numbers: those that are kept, else solved and kept; raises FileError."""
        for row in rows:
            if row not in self.found:
                self.keep(row, solve(row))
            yield self.found[row]

    def finished(self) -> None:
        """Remove the rows: the output has been written."""
        if self._path is not None:
            self._path.unlink(missing_ok=True)
