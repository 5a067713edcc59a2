"""The file `rom.h5`: the wall between the finite-element half and the SciPy half.

Read without trust: shapes and types are checked before anything is allocated, links to other
files are refused, and nothing in the file is executed.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import metadata
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from nanorom.errors import FileError, ModelError
from nanorom.files import atomic_path
from nanorom.rom import ReducedModel, Shapes
from nanorom.scene import MOST_MODES

FORMAT = "nanorom-rom"
FORMAT_VERSION = 1
NORMALIZATION = "max"
MOST_NUMBERS = 200_000_000  # entries of one dataset; a longer one is not read
MORE_THAN_REPORTED = 2.0  # the file may measure its asymmetry in another norm
ROUND_OFF = 1e-9

UNITS = {
    "frequency": "Hz",
    "mass": "kg",
    "number": "1",
    "stiffness": "N/m",
    "damping": "kg/s",
    "quadratic": "N/m^2",
    "cubic": "N/m^3",
}
MEANINGS = {"drive": "N per unit of the level", "parametric": "N/m per unit of the level"}


def save(model: ReducedModel, path: str | Path) -> None:
    """Write a reduced model, whole or not at all; raises FileError."""
    with atomic_path(path) as temporary, h5py.File(temporary, "w") as file:
        file.attrs.update(
            format=FORMAT,
            format_version=FORMAT_VERSION,
            nanorom_version=_version(),
            versions=json.dumps(model.versions, sort_keys=True),
            scene=model.scene,
            method=model.method,
            in_plane=model.in_plane,
            normalization=NORMALIZATION,
        )
        for name, unit in UNITS.items():
            file[name] = getattr(model, name)
            file[name].attrs["unit"] = unit
        file.create_dataset("label", data=list(model.label), dtype=h5py.string_dtype())
        for group, meaning in MEANINGS.items():
            file.create_group(group)
            for name, pattern in getattr(model, group).items():
                file[group][name] = pattern
                file[group][name].attrs["unit"] = meaning
        if model.shapes is not None:
            file["shapes/points"] = model.shapes.points
            file["shapes/points"].attrs["unit"] = "m"
            file["shapes/cells"] = model.shapes.cells
            file["shapes/values"] = model.shapes.values
        diagnostics = file.create_group("diagnostics").attrs
        for name, value in model.diagnostics.items():
            diagnostics[name] = (
                json.dumps(value, default=float) if isinstance(value, Mapping) else value
            )


def load(path: str | Path) -> ReducedModel:
    """Read a reduced model; raises FileError naming the file and what is wrong with it."""
    path = Path(path)
    if not path.is_file():
        raise FileError(f"{path}: no such file")
    with _one_line(path):
        try:
            file = h5py.File(path, "r")
        except OSError:
            raise FileError(f"{path}: not an HDF5 file, or cut short") from None
        with file:
            _check_format(file, path)
            model = _read(file)
    reported = model.diagnostics.get("asymmetry", 0.0)
    reported = float(reported) if isinstance(reported, (int, float)) else 0.0
    if not model.asymmetry <= MORE_THAN_REPORTED * reported + ROUND_OFF:
        raise FileError(
            f"{path}: the tensors deviate from a potential by {model.asymmetry:.1e}, "
            f"but the file reports {reported:.1e}; reduce the scene again"
        )
    return model


@contextmanager
def _one_line(path: Path) -> Iterator[None]:
    """Whatever HDF5 says about a damaged file, in one line with the file's name."""
    try:
        yield
    except FileError:
        raise
    except ModelError as error:
        raise FileError(f"{path}: {error}") from None
    except (OSError, RuntimeError, KeyError, ValueError, TypeError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise FileError(f"{path}: damaged, or not a reduced model: {reason}") from None


def _check_format(file: h5py.File, path: Path) -> None:
    if _text(file.attrs.get("format", "")) != FORMAT:
        raise FileError(f"{path}: an HDF5 file, but not a reduced model of nanorom")
    version = file.attrs.get("format_version")
    if not isinstance(version, (int, np.integer)) or version < 1:
        raise ModelError(f"format_version: found {version!r}; expected {FORMAT_VERSION}")
    if version > FORMAT_VERSION:
        raise ModelError(
            f"format_version: found {version}, this nanorom reads up to {FORMAT_VERSION}; "
            "use a newer nanorom"
        )
    normalization = _text(file.attrs.get("normalization", ""))
    if normalization != NORMALIZATION:
        raise ModelError(f"normalization: found {normalization!r}; expected {NORMALIZATION!r}")


def _read(file: h5py.File) -> ReducedModel:
    n = _dataset(file, "frequency", (None,)).shape[0]
    if n > MOST_MODES:
        raise ModelError(f"frequency: found {n} modes; at most {MOST_MODES} are read")
    ranks = {"frequency": 1, "mass": 1, "number": 1, "stiffness": 2, "damping": 2}
    ranks |= {"quadratic": 3, "cubic": 4}
    arrays = {name: _dataset(file, name, (n,) * rank)[()] for name, rank in ranks.items()}
    drive = {k: _dataset(file, f"drive/{k}", (n,))[()] for k in _members(file, "drive")}
    parametric = {
        k: _dataset(file, f"parametric/{k}", (n, n))[()] for k in _members(file, "parametric")
    }
    attributes = {name: _text(file.attrs.get(name, "")) for name in ("scene", "method", "in_plane")}
    return ReducedModel(
        **arrays,
        **attributes,
        label=[_text(x) for x in _dataset(file, "label", (n,), kinds="OSU")[()]],
        drive=drive,
        parametric=parametric,
        shapes=_shapes(file, n),
        diagnostics=_diagnostics(file),
        versions=_json(_text(file.attrs.get("versions", "{}"))),
    )


def _shapes(file: h5py.File, n: int) -> Shapes | None:
    if "shapes" not in file:
        return None
    points = _dataset(file, "shapes/points", (None, 3))
    cells = _dataset(file, "shapes/cells", (None, 3), kinds="iu")
    values = _dataset(file, "shapes/values", (n, points.shape[0]))
    return Shapes(points[()], cells[()], values[()])


def _diagnostics(file: h5py.File) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, value in file["diagnostics"].attrs.items() if "diagnostics" in file else ():
        if isinstance(value, (str, bytes)):
            text = _text(value)
            found[name] = _json(text) if text.startswith("{") else text
        else:
            found[name] = value.item() if np.ndim(value) == 0 else np.asarray(value)
    return found


def _dataset(
    file: h5py.File, name: str, shape: tuple[int | None, ...], kinds: str = "fiu"
) -> h5py.Dataset:
    """A dataset of the expected shape (None: any length) and kind of type, not yet read."""
    *groups, last = name.split("/")
    parent = _group(file, groups[0]) if groups else file
    link = parent.get(last, getlink=True)
    dataset = parent.get(last) if isinstance(link, h5py.HardLink) else None
    if not isinstance(dataset, h5py.Dataset):
        raise ModelError(f"{name}: missing, or not a dataset of this file")
    if dataset.external is not None or dataset.is_virtual:
        raise ModelError(f"{name}: its numbers are outside the file")
    if len(dataset.shape) != len(shape) or any(
        wanted not in (None, found) for wanted, found in zip(shape, dataset.shape)
    ):
        wanted = "(" + ", ".join("any" if s is None else str(s) for s in shape) + ")"
        raise ModelError(f"{name}: found shape {dataset.shape}; expected {wanted}")
    if dataset.dtype.kind not in kinds:
        raise ModelError(f"{name}: found type {dataset.dtype}; expected numbers or names")
    if dataset.size > MOST_NUMBERS:
        raise ModelError(f"{name}: found {dataset.size} entries; at most {MOST_NUMBERS} are read")
    return dataset


def _group(file: h5py.File, name: str) -> h5py.Group:
    link = file.get(name, getlink=True)
    group = file.get(name) if isinstance(link, h5py.HardLink) else None
    if not isinstance(group, h5py.Group):
        raise ModelError(f"{name}: missing, or not a group of this file")
    return group


def _members(file: h5py.File, name: str) -> list[str]:
    return sorted(_group(file, name)) if name in file else []


def _json(text: str) -> dict[str, Any]:
    value = json.loads(text)
    if not isinstance(value, dict):
        raise ModelError("versions, diagnostics: expected a JSON object")
    return value


def _text(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)


def _version() -> str:
    try:
        return metadata.version("nanorom")
    except metadata.PackageNotFoundError:
        return "unknown"
