"""Export as a functional mock-up unit (FMI 2.0, Model Exchange): for Simulink, OpenModelica, FMPy.

Source: FMI 2.0.4, fmi-standard.org. The unit holds its C sources, which a program can compile for
its own platform; compiled ones are added where there is a C compiler.
"""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import tempfile
import uuid
import zipfile
from importlib.resources import files
from pathlib import Path

import numpy as np

from nanorom.continuation.drive import CARRIER
from nanorom.continuation.scaled import ScaledSystem
from nanorom.continuation.system import ModalSystem
from nanorom.export.polynomial import acceleration
from nanorom.files.whole import atomic_path
from nanorom.types import Array

NAME = "modal"
INPUTS = ("direct", "parametric")
SHOWN = 100  # periods of the lowest mode that a program runs at first
COMPILED = {("Linux", "x86_64"): "linux64"}  # platforms as FMI 2.0 names them
OPTIONS = ("-O2", "-fPIC", "-shared", "-std=c99")
PATIENCE = 120  # seconds for the compiler


def write_fmu(
    system: ModalSystem,
    path: Path,
    omega: tuple[float, float] | None,
    direct: float,
    parametric: float,
) -> None:
    """Write a unit with the inputs direct and parametric and the outputs q1 ... qL.

    Inputs are the drive patterns' levels at every moment (1 for 1 Pa, 1 N/m), outputs amplitudes
    in m where the system is in SI; speeds v1 ... vL are states, too.  Raises FileError where the
    file cannot be written.
    """
    scaled = system.scaled(1.0, 1.0)
    code = files("nanorom.export.fmu").joinpath("modal.c").read_text(encoding="utf-8")
    tables = _tables(scaled)
    identity = f"{{{uuid.uuid5(uuid.NAMESPACE_OID, code + tables)}}}"
    sources = {"modal.c": code, "modal.h": f'#define GUID "{identity}"\n{tables}'}
    content: dict[str, str | bytes] = {f"sources/{name}": text for name, text in sources.items()}
    content["modelDescription.xml"] = description(scaled, identity)
    content |= _compiled(sources)
    with (
        atomic_path(path) as temporary,
        zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as fmu,
    ):
        for name, data in content.items():
            fmu.writestr(name, data)


def description(scaled: ScaledSystem, identity: str) -> str:
    """modelDescription.xml: the variables with their units, and which are states."""
    n, speed = scaled.size, scaled.amplitude * scaled.frequency
    lines, number = [], 0
    for kind, causality, details in (
        *((name, "input", 'start="0"') for name in INPUTS),
        *((f"q{r + 1}", "output", _state("m", scaled.amplitude)) for r in range(n)),
        *((f"v{r + 1}", "local", _state("m/s", speed)) for r in range(n)),
        *((f"der(q{r + 1})", "local", f'unit="m/s" derivative="{3 + r}"') for r in range(n)),
        *((f"der(v{r + 1})", "local", f'unit="m/s2" derivative="{3 + n + r}"') for r in range(n)),
    ):
        exact = ' initial="exact"' if kind[0] in "qv" else ""
        lines.append(
            f'<ScalarVariable name="{kind}" valueReference="{number}" causality="{causality}" '
            f'variability="continuous"{exact}><Real {details}/></ScalarVariable>'
        )
        number += 1
    outputs = "".join(f'<Unknown index="{3 + r}"/>' for r in range(n))
    slopes = "".join(f'<Unknown index="{3 + 2 * n + r}"/>' for r in range(2 * n))
    end = SHOWN * 2 * np.pi / scaled.frequency
    units = {"m": 'm="1"', "m/s": 'm="1" s="-1"', "m/s2": 'm="1" s="-2"'}
    defined = "".join(f'<Unit name="{u}"><BaseUnit {base}/></Unit>' for u, base in units.items())
    return "\n".join(
        [
            '<?xml version="1.0" encoding="UTF-8"?>',
            f'<fmiModelDescription fmiVersion="2.0" modelName="{NAME}" guid="{identity}" '
            'generationTool="nanorom" variableNamingConvention="structured" '
            'numberOfEventIndicators="0">',
            f'<ModelExchange modelIdentifier="{NAME}" completedIntegratorStepNotNeeded="true">'
            '<SourceFiles><File name="modal.c"/></SourceFiles></ModelExchange>',
            f"<UnitDefinitions>{defined}</UnitDefinitions>",
            f'<DefaultExperiment startTime="0" stopTime="{end!r}"/>',
            "<ModelVariables>",
            *lines,
            "</ModelVariables>",
            f"<ModelStructure><Outputs>{outputs}</Outputs><Derivatives>{slopes}</Derivatives>"
            f"<InitialUnknowns>{slopes}</InitialUnknowns></ModelStructure>",
            "</fmiModelDescription>",
            "",
        ]
    )


def _state(unit: str, size: float) -> str:
    return f'unit="{unit}" start="0" nominal="{float(size)!r}"'


def _tables(scaled: ScaledSystem) -> str:
    """Sizes, units and coefficients of the equations, in C."""
    n = scaled.size
    lines = [
        f"#define MODES {n}",
        f"#define FREQUENCY {float(scaled.frequency)!r} /* rad/s */",
        f"#define AMPLITUDE {float(scaled.amplitude)!r} /* m */",
    ]
    for order, terms in enumerate(acceleration(scaled), 1):
        count = len(terms.index)
        places, values = terms.index.reshape(-1, order), terms.coefficient.T.reshape(-1, n)
        lines += [
            f"#define COUNT{order} {count}",
            _array("int", f"index{order}[{max(count, 1)}][{order}]", places),
            _array("double", f"coefficient{order}[{max(count, 1)}][MODES]", values),
        ]
    lines += [
        _array("double", "force[MODES]", scaled.force[:, CARRIER]),
        _array("double", "parametric[MODES][MODES]", scaled.parametric[..., CARRIER]),
    ]
    return "\n".join([*lines, ""])


def _array(kind: str, name: str, values: Array | np.ndarray) -> str:
    """A constant array; one zero where it would be empty, which C does not have."""
    nested = values.tolist() or [0]
    text = repr(nested).replace("[", "{").replace("]", "}")
    return f"static const {kind} {name} = {text};"


def _compiled(sources: dict[str, str]) -> dict[str, bytes]:
    """The library for this platform, by its place in the unit; nothing without a compiler."""
    folder = COMPILED.get((platform.system(), platform.machine()))
    compiler = shutil.which(os.environ.get("CC", "cc")) or shutil.which("gcc")
    if folder is None or compiler is None:
        return {}
    with tempfile.TemporaryDirectory() as work:
        for name, text in sources.items():
            Path(work, name).write_text(text, encoding="utf-8")
        command = [compiler, *OPTIONS, "modal.c", "-o", f"{NAME}.so"]
        done = subprocess.run(command, cwd=work, capture_output=True, timeout=PATIENCE, check=False)
        if done.returncode:
            return {}
        return {f"binaries/{folder}/{NAME}.so": Path(work, f"{NAME}.so").read_bytes()}
