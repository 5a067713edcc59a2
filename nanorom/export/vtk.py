"""Mode shapes and moving films for ParaView and other readers of VTKHDF.

Source: docs.vtk.org, "VTKHDF file format", also of the group Steps.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import h5py
import numpy as np

from nanorom.continuation import PeriodicOrbit
from nanorom.errors import ModelError
from nanorom.files.whole import atomic_path
from nanorom.rom.model import ReducedModel
from nanorom.rom.motion import deflection
from nanorom.rom.shapes import Shapes

TRIANGLE = 5  # VTK's number of that cell
VERSION = (2, 0)
INSTANTS = 64  # of a period


def write_vtk(model: ReducedModel, path: Path) -> None:
    """Write the triangulation with a point array per mode, "1 f01", and the static deflection.

    Shapes are numbers with max |phi| = 1, places and deflection in m.  Raises ModelError without
    shapes, FileError where the file cannot be written.
    """
    shapes = model.shapes
    if shapes is None:
        raise ModelError("shapes: the model has none, so there is nothing to draw")
    fields = {
        f"{number} {label}": values
        for number, label, values in zip(model.number, model.label, shapes.values)
    }
    if "deflection" in model.static:
        fields["static deflection (m)"] = model.static["deflection"]
    with _grid(shapes, path) as group:
        for name, values in fields.items():
            group[f"PointData/{name.replace('/', '|')}"] = values


def write_motion(
    model: ReducedModel, orbit: PeriodicOrbit, path: Path, instants: int = INSTANTS
) -> None:
    """Write the deflection (0, 0, w) in m at equal steps of one period; times in s.

    ParaView's filter "Warp By Vector" moves the film by it.  Raises ModelError without shapes,
    FileError where the file cannot be written.
    """
    times = orbit.period * np.arange(instants) / instants
    w = deflection(model, orbit, times)
    assert model.shapes is not None  # or there was no deflection
    points = w.shape[1]
    vectors = np.zeros((instants * points, 3))
    vectors[:, 2] = w.ravel()
    still = np.zeros(instants, dtype=np.int64)  # one mesh serves all steps
    with _grid(model.shapes, path) as group:
        group["PointData/deflection"] = vectors
        steps = group.create_group("Steps")
        steps.attrs["NSteps"] = instants
        steps["Values"] = times
        steps["NumberOfParts"] = still + 1
        for name in ("PartOffsets", "PointOffsets"):
            steps[name] = still
        for name in ("CellOffsets", "ConnectivityIdOffsets"):
            steps[name] = still[:, None]
        steps["PointDataOffsets/deflection"] = points * np.arange(instants)


@contextmanager
def _grid(shapes: Shapes, path: Path) -> Iterator[h5py.Group]:
    """A new file with the triangulation; arrays of its points are to be added."""
    with atomic_path(path) as temporary, h5py.File(temporary, "w") as file:
        group = file.create_group("VTKHDF")
        group.attrs["Version"] = VERSION
        kind = np.bytes_("UnstructuredGrid")
        group.attrs.create("Type", kind, dtype=h5py.string_dtype("ascii", len(kind)))
        cells = len(shapes.cells)
        counts = {"Points": len(shapes.points), "Cells": cells, "ConnectivityIds": 3 * cells}
        for name, count in counts.items():
            group[f"NumberOf{name}"] = np.array([count])
        group["Points"] = shapes.points
        group["Connectivity"] = shapes.cells.ravel()
        group["Offsets"] = 3 * np.arange(cells + 1)
        group["Types"] = np.full(cells, TRIANGLE, dtype=np.uint8)
        yield group
