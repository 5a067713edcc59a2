"""The initial shape of a film, read from a table of points."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
from mpi4py import MPI

from nanorom.errors import SceneError

LARGEST_FILE = 100_000_000  # bytes
ON_A_LINE = 1e-9  # breadth by length of a cloud of points
KEY = "plate.initial_shape"
INSIDE = 1e-9  # points on the film's edge are looked up so much nearer to its centre


def read_table(path: Path) -> np.ndarray:
    """Table (n, 3) of x, y and height z in m, CSV or blank-separated; raises SceneError."""
    if path.stat().st_size > LARGEST_FILE:
        raise SceneError(f"{KEY}: {path} is larger than {LARGEST_FILE // 1_000_000} MB")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of an empty file
            table = np.loadtxt(path, delimiter="," if path.suffix == ".csv" else None, ndmin=2)
    except (OSError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise SceneError(f"{KEY}: {path} is not a table of numbers: {reason}") from None
    if table.shape[1] != 3 or len(table) < 3 or not np.isfinite(table).all():
        raise SceneError(f"{KEY}: {path} has not three columns of finite numbers x, y, z")
    spread = table[:, :2] - table[:, :2].mean(axis=0)
    low, high = np.sqrt(np.abs(np.linalg.eigvalsh(spread.T @ spread)))
    if not low > ON_A_LINE * high:
        raise SceneError(f"{KEY}: the points of {path} lie on a line; they must cover the film")
    return np.asarray(table)


def read(file: Path, comm: MPI.Comm = MPI.COMM_SELF) -> Callable[[np.ndarray], np.ndarray]:
    """Height (n,) in m at points (n, 2) in m, from a table of x, y, z in m.

    Interpolated with continuous slope (Clough and Tocher) between the table's points, which may
    lie on a grid or anywhere.  Raises SceneError here if the file is no such table, and on calling,
    on every rank alike, if its points do not cover the film.
    """
    from scipy.interpolate import CloughTocher2DInterpolator

    table = read_table(file)
    size = np.ptp(table[:, :2], axis=0).max()
    interpolate = CloughTocher2DInterpolator(table[:, :2] / size, table[:, 2])

    def height(points: np.ndarray) -> np.ndarray:
        found = np.asarray(interpolate(points * ((1 - INSIDE) / size)))
        if comm.allreduce(int(np.isnan(found).any())):
            raise SceneError(f"{KEY}: the points of {file} do not cover the film")
        return found

    return height
