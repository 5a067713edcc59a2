"""The initial shape of a film, read from a table of points."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from mpi4py import MPI

from nanorom.errors import SceneError

KEY = "plate.initial_shape"
INSIDE = 1e-9  # points on the film's edge are looked up so much nearer to its centre


def read(file: Path, comm: MPI.Comm = MPI.COMM_SELF) -> Callable[[np.ndarray], np.ndarray]:
    """Height (n,) in m at points (n, 2) in m, from a table of x, y, z in m.

    Interpolated with continuous slope (Clough and Tocher) between the table's points, which may
    lie on a grid or anywhere.  Raises SceneError here if the file is no such table, and on calling,
    on every rank alike, if its points do not cover the film.
    """
    from scipy.interpolate import CloughTocher2DInterpolator

    try:
        table = np.loadtxt(file, delimiter="," if file.suffix == ".csv" else None, ndmin=2)
    except (OSError, ValueError) as error:
        raise SceneError(f"{KEY}: {file} is not a table of numbers: {error}") from None
    if table.shape[1] != 3 or len(table) < 3 or not np.isfinite(table).all():
        raise SceneError(f"{KEY}: {file} has not three columns of finite numbers x, y, z")
    size = np.ptp(table[:, :2], axis=0).max()
    if not size > 0:
        raise SceneError(f"{KEY}: the points of {file} all lie in one place")
    interpolate = CloughTocher2DInterpolator(table[:, :2] / size, table[:, 2])

    def height(points: np.ndarray) -> np.ndarray:
        found = np.asarray(interpolate(points * ((1 - INSIDE) / size)))
        if comm.allreduce(int(np.isnan(found).any())):
            raise SceneError(f"{KEY}: the points of {file} do not cover the film")
        return found

    return height
