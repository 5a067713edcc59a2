"""The formats that results are exported to: one row each, with who writes what of them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import attrs

from nanorom.continuation import PeriodicOrbit
from nanorom.continuation.system import ModalSystem
from nanorom.export import response as responses
from nanorom.export.auto import write_auto
from nanorom.export.coco import write_coco
from nanorom.export.fmu import write_fmu
from nanorom.export.poscidyn import write_poscidyn
from nanorom.export.tables import write_csv, write_matlab
from nanorom.export.verilog_a import write_verilog_a
from nanorom.export.vtk import write_motion, write_vtk
from nanorom.results.response import Response
from nanorom.rom.model import ReducedModel

Range = tuple[float, float] | None  # of drive frequencies, rad per unit of time
SystemWriter = Callable[[ModalSystem, Path, Range, float, float], None]


@attrs.frozen
class Format:
    """What a format takes: modal equations at a drive level, a whole model, a response, or a model
    that moves on an orbit.

    damped: it is for equations with damping; suffix: usual one of its files or folders.
    """

    suffix: str
    system: SystemWriter | None = None
    model: Callable[[ReducedModel, Path], None] | None = None
    response: Callable[[Response, Path], None] | None = None
    motion: Callable[[ReducedModel, PeriodicOrbit, Path], None] | None = None
    damped: bool = False


FORMATS = {
    "auto": Format(".auto", write_auto, damped=True),
    "matlab": Format(".mat", write_matlab, response=responses.write_matlab),
    "csv": Format(".csv", write_csv, response=responses.write_csv),
    "poscidyn": Format(".npz", write_poscidyn, damped=True),
    "coco": Format(".coco", write_coco, damped=True),
    "verilog-a": Format(".va", write_verilog_a, damped=True),
    "fmu": Format(".fmu", write_fmu, damped=True),
    "vtk": Format(".vtkhdf", model=write_vtk, motion=write_motion),
}
