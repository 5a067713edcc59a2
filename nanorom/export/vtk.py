"""Mode shapes for ParaView and other readers of VTKHDF (docs.vtk.org, "VTKHDF file format")."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from nanorom.errors import ModelError
from nanorom.files.whole import atomic_path
from nanorom.rom.model import ReducedModel

TRIANGLE = 5  # VTK's number of that cell
VERSION = (1, 0)


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
        for name, values in fields.items():
            group[f"PointData/{name.replace('/', '|')}"] = values
