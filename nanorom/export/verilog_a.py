"""Export to circuit simulators: a Verilog-A module whose nodes are the modal amplitudes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from nanorom.continuation.drive import CARRIER
from nanorom.continuation.scaled import ScaledSystem
from nanorom.continuation.system import ModalSystem
from nanorom.export.polynomial import Terms, acceleration
from nanorom.files.whole import atomic_path

DIGITS = 17  # of a double


def write_verilog_a(
    system: ModalSystem,
    path: Path,
    omega: tuple[float, float] | None,
    direct: float,
    parametric: float,
) -> None:
    """Write a module with the inputs direct and parametric and the outputs q1 ... qL.

    A volt at an input is one unit of the drive pattern's level at that moment; a volt at an output
    is ``AMPLITUDE`` metres of max |phi| = 1.  Raises FileError where the file cannot be written.
    """
    scaled = system.scaled(1.0, 1.0)
    with atomic_path(path) as temporary:
        temporary.write_text(module(scaled), encoding="utf-8")


def module(scaled: ScaledSystem) -> str:
    """The text of the module of equations at drive levels of one unit."""
    n = scaled.size
    outputs = [f"q{r + 1}" for r in range(n)]
    speeds = [f"v{r + 1}" for r in range(n)]
    states = [f"V({name})" for name in outputs + speeds]
    orders = acceleration(scaled)
    lines = [
        "// Modal equations, non-dimensional inside.",
        "// V(direct), V(parametric): levels of the drive, 1 V for one unit (1 Pa, 1 N/m).",
        f"// V(q1) ... V(q{n}): amplitudes, 1 V for AMPLITUDE (m where the model is in SI).",
        '`include "disciplines.vams"',
        f"`define FREQUENCY {scaled.frequency:.{DIGITS}g} // rad/s",
        f"`define AMPLITUDE {scaled.amplitude:.{DIGITS}g}",
        "",
        f"module modal(direct, parametric, {', '.join(outputs)});",
        f"  inout direct, parametric, {', '.join(outputs)};",
        f"  electrical direct, parametric, {', '.join(outputs + speeds)};",
        "  analog begin",
    ]
    for r in range(n):
        lines.append(f"    I(q{r + 1}) <+ ddt(V(q{r + 1})) / `FREQUENCY - V(v{r + 1});")
        terms = [part for order in orders for part in _sum(order, r, states)]
        terms += _product(scaled.force[r, CARRIER], ["V(direct)"])
        for s in range(n):
            terms += _product(scaled.parametric[r, s, CARRIER], ["V(parametric)", states[s]])
        lines.append(f"    I(v{r + 1}) <+ ddt(V(v{r + 1})) / `FREQUENCY")
        lines += [f"      - ({term})" for term in terms]
        lines[-1] += ";"
    return "\n".join([*lines, "  end", "endmodule", ""])


def _sum(terms: Terms, r: int, states: list[str]) -> list[str]:
    """What the terms of one order add to one equation."""
    return [
        part
        for index, value in zip(terms.index, terms.coefficient[r])
        for part in _product(value, [states[i] for i in index])
    ]


def _product(value: np.floating | float, factors: list[str]) -> list[str]:
    return [" * ".join([f"{value:.{DIGITS}g}", *factors])] if value else []
