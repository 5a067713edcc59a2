"""Reduced-order models of nanomechanical resonators from first principles.

    import nanorom
    scene = nanorom.Scene.from_file("drum.toml")
    model = nanorom.reduce(scene)                          # needs DOLFINx
    model.save("rom.h5")
    response = nanorom.respond(model, scene.drive, scene.sweep)   # needs SciPy only

Names are loaded when they are first used: importing the package is cheap.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nanorom.errors import NanoromError
    from nanorom.excitation import Damping, Drive, Excitation, Frequency, Sweep
    from nanorom.loadcurve import LoadCurve
    from nanorom.response import Response, respond
    from nanorom.rom import ReducedModel, Shapes
    from nanorom.scene import (
        Accuracy,
        Disc,
        Load,
        Material,
        MeshFile,
        Modes,
        Plate,
        Rectangle,
        Reduction,
        Scene,
        Spring,
        String,
        Support,
        Tension,
    )
    from nanorom.workflow import reduce, run, tune

_HOMES = {
    "errors": ("NanoromError",),
    "excitation": ("Damping", "Drive", "Excitation", "Frequency", "Sweep"),
    "loadcurve": ("LoadCurve",),
    "response": ("Response", "respond"),
    "rom": ("ReducedModel", "Shapes"),
    "scene": (
        "Accuracy",
        "Disc",
        "Load",
        "Material",
        "MeshFile",
        "Modes",
        "Plate",
        "Rectangle",
        "Reduction",
        "Scene",
        "Spring",
        "String",
        "Support",
        "Tension",
    ),
    "workflow": ("reduce", "run", "tune"),
}
_HOME = {name: module for module, names in _HOMES.items() for name in names}

__all__ = [
    "Accuracy",
    "Damping",
    "Disc",
    "Drive",
    "Excitation",
    "Frequency",
    "Load",
    "LoadCurve",
    "Material",
    "MeshFile",
    "Modes",
    "NanoromError",
    "Plate",
    "Rectangle",
    "ReducedModel",
    "Reduction",
    "Response",
    "Scene",
    "Shapes",
    "Spring",
    "String",
    "Support",
    "Sweep",
    "Tension",
    "reduce",
    "respond",
    "run",
    "tune",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return _version()
    if name not in _HOME:
        raise AttributeError(f"module 'nanorom' has no attribute {name!r}")
    value = getattr(import_module(f"nanorom.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def _version() -> str:
    from importlib import metadata

    try:
        return metadata.version("nanorom")
    except metadata.PackageNotFoundError:
        return "unknown (not installed)"


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
