"""The formats that results are exported to: one row each, with who writes what of them.

Writers are "module:function", loaded when they are needed (`nanorom.files.stored.call`).
"""

from __future__ import annotations

from typing import NamedTuple


class Format(NamedTuple):
    """What a format takes, and its writers; made without attrs, which the command line spares.

    suffix: usual one of its files or folders
    system(system, path, omega, direct, parametric): modal equations at a drive level, for a range
        of drive frequencies in rad per unit of time or None
    model(model, path): a whole model
    response(response, path): a response
    motion(model, orbit, path): a model that moves on an orbit
    damped: it is for equations with damping
    """

    suffix: str
    system: str = ""
    model: str = ""
    response: str = ""
    motion: str = ""
    damped: bool = False


FORMATS = {
    "auto": Format(".auto", "nanorom.export.auto:write_auto", damped=True),
    "matlab": Format(
        ".mat",
        "nanorom.export.tables:write_matlab",
        response="nanorom.export.response:write_matlab",
    ),
    "csv": Format(
        ".csv", "nanorom.export.tables:write_csv", response="nanorom.export.response:write_csv"
    ),
    "poscidyn": Format(".npz", "nanorom.export.poscidyn:write_poscidyn", damped=True),
    "coco": Format(".coco", "nanorom.export.coco:write_coco", damped=True),
    "verilog-a": Format(".va", "nanorom.export.verilog_a:write_verilog_a", damped=True),
    "fmu": Format(".fmu", "nanorom.export.fmu:write_fmu", damped=True),
    "vtk": Format(
        ".vtkhdf", model="nanorom.export.vtk:write_vtk", motion="nanorom.export.vtk:write_motion"
    ),
}


def names(of_response: bool) -> str:
    """Formats that a response, or a model, goes to, for a message."""
    able = [
        name
        for name, each in FORMATS.items()
        if (each.response or each.motion if of_response else each.system or each.model)
    ]
    return ", ".join(able)
