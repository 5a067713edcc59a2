"""Grids and samples of scenes: quantities of each of many devices, in one table."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from nanorom.continuation.diagrams.levels import cores
from nanorom.devices.request import SECONDS, Request
from nanorom.devices.sampling import Sampling
from nanorom.devices.workers import Job, each
from nanorom.errors import NanoromError, SceneError
from nanorom.files.lines import Lines
from nanorom.files.whole import check_writable
from nanorom.launch import watched
from nanorom.results.study import Study
from nanorom.scene.scene import Scene
from nanorom.types import Progress

RANKS = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE")  # how many a launcher of MPI has started


def study(
    scene: Scene | str | Path,
    vary: Mapping[str, Any],
    of: Sequence[str] | None = None,
    *,
    samples: int | None = None,
    method: str = "sobol",
    seed: int = 0,
    seconds: float = SECONDS,
    processes: int | None = None,
    path: str | Path | None = None,
    progress: Progress | None = None,
) -> Study:
    """Quantities of many devices, each the scene, or that in a file, with other values of keys.

    vary: what keys such as plate.thickness take: a list of values or ``{"from": "5 nm", "to": "50
    nm", "count": 10}`` (``"spacing": "log"``) makes a grid; ``{"from": ..., "to": ...}`` without
    a count is drawn evenly, ``"10 nm +- 3 %"`` or ``{"mean": ..., "deviation": ...}`` from a normal
    distribution.  Every point of the grid is taken with each of the ``samples``.  of: names as for
    `nanorom.sensitivity`, all frequencies and own cubic coefficients if left out.
    method: sobol or latin (hypercube) (scipy.stats.qmc), or random.  seconds: that one device may
    take.  processes: that work at once, the cores at hand if left out.

    A device that cannot be computed is a row with the reason.  With a path the table is saved
    there; rows are kept beside it until then, and the same call goes on from them if it was
    interrupted (those that failed are tried again).  Raises SceneError, ModelError for what is
    asked, FileError if the table cannot be written, NanoromError under MPI.
    """
    request = Request.of_table(scene, vary, of, Sampling(samples, method, seed), seconds)
    return carry_out(request, processes, path, progress)


def carry_out(
    request: Request,
    processes: int | None = None,
    path: str | Path | None = None,
    progress: Progress | None = None,
) -> Study:
    """The table of a request; parameters and errors as of `study`."""
    count = workers(processes)
    if path is not None:
        check_writable(path)
    kept = Lines(path, request.key)
    rows = len(request.rows)
    known = {row: found for row, found in kept.found.items() if _fits(found, request, row)}
    left = [row for row in range(rows) if row not in known]
    with watched(progress) as told:
        told("devices", rows - len(left), rows)
        for row, found in each(_jobs(request, left), count, request.seconds):
            kept.keep(row, found)
            known[row] = found
            told("devices", len(known), rows)
    table = _table(request, [known[row] for row in range(rows)])
    if path is not None:
        table.save(path)
        kept.finished()
    return table


def workers(processes: int | None) -> int:
    """How many processes work at once; raises SceneError, NanoromError under MPI."""
    if any(int(os.environ.get(name, "1")) > 1 for name in RANKS):
        raise NanoromError("this starts processes of its own; start it without mpirun")
    count = cores() if processes is None else processes
    if count < 1:
        raise SceneError(f"processes: found {processes}; allowed: 1 or more")
    return count


def _jobs(request: Request, rows: Sequence[int]) -> Iterator[Job]:
    directory = str(request.directory.resolve())
    for row in rows:
        yield row, {"scene": request.tables(row), "directory": directory, "of": request.of}


def _fits(found: dict[str, Any], request: Request, row: int) -> bool:
    """Whether a row that was kept is one of this study; one that failed is tried again."""
    return row < len(request.rows) and len(found.get("values", ())) == len(request.of)


def _table(request: Request, found: Sequence[Mapping[str, Any]]) -> Study:
    none = [np.nan] * len(request.of)
    units = next((each["units"] for each in found if "units" in each), [""] * len(request.of))
    return Study(
        scene=request.first_valid().to_toml(),
        by=tuple(variation.key for variation in request.varied),
        by_unit=tuple(variation.unit for variation in request.varied),
        words=request.words,
        setting=request.settings,
        of=request.of,
        of_unit=tuple(units),
        value=np.array([each.get("values", none) for each in found], dtype=float),
        failed=np.array(["failure" in each for each in found]),
        remark=tuple(each.get("failure", each.get("remark", "")) for each in found),
    )
