"""Write many_modes.md beside this: what one level costs, by number of modes and by damping.

    ./run python -m tests.benchmarks.many_modes [--most 40]

The membrane of demos/fig3.py at its level 1.6 (all modes move); the drum of demos/drum.toml as a
membrane of 60 modes under uniform pressure, direct and parametric; Duffing oscillators from Q = 100
to 1e8. Every row has a process of its own, so that its memory is its own: that of the program and
of a model without the larger one for estimates, too. It asserts nothing.
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import attrs
import numpy as np

import nanorom
from nanorom.bench import report
from nanorom.bench.memory import peak
from nanorom.continuation import Diagram, ModalSystem, explore
from nanorom.results.respond import respond
from nanorom.rom.model import ReducedModel

TABLE = Path(__file__).with_suffix(".md")
DEMOS = Path(__file__).parents[2] / "demos"
SIZES, ALL = (8, 11, 18, 28, 40), 60
LEVEL, RANGE = 1.6, ("0.95 f1", "3.2 f1")  # of the ladder of fig3.py
PRESSURE, TENSION, PRESSED = "20 Pa", "5 mN/m", ("0.8 f1", "2.9 f1")
QUALITIES = (1e2, 1e4, 1e6, 1e8)


@attrs.frozen
class Row:
    """CPU seconds and the largest memory of one level, and what was found at it."""

    modes: int
    level: str
    cpu: float
    megabytes: float
    branches: int
    orbits: int
    special_points: int


@attrs.frozen
class Resonance:
    """CPU seconds of a resonance and its tongue by Q, and by those at the first one."""

    quality: float
    cpu: float
    ratio: float
    special_points: str


def spot(path: Path, size: int) -> Row:
    """The membrane of fig3.py."""
    import fig3

    model = fig3_model(path, size)
    drive = fig3.levels(model, [LEVEL])
    sweep = nanorom.Sweep(*RANGE, tolerance=fig3.TOLERANCE)
    return timed(size, "spot", lambda: respond(model, drive, sweep).diagrams[0])


def pressed(path: Path, size: int, parametric: bool) -> Row:
    """The drum under uniform pressure."""
    model = fig3_model(path, size)
    drive = nanorom.Drive(PRESSURE, TENSION) if parametric else nanorom.Drive(PRESSURE)
    sweep = nanorom.Sweep(*PRESSED)
    name = "pressure and tension" if parametric else "pressure"
    return timed(size, name, lambda: respond(model, drive, sweep).diagrams[0])


def fig3_model(path: Path, size: int) -> ReducedModel:
    """The first modes of a stored model."""
    return ReducedModel.load(path).select(list(range(1, size + 1)))


def timed(size: int, name: str, run: Callable[[], Diagram]) -> Row:
    start = time.process_time()
    diagram = run()
    cpu = time.process_time() - start
    most = 1e3 * peak()  # ru_maxrss would be that of the process that began this one, if larger
    branches = diagram.branches
    return Row(
        size, name, cpu, most, len(branches), sum(map(len, branches)), len(diagram.special_points)
    )


def by_damping() -> Iterator[Resonance]:
    """A resonance and a tongue of one oscillator, at the same amplitude whatever its Q."""
    resonance(QUALITIES[0])  # what is loaded the first time does not count
    first = None
    for quality in QUALITIES:
        cpu, points = resonance(quality)
        first = first or cpu
        yield Resonance(quality, cpu, cpu / first, points)


def resonance(quality: float) -> tuple[float, str]:
    """CPU seconds and special points of a quality factor."""
    loss = 1 / quality
    system = ModalSystem(
        stiffness=[1.0], damping=[loss], cubic=[[[[1.0]]]], direct=[1.0], parametric=[1.0]
    )
    start = time.process_time()
    direct = explore(system, (0.9, 1.2), 0.3 * loss)
    pumped = explore(system, (1.9, 2.2), 0.0, 4 * loss)
    cpu = time.process_time() - start
    return cpu, ", ".join(p.type for d in (direct, pumped) for p in d.special_points)


def alone(function: Callable[..., Row], *given: object) -> Row:
    """A row of a process of its own."""
    with multiprocessing.get_context("spawn").Pool(1, prepare) as pool:
        return pool.apply(function, given)


def prepare() -> None:
    warnings.simplefilter("ignore")
    sys.path.insert(0, str(DEMOS))


def models(folder: Path, most: int) -> tuple[Path, Path]:
    """The two models in files."""
    import fig3

    paths = folder / "spot.h5", folder / "pressed.h5"
    alone = {"larger": None}
    attrs.evolve(fig3.reduced("membrane", most), **alone).save(paths[0])
    scene = nanorom.Scene.from_file(DEMOS / "drum.toml")
    plate = nanorom.Plate(thickness=scene.plate.thickness, model="membrane")
    attrs.evolve(nanorom.reduce(scene.with_(plate=plate, modes=ALL)), **alone).save(paths[1])
    return paths


def exponent(rows: list[Row]) -> str:
    """How the cost of the spot grows with the number of modes."""
    spots = [row for row in rows if row.level == "spot"]
    logs = np.log([row.modes for row in spots]), np.log([row.cpu for row in spots])
    return f"\nExponent of the number of modes: {np.polyfit(*logs, 1)[0]:.2f}\n"


def main() -> None:
    """Print rows as they come, then write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--most", type=int, default=max(SIZES), help="modes of the spot")
    most = parser.parse_args().most
    prepare()
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as name:
        by_spot, by_pressure = models(Path(name), most)
        for size in [size for size in SIZES if size <= most]:
            rows.append(alone(spot, by_spot, size))
            print(report.line(rows[-1]), flush=True)
        for parametric in (False, True):
            rows.append(alone(pressed, by_pressure, ALL, parametric))
            print(report.line(rows[-1]), flush=True)
    resonances = list(by_damping())
    command = "python -m tests.benchmarks.many_modes"
    report.write_markdown("One level by modes and by damping", (rows, resonances), TABLE, command)
    with TABLE.open("a") as file:
        file.write(exponent(rows))


if __name__ == "__main__":
    main()
