"""Time and memory of the paper's drum against the number of unknowns, on any number of ranks."""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import attrs
import numpy as np
from mpi4py import MPI

from nanorom.bench.memory import forget_peak, peak
from nanorom.bench.targets import Figure
from nanorom.exact import cases
from nanorom.workflow import reduce

COMM = MPI.COMM_WORLD
DEGREE = 4  # least time and memory for an error of 1e-8 and below: 6 takes more per unknown
QUARTER = 0.63  # unknowns per squared radius over mesh size, per square of the degree
SIZES = (1e4, 3e4, 1e5, 3e5, 1e6)
LIBRARIES = 0.17  # GB of a rank that has loaded Python, PETSc and the rest and solved nothing


@attrs.frozen
class Size:
    """A solution: unknowns of w on the meshed quarter, and what they took.

    Times in s: wall, and the processor time of the busiest rank; memory in GB: peaks of all ranks
    added, Python and libraries (0.14 GB a rank) included; errors are true ones; iterations,
    residual: of multigrid.
    """

    dofs: int
    solver: str
    ranks: int
    groups: int
    wall: float
    cpu: float
    wall_modes: float
    cpu_modes: float
    wall_tensors: float
    cpu_tensors: float
    memory: float
    error_frequency: float
    error_tensor: float
    iterations: int
    residual: float


def rows(quick: bool = False) -> Iterator[Size]:
    """Factors and multigrid, ranks on one mesh and in groups. Collective."""
    if quick:
        for solver in ("factors", "multigrid"):
            for size in (500.0, 2000.0):
                yield measured(size, solver, 1, count=3)
        return
    for groups in sorted({1, COMM.size}):
        for size in SIZES if groups == 1 else SIZES[:-1]:  # each group needs the memory of a rank
            yield measured(size, "factors", groups)
    for size in SIZES:
        yield measured(size, "multigrid", 1)


def measured(dofs: float, solver: str, groups: int, count: int = 11) -> Size:
    """Reduce the drum with about so many unknowns. Collective."""
    radius = cases.RADIUS
    case = cases.by_hand(
        cases.paper_drum(count), DEGREE, float(np.sqrt(dofs / QUARTER) / DEGREE), radius
    )
    scene = case.scene.with_(solver=solver)
    times: dict[str, list[tuple[float, float]]] = {}

    def note(stage: str, *_: int) -> None:
        times.setdefault(stage, []).append((time.perf_counter(), time.process_time()))

    forget_peak()
    COMM.Barrier()
    note("all")
    model = reduce(scene, note, groups=groups)
    COMM.Barrier()
    note("all")
    memory = COMM.allreduce(peak())
    spent = {name: np.subtract(marks[-1], marks[0]) for name, marks in times.items()}
    longest: dict[str, tuple[float, float]] = {
        name: COMM.allreduce(value, op=_MAX) for name, value in spent.items()
    }
    found = model.diagnostics
    exact_frequency, exact_cubic = reference(count)
    frequency = float(np.abs(model.frequency / exact_frequency - 1).max())
    tensor = float(np.abs(model.cubic - exact_cubic).max() / np.abs(exact_cubic).max())
    return Size(
        int(found["dofs"]),
        solver,
        COMM.size,
        groups,
        *longest["all"],
        *longest["modes"],
        *longest["tensors"],
        memory,
        frequency,
        tensor,
        int(found.get("solver_iterations", 0)),
        float(found.get("solver_residual", np.nan)),
    )


@cache
def reference(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Exact frequencies and tensor, by a process of its own: its memory is not the drum's."""
    if COMM.rank:
        return COMM.bcast(None)
    program = (
        "import sys; from nanorom.exact import cases\n"
        f"case = cases.paper_drum({count})\n"
        "found = case.frequency(), case.cubic()\n"
        "sys.stdout.buffer.write(b''.join(a.tobytes() for a in found))"
    )
    alone = {k: v for k, v in os.environ.items() if not k.startswith(("OMPI_", "PMIX_"))}
    output = subprocess.run(
        [sys.executable, "-c", program], env=alone, check=True, stdout=subprocess.PIPE
    ).stdout
    values = np.frombuffer(output)
    return COMM.bcast((values[:count], values[count:].reshape((count,) * 4)))


def _larger(first: np.ndarray, second: np.ndarray, _: object = None) -> np.ndarray:
    return np.maximum(first, second)


_MAX = MPI.Op.Create(_larger, commute=True)


def exponents(rows: list[Size]) -> list[Figure]:
    """Least-squares slopes of log cost over log unknowns, by solver and groups.

    Memory is that beyond the libraries'.
    """
    found = []
    for (solver, groups), members in itertools.groupby(rows, lambda row: (row.solver, row.groups)):
        own = list(members)
        if len(own) < 2:
            continue
        x = np.log([row.dofs for row in own])
        costs = {
            "cpu": [row.cpu for row in own],
            "memory": [row.memory - LIBRARIES * row.ranks for row in own],
        }
        for name, cost in costs.items():
            span = f"{own[0].dofs:.0e} to {own[-1].dofs:.0e}"
            text = f"exponent of {name}, {solver}, {groups} group{'s' * (groups > 1)}, {span}"
            found.append(Figure(text, float(np.polyfit(x, np.log(cost), 1)[0]), ""))
    return found


def picture(rows: list[Size], path: Path) -> None:
    """Processor time and memory against unknowns."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib.figure import Figure as Picture

    from nanorom.files.whole import atomic_path
    from nanorom.plots.style import COLUMN, RESOLUTION, SETTINGS

    labels = {"cpu": "processor time of a rank (s)", "memory": "memory of all ranks (GB)"}
    with matplotlib.rc_context(SETTINGS):
        drawn = Picture(figsize=(COLUMN, 1.5 * COLUMN), layout="constrained")
        axes = drawn.subplots(2, 1, sharex=True)
        for ax, (name, label) in zip(axes, labels.items()):
            groups = itertools.groupby(rows, lambda row: (row.solver, row.groups, row.ranks))
            for (solver, groups_, ranks), members in groups:
                own = list(members)
                text = f"{solver}, {ranks} rank{'s' * (ranks > 1)}"
                text += f" in {groups_} groups" if groups_ > 1 else ""
                ax.loglog(
                    [row.dofs for row in own],
                    [getattr(row, name) for row in own],
                    marker="o" if solver == "factors" else "s",
                    markersize=3.5,
                    label=text,
                )
            ax.set_ylabel(label)
        axes[0].legend()
        axes[1].set_xlabel("unknowns of w on the meshed quarter")
        with atomic_path(path) as temporary:
            drawn.savefig(temporary, dpi=RESOLUTION)
