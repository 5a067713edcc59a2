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
    from nanorom.devices.design import design
    from nanorom.devices.study import study
    from nanorom.errors import NanoromError
    from nanorom.measurement.device.identify import identify_sweeps
    from nanorom.results.design import Design
    from nanorom.results.loadcurve import LoadCurve
    from nanorom.results.respond import respond
    from nanorom.results.response import Response
    from nanorom.results.sensitivity import Sensitivity
    from nanorom.results.study import Study
    from nanorom.results.verified import Verified
    from nanorom.rom.model import ReducedModel
    from nanorom.rom.shapes import Shapes
    from nanorom.scene.drive import Drive
    from nanorom.scene.excitation import Damping, Excitation, Frequency, Sweep
    from nanorom.scene.film import Plate, Tension
    from nanorom.scene.gate import Gate
    from nanorom.scene.geometry import Disc, MeshFile, Rectangle, String
    from nanorom.scene.instrument import Instrument
    from nanorom.scene.layers import Layer, Stack
    from nanorom.scene.load import Load
    from nanorom.scene.mass import AddedMass
    from nanorom.scene.material import Gas, Material
    from nanorom.scene.outlines import (
        DiscRegion,
        PolygonRegion,
        RectangleRegion,
        RingRegion,
        SurfaceRegion,
    )
    from nanorom.scene.scene import Accuracy, Modes, Reduction, Scene
    from nanorom.scene.support import Edge, PlaneSpring, Spring, Support
    from nanorom.scene.waves import Harmonic
    from nanorom.workflow import full_orbit, manifold, reduce, run, sensitivity, tune, verify

_HOMES = {
    "devices.design": ("design",),
    "devices.study": ("study",),
    "errors": ("NanoromError",),
    "measurement.device.identify": ("identify_sweeps",),
    "results.design": ("Design",),
    "results.loadcurve": ("LoadCurve",),
    "results.respond": ("respond",),
    "results.response": ("Response",),
    "results.sensitivity": ("Sensitivity",),
    "results.study": ("Study",),
    "results.verified": ("Verified",),
    "rom.model": ("ReducedModel",),
    "rom.shapes": ("Shapes",),
    "scene.drive": ("Drive",),
    "scene.waves": ("Harmonic",),
    "scene.excitation": (
        "Damping",
        "Excitation",
        "Frequency",
        "Sweep",
    ),
    "scene.film": ("Plate", "Tension"),
    "scene.gate": ("Gate",),
    "scene.geometry": (
        "Disc",
        "MeshFile",
        "Rectangle",
        "String",
    ),
    "scene.instrument": ("Instrument",),
    "scene.layers": ("Layer", "Stack"),
    "scene.load": ("Load",),
    "scene.mass": ("AddedMass",),
    "scene.material": ("Gas", "Material"),
    "scene.outlines": (
        "DiscRegion",
        "PolygonRegion",
        "RectangleRegion",
        "RingRegion",
        "SurfaceRegion",
    ),
    "scene.scene": (
        "Accuracy",
        "Modes",
        "Reduction",
        "Scene",
    ),
    "scene.support": (
        "Edge",
        "PlaneSpring",
        "Spring",
        "Support",
    ),
    "workflow": (
        "full_orbit",
        "manifold",
        "reduce",
        "run",
        "sensitivity",
        "tune",
        "verify",
    ),
}
_ROOMS = ("continuation", "plots")  # that are used as nanorom.ROOM without an import
_HOME = {name: module for module, names in _HOMES.items() for name in names}

__all__ = [
    "Accuracy",
    "AddedMass",
    "Damping",
    "Design",
    "Disc",
    "DiscRegion",
    "Drive",
    "Edge",
    "Excitation",
    "Frequency",
    "Gas",
    "Gate",
    "Harmonic",
    "Instrument",
    "Layer",
    "Load",
    "LoadCurve",
    "Material",
    "MeshFile",
    "Modes",
    "NanoromError",
    "PlaneSpring",
    "Plate",
    "PolygonRegion",
    "Rectangle",
    "RectangleRegion",
    "ReducedModel",
    "Reduction",
    "Response",
    "RingRegion",
    "Scene",
    "Sensitivity",
    "Shapes",
    "Spring",
    "Stack",
    "String",
    "Study",
    "Support",
    "SurfaceRegion",
    "Sweep",
    "Tension",
    "Verified",
    "design",
    "full_orbit",
    "identify_sweeps",
    "manifold",
    "reduce",
    "respond",
    "run",
    "sensitivity",
    "study",
    "tune",
    "verify",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return import_module("nanorom.version").version()
    if name in _ROOMS:
        return import_module(f"nanorom.{name}")
    if name not in _HOME:
        raise AttributeError(f"module 'nanorom' has no attribute {name!r}")
    value = getattr(import_module(f"nanorom.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    named = (name for name in globals() if name.startswith("__") and name.endswith("__"))
    return sorted({*named, *__all__, *_ROOMS, "__version__"})
