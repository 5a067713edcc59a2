"""The file `rom.h5`: the wall between the finite-element half and the SciPy half."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import h5py

from nanorom.errors import FileError
from nanorom.files import hdf5
from nanorom.rom.model import OPTIONAL, ReducedModel
from nanorom.rom.shapes import Shapes
from nanorom.scene.scene import MOST_MODES

FORMAT = "nanorom-rom"
FORMAT_VERSION = 1
NORMALIZATION = "max"
MORE_THAN_REPORTED = 2.0  # the file may measure its asymmetry in another norm
ROUND_OFF = 1e-9

# dataset -> number of mode indices, unit
DATASETS = {
    "frequency": (1, "Hz"),
    "mass": (1, "kg"),
    "number": (1, "1"),
    "stiffness": (2, "N/m"),
    "damping": (2, "kg/s"),
    "quadratic": (3, "N/m^2"),
    "cubic": (4, "N/m^3"),
}
OPTIONAL_UNITS = {"bending": "N/m", "stretching": "N/m^3", "cubic_damping": "N s/m^3"}
PATTERNS = {"drive": (1, "N per unit of the level"), "parametric": (2, "N/m per unit of the level")}
# state about which the model is expanded: shape (None: any length), unit
STATIC: dict[str, tuple[tuple[int | None, ...], str]] = {
    "deflection": ((None,), "m"),
    "largest_deflection": ((), "m"),
    "centre_deflection": ((), "m"),
    "mean_tension": ((), "N/m"),
}
TEXTS = ("scene", "method", "in_plane")


def save(model: ReducedModel, path: str | Path) -> None:
    """Write a reduced model, whole or not at all; raises FileError."""
    with hdf5.create(path, FORMAT, FORMAT_VERSION) as file:
        file.attrs["normalization"] = NORMALIZATION
        file.attrs["versions"] = json.dumps(model.versions, sort_keys=True)
        for name in TEXTS:
            file.attrs[name] = getattr(model, name)
        for name, (_, unit) in DATASETS.items():
            hdf5.write(file, name, getattr(model, name), unit)
        for name, unit in OPTIONAL_UNITS.items():
            if getattr(model, name) is not None:
                hdf5.write(file, name, getattr(model, name), unit)
        hdf5.write_names(file, "label", model.label)
        for kind, (_, unit) in PATTERNS.items():
            patterns = file.create_group(kind)
            for name, pattern in getattr(model, kind).items():
                hdf5.write(patterns, name, pattern, unit)
        if model.shapes is not None:
            shapes = file.create_group("shapes")
            hdf5.write(shapes, "points", model.shapes.points, "m")
            hdf5.write(shapes, "cells", model.shapes.cells)
            hdf5.write(shapes, "values", model.shapes.values)
        for name, value in model.static.items():
            hdf5.write(file, f"static/{name}", value, STATIC[name][1])
        hdf5.write_attributes(file.create_group("diagnostics"), model.diagnostics)


def load(path: str | Path) -> ReducedModel:
    """Read a reduced model; raises FileError naming the file and what is wrong with it."""
    with hdf5.opened(path, FORMAT, FORMAT_VERSION) as file:
        model = _read(file)
        _check_potential(model)
    return model


def _read(file: h5py.File) -> ReducedModel:
    normalization = hdf5.text(file.attrs.get("normalization", ""))
    if normalization != NORMALIZATION:
        raise FileError(f"normalization: found {normalization!r}; expected {NORMALIZATION!r}")
    n = hdf5.dataset(file, "frequency", (None,)).shape[0]
    if n > MOST_MODES:
        raise FileError(f"frequency: found {n} modes; at most {MOST_MODES} are read")
    arrays: dict[str, Any] = {
        name: hdf5.read(file, name, (n,) * rank) for name, (rank, _) in DATASETS.items()
    }
    for name, rank in OPTIONAL.items():
        if name in file:
            arrays[name] = hdf5.read(file, name, (n,) * rank)
    patterns: dict[str, Any] = {
        kind: {
            name: hdf5.read(file, f"{kind}/{name}", (n,) * rank)
            for name in sorted(hdf5.group(file, kind))
        }
        for kind, (rank, _) in PATTERNS.items()
    }
    texts: dict[str, Any] = {name: hdf5.text(file.attrs.get(name, "")) for name in TEXTS}
    return ReducedModel(
        **arrays,
        **patterns,
        **texts,
        label=hdf5.read_names(file, "label", n),
        shapes=_shapes(file, n),
        static=_static(file),
        diagnostics=hdf5.read_attributes(hdf5.group(file, "diagnostics")),
        versions=hdf5.from_json(hdf5.text(file.attrs.get("versions", "{}"))),
    )


def _shapes(file: h5py.File, n: int) -> Shapes | None:
    if "shapes" not in file:
        return None
    points = hdf5.read(file, "shapes/points", (None, 3))
    cells = hdf5.read(file, "shapes/cells", (None, 3), kinds="iu")
    return Shapes(points, cells, hdf5.read(file, "shapes/values", (n, len(points))))


def _static(file: h5py.File) -> dict[str, Any]:
    if "static" not in file:
        return {}
    held = hdf5.group(file, "static")
    return {
        name: hdf5.read(file, f"static/{name}", shape)
        for name, (shape, _) in STATIC.items()
        if name in held
    }


def _check_potential(model: ReducedModel) -> None:
    reported = model.diagnostics.get("asymmetry", 0.0)
    reported = float(reported) if isinstance(reported, (int, float)) else 0.0
    if not model.asymmetry <= MORE_THAN_REPORTED * reported + ROUND_OFF:
        raise FileError(
            f"quadratic, cubic: deviate from a potential by {model.asymmetry:.1e}, but the file "
            f"reports {reported:.1e}; reduce the scene again"
        )
