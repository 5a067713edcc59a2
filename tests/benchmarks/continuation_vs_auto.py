"""nanorom.continuation beside AUTO-07p: same equations, same range, one run, CPU seconds.

    ./run python -m tests.benchmarks.continuation_vs_auto [--modes 1 2 11] [--scaling]
    [--drum rom.h5] [-o tests/benchmarks/continuation.md]

AUTO runs the exported problem (nanorom.export) on one thread, with Floquet multipliers and
detection of LP, PD, NS and BP; compiling and Python's start are not counted. Its largest step is
halved until it finds what nanorom finds on the base branch, at most `--tries` times; a point counts
as found by both when type and frequency agree to 1e-4. This is a benchmark, not a test: it asserts
nothing.
"""

from __future__ import annotations

import argparse
import os
import platform
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from datetime import date
from functools import partial
from pathlib import Path

import numpy as np

from nanorom.continuation import Diagram, ModalSystem, explore
from nanorom.export.export import export
from nanorom.results.respond import respond
from nanorom.rom.model import ReducedModel
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Sweep

SAME = 1e-4
AUTO_TYPES = {1: "BP", 2: "LP", 5: "LP", 6: "BP", 7: "PD", 8: "NS"}
QUALITY = 180.0
CASES = (((0.8, 1.5), 0.005, 0.0), ((1.5, 2.6), 0.002, 0.013))  # range, direct, parametric
SIZES = (1, 2, 4, 8, 11, 16, 22, 30)
# AUTO reads the clock on the wall, of which other processes take their share
CPU_CLOCK = """#include <time.h>
double omp_get_wtime_(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return now.tv_sec + 1e-9 * now.tv_nsec;
}
"""
Points = list[tuple[str, float]]


def string_like(size: int, seed: int = 0) -> ModalSystem:
    """A dense system of the drum's kind: stretching forces from a sum of fourth powers."""
    random = np.random.default_rng(seed)
    frequencies = np.sort(np.concatenate([[1.0], 1.3 + 2.5 * random.random(size - 1)]))
    vectors = random.standard_normal((2 * size, size)) / np.sqrt(size)
    cubic = np.einsum("mi,mj,mk,ml->ijkl", vectors, vectors, vectors, vectors)
    cubic /= cubic[0, 0, 0, 0]
    drive = random.standard_normal(size)
    drive[0] = 1.0
    return ModalSystem(
        damping=frequencies / QUALITY,
        stiffness=frequencies**2,
        cubic=cubic,
        direct=drive,
        parametric=drive,
    )


def cpu_of(function: Callable[[], Diagram], repeat: int = 3) -> tuple[float, Diagram]:
    """Least CPU time of some runs, and the result."""
    best = np.inf
    for _ in range(repeat):
        start = time.process_time()
        result = function()
        best = min(best, time.process_time() - start)
    return best, result


