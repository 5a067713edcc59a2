"""nanorom.continuation beside AUTO-07p: same equations, same range, one run, CPU seconds.

    OMP_NUM_THREADS=1 python tests/benchmarks/continuation_vs_auto.py [--modes 1 2 11] [--scaling]
    [--step 0.02] [--drum rom.h5]

AUTO runs the exported problem (nanorom.export) on one thread, with Floquet multipliers and
detection of LP, PD, NS and BP; compiling and Python's start are not counted. A point counts as
found by both when type and frequency agree to 1e-4. This is a benchmark, not a test: it asserts
nothing.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np

from nanorom.continuation import Diagram, ModalSystem, explore
from nanorom.excitation import Drive, Sweep
from nanorom.export import export
from nanorom.response import respond
from nanorom.rom import ReducedModel

SAME = 1e-4
AUTO_TYPES = {1: "BP", 2: "LP", 5: "LP", 6: "BP", 7: "PD", 8: "NS"}
QUALITY = 180.0


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


def cpu_of(function, repeat: int = 3) -> tuple[float, Diagram]:
    """Least CPU time of some runs, and the result."""
    best = np.inf
    for _ in range(repeat):
        start = time.process_time()
        result = function()
        best = min(best, time.process_time() - start)
    return best, result


def run_auto(
    system, omega, direct, parametric, step: float, limit: float
) -> tuple[list[float], list]:
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
        environment = {**os.environ, "OMP_NUM_THREADS": "1"}
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


def _special_points(file: Path) -> list[tuple[str, float]]:
    rows = [line.split() for line in file.read_text().splitlines()]
    rows = [row for row in rows if len(row) > 5 and row[0] != "0"]
    return [
        (AUTO_TYPES[abs(int(row[2])) % 10], float(row[4]))
        for row in rows
        if abs(int(row[2])) % 10 in AUTO_TYPES and int(row[2]) > 0
    ]


def compare(name, system, omega, direct, parametric, step, limit) -> None:
    depth = 1 if parametric else 0
    base, _ = cpu_of(lambda: explore(system, omega, direct, parametric, depth=0))
    whole, diagram = cpu_of(lambda: explore(system, omega, direct, parametric, depth=depth), 2)
    ours = [(p.type, p.omega, p.branch) for p in diagram.special_points]
    print(f"\n{name}, omega {omega}, direct {direct}, parametric {parametric}")
    print(
        f"  nanorom  base {base:.3f} s, all {len(diagram.branches)} branches {whole:.3f} s,",
        end=" ",
    )
    print(", ".join(f"{kind} {w:.6f}" for kind, w, _ in ours))
    times, points = run_auto(system, omega, direct, parametric, step, limit)
    print("  AUTO     " + ", ".join(f"branch {i} {t:.3f} s" for i, t in enumerate(times)))
    for index, found in enumerate(points):
        print(
            f"           branch {index}: " + ", ".join(f"{kind} {w:.6f}" for kind, w in found[:12])
        )
    if times:
        print(f"  ratio    base {times[0] / base:.1f}", end="")
        if len(times) > 1 and len(diagram.branches) > 1:
            print(f", all branches {sum(times) / whole:.1f}", end="")
        print()


def scaling(sizes=(1, 2, 4, 8, 16, 30)) -> None:
    """CPU time of one base branch for growing numbers of modes, and the exponent between sizes."""
    before = None
    for size in sizes:
        system = string_like(size)
        seconds, diagram = cpu_of(lambda s=system: explore(s, (0.8, 1.4), direct=0.005, depth=0), 1)
        points = len(diagram.branches[0])
        exponent = ""
        if before:
            exponent = f", exponent {np.log(seconds / before[1]) / np.log(size / before[0]):.2f}"
        per = 1e3 * seconds / points
        print(
            f"  L = {size:2d}: {seconds:.3f} s, {points} points, {per:.2f} ms per point{exponent}"
        )
        before = size, seconds


def drum(path: Path) -> None:
    """Wall time of the whole diagram of a drum at eight levels, 20-90 MHz, on the cores at hand."""
    direct = [f"{pressure} Pa" for pressure in range(5, 45, 5)]
    parametric = [f"{tension} mN/m" for tension in np.linspace(4.5, 6.0, 8)]
    model = ReducedModel.load(path)
    start = time.perf_counter()
    response = respond(model, Drive(direct, parametric), Sweep("20 MHz", "90 MHz"))
    seconds = time.perf_counter() - start
    branches = sum(len(diagram.branches) for diagram in response.diagrams)
    points = [point.type for diagram in response.diagrams for point in diagram.special_points]
    counts = ", ".join(f"{points.count(kind)} {kind}" for kind in ("LP", "PD", "NS", "BP"))
    print(
        f"\n{model.size}-mode drum, 8 levels: {seconds:.1f} s on {len(os.sched_getaffinity(0))}"
        f" cores, {branches} branches, {counts}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--modes", type=int, nargs="*", default=[1, 2, 11])
    parser.add_argument("--scaling", action="store_true", help="cost for 1 ... 30 modes")
    parser.add_argument("--step", type=float, default=0.02, help="largest step of AUTO")
    parser.add_argument("--limit", type=float, default=300.0, help="seconds allowed to AUTO")
    parser.add_argument("--drum", type=Path, metavar="ROM", help="rom.h5 of the drum demo")
    options = parser.parse_args()
    print(f"load average {os.getloadavg()[0]:.1f}, {os.cpu_count()} cores")
    if not shutil.which("auto-07p"):
        print("AUTO-07p is not installed: only nanorom is timed")
    for size in options.modes:
        system = string_like(size)
        for omega, direct, parametric in (((0.8, 1.5), 0.005, 0.0), ((1.5, 2.6), 0.002, 0.013)):
            arguments = omega, direct, parametric, options.step, options.limit
            compare(f"{size} modes", system, *arguments)
    if options.scaling:
        print("\ncost of a base branch")
        scaling()
    if options.drum is not None:
        drum(options.drum)
    print(f"load average {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
