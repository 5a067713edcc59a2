"""The initial shape of a film or its tension, from a table of points or drawn at random."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
from mpi4py import MPI

from nanorom.errors import SceneError
from nanorom.scene.wrinkles import Unevenness, Wrinkles

LARGEST_FILE = 100_000_000  # bytes
ON_A_LINE = 1e-9  # breadth by length of a cloud of points
KEY = "plate.initial_shape"
SAME_LINE = 1e-6  # of the table's extent: points nearer than this share a line of their grid
INSIDE = 1e-9  # points on the film's edge are looked up so much nearer to its centre


def read_table(path: Path, key: str = KEY) -> np.ndarray:
    """Table (n, 3) of x, y in m and a value z, CSV or blank-separated; raises SceneError."""
    if path.stat().st_size > LARGEST_FILE:
        raise SceneError(f"{key}: {path} is larger than {LARGEST_FILE // 1_000_000} MB")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of an empty file
            table = np.loadtxt(path, delimiter="," if path.suffix == ".csv" else None, ndmin=2)
    except (OSError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise SceneError(f"{key}: {path} is not a table of numbers: {reason}") from None
    if table.shape[1] != 3 or len(table) < 3 or not np.isfinite(table).all():
        raise SceneError(f"{key}: {path} has not three columns of finite numbers x, y, z")
    spread = table[:, :2] - table[:, :2].mean(axis=0)
    low, high = np.sqrt(np.abs(np.linalg.eigvalsh(spread.T @ spread)))
    if not low > ON_A_LINE * high:
        raise SceneError(f"{key}: the points of {path} lie on a line; they must cover the film")
    return np.asarray(table)


def read(
    shape: Path | Wrinkles | Unevenness, comm: MPI.Comm = MPI.COMM_SELF, key: str = KEY
) -> Callable[[np.ndarray], np.ndarray]:
    """Values (n,) at points (n, 2) in m, of a random field or a table of x, y in m and z.

    A table is interpolated by cubic splines where the points lie on a grid, else with continuous
    slope (Clough and Tocher).  Raises SceneError here if the file is no such table, and on calling,
    on every rank alike, if its points do not cover the film.
    """
    if not isinstance(shape, Path):
        return shape.values
    table = read_table(shape, key)
    size = np.ptp(table[:, :2], axis=0).max()
    points, z = table[:, :2] / size, table[:, 2]
    interpolate = _on_grid(points, z) or _scattered(points, z)

    def height(points: np.ndarray) -> np.ndarray:
        found = interpolate(points * ((1 - INSIDE) / size))
        if comm.allreduce(int(np.isnan(found).any())):
            raise SceneError(f"{key}: the points of {shape} do not cover the film")
        return found

    return height


Interpolation = Callable[[np.ndarray], np.ndarray]  # points (n, 2) -> heights (n,), nan outside


def _on_grid(points: np.ndarray, z: np.ndarray) -> Interpolation | None:
    """Spline through heights on a rectangular grid, in any order; None if it is no such grid."""
    from scipy.interpolate import RectBivariateSpline

    lines, index = zip(*(_lines(coordinate) for coordinate in points.T))
    n_x, n_y = map(len, lines)
    place = index[0] * n_y + index[1]
    if len(z) != n_x * n_y or len(np.unique(place)) != len(z):
        return None
    grid = np.empty(n_x * n_y)
    grid[place] = z
    x, y = lines
    degrees = {"kx": min(3, n_x - 1), "ky": min(3, n_y - 1)}
    spline = RectBivariateSpline(x, y, grid.reshape(n_x, n_y), **degrees)

    def interpolate(at: np.ndarray) -> np.ndarray:
        inside = (x[0] <= at[:, 0]) & (at[:, 0] <= x[-1]) & (y[0] <= at[:, 1]) & (at[:, 1] <= y[-1])
        return np.where(inside, spline(*at.T, grid=False), np.nan)

    return interpolate


def _lines(coordinate: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Grid lines, sorted, of coordinates (n,) that differ by rounding, and each one's line."""
    order = np.argsort(coordinate)
    steps = np.diff(coordinate[order]) > SAME_LINE
    line = np.empty(len(coordinate), dtype=int)
    line[order] = np.concatenate([[0], np.cumsum(steps)])
    return np.bincount(line, coordinate) / np.bincount(line), line


def _scattered(points: np.ndarray, z: np.ndarray) -> Interpolation:
    from scipy.interpolate import CloughTocher2DInterpolator

    interpolate = CloughTocher2DInterpolator(points, z)
    return lambda at: np.asarray(interpolate(at))