def run_auto(
    system: ModalSystem,
    omega: tuple[float, float],
    direct: float,
    parametric: float,
    step: float,
    limit: float,
) -> tuple[list[float], list[Points]]:
    """CPU seconds per run ("Total Time" of AUTO) and special points (type, omega) per branch."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "problem"
        export(system, "auto", folder, omega=omega, direct=direct, parametric=parametric)
        script = folder / "modal.auto"
        text = re.sub(r"DSMAX=[0-9.]+\)", f"DSMAX={step})", script.read_text())
        # the doubled branches once: AUTO follows the same loop from either end
        text = text.replace(
            "for point in base(kind) or []:", "for point in (base(kind) or [])[:1]:"
        )
        script.write_text(text)
        clock = Path(name) / "clock.so"
        compiler = ["gcc", "-shared", "-fPIC", "-O1", "-xc", "-", "-o", str(clock)]
        subprocess.run(compiler, input=CPU_CLOCK, text=True, check=True)
        environment = {**os.environ, "OMP_NUM_THREADS": "1", "LD_PRELOAD": str(clock)}
        try:
            done = subprocess.run(
                ["sh", str(folder / "run.sh")],
                capture_output=True,
                text=True,
                env=environment,
                timeout=limit,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return [np.inf], []
        times = [float(t.replace("D", "E")) for t in re.findall(r"Total Time\s+(\S+)", done.stdout)]
        files = [folder / "b.base", *sorted(folder.glob("b.branch*"))]
        return times[1:], [_special_points(file) for file in files if file.exists()]


def _special_points(file: Path) -> Points:
    rows = [line.split() for line in file.read_text().splitlines()]
    rows = [row for row in rows if len(row) > 5 and row[0] != "0"]
    return [
        (AUTO_TYPES[abs(int(row[2])) % 10], float(row[4]))
        for row in rows
        if abs(int(row[2])) % 10 in AUTO_TYPES and int(row[2]) > 0
    ]


def beside_auto(size: int, tries: int, limit: float) -> list[str]:
    """Rows of the table for a number of modes."""
    rows = []
    system = string_like(size)
    for omega, direct, parametric in CASES:
        depth = 1 if parametric else 0
        levels = omega, direct, parametric
        base, _ = cpu_of(partial(explore, system, *levels, depth=0))
        whole, diagram = cpu_of(partial(explore, system, *levels, depth=depth), 2)
        ours = [(p.type, p.omega) for p in diagram.points(branch=0)]
        step, times, points, missed = 0.04, [np.inf], [], ours
        for _ in range(tries if shutil.which("auto-07p") else 0):
            step /= 2
            times, points = run_auto(system, *levels, step, limit)
            missed = [p for p in ours if not points or not any(_same(p, q) for q in points[0])]
            if not missed:
                break
        runs = [("base", base, times[0], f"{len(ours) - len(missed)} of {len(ours)}")]
        if depth and len(times) > 1:
            runs.append((f"all {len(diagram.branches)}", whole, sum(times), ""))
        for name, mine, theirs, found in runs:
            rows.append(
                f"| {size} | {omega[0]} to {omega[1]} | {direct}, {parametric} | {name} "
                f"| {mine:.3f} | {theirs:.3f} | {theirs / mine:.1f} | {found} | {step} |"
            )
            print(rows[-1], flush=True)
        if missed:
            print("  not found by AUTO: " + ", ".join(f"{k} {w:.6f}" for k, w in missed))
    return rows


def _same(one: tuple[str, float], two: tuple[str, float]) -> bool:
    return one[0] == two[0] and abs(one[1] - two[1]) < SAME


def scaling(sizes: tuple[int, ...] = SIZES) -> list[str]:
    """Rows of the table of CPU time of one base branch for growing numbers of modes."""
    rows, seconds = [], []
    for size in sizes:
        system = string_like(size)
        cpu, diagram = cpu_of(partial(explore, system, *CASES[0], depth=0), 2 if size < 9 else 1)
        seconds.append(cpu)
        points, special = len(diagram.branches[0]), len(diagram.special_points)
        rows.append(f"| {size} | {cpu:.3f} | {points} | {special} | {1e3 * cpu / points:.2f} |")
        print(rows[-1], flush=True)
    for low in (1, 8):
        used = [i for i, size in enumerate(sizes) if size >= low]
        logs = np.log(np.array(sizes)[used]), np.log(np.array(seconds)[used])
        rows.append(f"\nExponent of L from {sizes[used[0]]} on: {np.polyfit(*logs, 1)[0]:.2f}")
        print(rows[-1])
    return rows


def drum(path: Path) -> list[str]:
    """Row of the table: the whole diagram of a drum at eight levels, on the cores at hand."""
    direct = [f"{pressure} Pa" for pressure in range(5, 45, 5)]
    parametric = [f"{tension:.4g} mN/m" for tension in np.linspace(4.5, 6.0, 8)]
    model = ReducedModel.load(path)
    start = time.perf_counter(), os.times()
    response = respond(model, Drive(direct, parametric), Sweep("20 MHz", "90 MHz"))
    seconds, end = time.perf_counter() - start[0], os.times()
    cpu = sum(end[:4]) - sum(start[1][:4])
    branches = sum(len(diagram.branches) for diagram in response.diagrams)
    points = [point.type for diagram in response.diagrams for point in diagram.special_points]
    counts = ", ".join(f"{points.count(kind)} {kind}" for kind in ("LP", "PD", "NS", "BP"))
    cores = len(os.sched_getaffinity(0))
    row = f"| {model.size} | 8 | {branches} | {counts} | {cores} | {seconds:.1f} | {cpu:.1f} |"
    print(row)
    return [row]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--modes", type=int, nargs="*", default=[1, 2, 11])
    parser.add_argument("--scaling", action="store_true", help="cost for 1 ... 30 modes")
    parser.add_argument("--tries", type=int, default=3, help="largest steps tried with AUTO")
    parser.add_argument("--limit", type=float, default=600.0, help="seconds allowed to AUTO")
    parser.add_argument("--drum", type=Path, metavar="ROM", help="rom.h5 of the drum demo")
    parser.add_argument("-o", "--output", type=Path, help="where the tables go (markdown)")
    options = parser.parse_args()
    load = os.getloadavg()[0]
    parts = []
    if options.modes:
        parts += [
            "## Beside AUTO-07p\n",
            "| L | omega | direct, parametric | branches | nanorom (CPU s) | AUTO (CPU s) | ratio "
            "| special points of the base branch AUTO finds | DSMAX |",
            "|---" * 9 + "|",
            *(
                row
                for size in options.modes
                for row in beside_auto(size, options.tries, options.limit)
            ),
        ]
    if options.scaling:
        parts += [
            "\n## Base branch of a dense system, omega 0.8 to 1.5, direct 0.005\n",
            "| L | CPU s | points | special points | ms per point |",
            "|---" * 5 + "|",
            *scaling(),
        ]
    if options.drum is not None:
        parts += [
            "\n## Whole diagram of the paper's drum, 20 to 90 MHz, isolas included\n",
            "| L | levels | branches | special points | cores | wall s | CPU s |",
            "|---" * 7 + "|",
            *drum(options.drum),
        ]
    if options.output is not None:
        command = shlex.join(["./run", "python", "-m", MODULE, *sys.argv[1:]])
        title = (
            f"# Continuation: cost\n\n`{command}`, "
            f"{date.today()}, {_processor()}, {os.cpu_count()} cores, "
            f"load average {load:.1f} to {os.getloadavg()[0]:.1f}\n"
        )
        options.output.write_text("\n".join([title, *parts]) + "\n")


MODULE = "tests.benchmarks.continuation_vs_auto"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


if __name__ == "__main__":
    main()
