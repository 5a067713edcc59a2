"""Long runs killed at random moments: what they leave opens, and the same command ends right.

    ./run python -m tests.stress.interrupt      # writes tests/stress/interrupt.md

Ways to end a run: SIGKILL; a disk that is full from a random moment on (file size limit, set from
outside); one of two ranks killed.  Afterwards the same command runs to its end, and its result is
compared with that of an undisturbed run.
"""

from __future__ import annotations

import os
import platform
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import attrs
import h5py
import numpy as np

from nanorom.files.partial import FORMAT, partial

# a journal is kept every 0.2 s here, so that runs of some seconds have one
PROGRAM = (
    "import sys, nanorom.files.partial; nanorom.files.partial.SECONDS = 0.2\n"
    "from nanorom.cli.main import main; sys.exit(main(sys.argv[1:]))"
)
SEED = 20230403
SOON = 0.02  # seconds between looks at whether ranks have started
LONGEST = 300  # seconds of any one run
ROUND_OFF = 1e-10  # between runs of two ranks: their sums depend on who comes first

FILM = """
[geometry]
shape = "disc"
radius = "2.5 um"
[plate]
thickness = "10 nm"
[material]
youngs_modulus = "410 GPa"
poisson_ratio = 0.16
density = "2267 kg/m^3"
[tension]
x = "0.321 N/m"
y = "0.257 N/m"
[modes]
count = {modes}
[accuracy]
degree = {degree}
mesh_size = "{size}"
[reduction]
method = "step"
"""
PRESSURE = '[load]\npressure = "2 kPa"\n'
LEVELS = ", ".join(f'"{level} Pa"' for level in range(5, 41, 5))
SWEEP = f"""
[damping]
quality_factor = 180
[drive]
direct = [{LEVELS}]
[sweep]
from = "0.8 f1"
to = "1.6 f1"
"""


@attrs.frozen
class Task:
    """A long run: its name, files it needs, its command line and output, and how many ranks."""

    name: str
    files: dict[str, str]
    arguments: tuple[str, ...]
    output: str
    ranks: int = 1

    def start(self, directory: Path) -> subprocess.Popen[str]:
        """Start it in a directory, silent but for errors."""
        for name, text in self.files.items():
            (directory / name).write_text(text)
        launch = [] if self.ranks == 1 else ["mpirun", "--oversubscribe", "-n", str(self.ranks)]
        return subprocess.Popen(
            [*launch, sys.executable, "-c", PROGRAM, *self.arguments],
            cwd=directory,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "OMPI_MCA_mpi_yield_when_idle": "1"},
        )

    def finish(self, directory: Path) -> float:
        """Run it to its end; returns the seconds that took."""
        start = time.monotonic()
        process = self.start(directory)
        _, errors = process.communicate(timeout=LONGEST)
        assert process.returncode == 0, errors
        return time.monotonic() - start


def step(name: str, modes: int, degree: int, size: str, load: str = "", ranks: int = 1) -> Task:
    """A STEP campaign."""
    scene = FILM.format(modes=modes, degree=degree, size=size) + load
    arguments = ("reduce", "film.toml", "-o", "rom.h5")
    return Task(name, {"film.toml": scene}, arguments, "rom.h5", ranks)


FLAT = step("STEP, flat film", 11, 8, "0.4 um")
LOADED = step("STEP, loaded film", 5, 4, "0.5 um", PRESSURE)
TWO_RANKS = step("STEP, two ranks", 6, 6, "0.6 um", ranks=2)


def continuation(directory: Path) -> Task:
    """Eight levels of the drum's response; the model is made in the directory first."""
    scene = FILM.format(modes=6, degree=6, size="1 um").replace("step", "direct")
    model = Task("", {"film.toml": scene}, ("reduce", "film.toml", "-o", "rom.h5"), "rom.h5")
    model.finish(directory)
    arguments = ("respond", str(directory / "rom.h5"), "sweep.toml", "-o", "response.h5")
    return Task("continuation", {"sweep.toml": SWEEP}, arguments, "response.h5")


@attrs.frozen
class Trial:
    """One interrupted run and what became of it."""

    task: str
    way: str
    at: float
    whole: float
    kept: str
    again: float
    difference: float


def interrupted(
    task: Task, way: str, at: float, directory: Path, reference: Path, whole: float
) -> Trial:
    """End a run after some seconds, look at what it left, run it again, compare."""
    disturb(task, way, at, directory)
    kept = left_by(task, directory)
    again = task.finish(directory)
    assert not partial(directory / task.output).exists()
    parts = [path.name for path in directory.iterdir() if path.name.startswith(".")]
    assert not parts, f"temporary files left: {parts}"
    found = difference(directory / task.output, reference)
    return Trial(task.name, way, at, whole, kept, again, found)


def disturb(task: Task, way: str, at: float, directory: Path) -> int:
    """Start a run and end it after some seconds; returns its status."""
    process = task.start(directory)
    try:
        process.wait(at)
    except subprocess.TimeoutExpired:
        end(process, way)
    _, errors = process.communicate(timeout=LONGEST)
    assert "Traceback" not in errors, errors
    return process.returncode


def end(process: subprocess.Popen[str], way: str) -> None:
    """End a process in one of the ways."""
    if way == "disk full":
        resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (0, resource.RLIM_INFINITY))
    elif way == "rank killed":
        kill_rank(process)
    else:
        process.send_signal(signal.SIGKILL)


def kill_rank(process: subprocess.Popen[str]) -> None:
    """Kill one of mpirun's ranks, as soon as there are any."""
    children: list[str] = []
    while not children and process.poll() is None:
        time.sleep(SOON)
        for thread in Path(f"/proc/{process.pid}/task").glob("*/children"):
            children += thread.read_text().split()
    if children:
        os.kill(int(children[-1]), signal.SIGKILL)


def left_by(task: Task, directory: Path) -> str:
    """What a run left, in words; every file of it must open."""
    output = directory / task.output
    if output.exists():
        with h5py.File(output) as file:
            return f"{len(file['level'])} levels" if "level" in file else "result"
    if not partial(output).exists():
        return "nothing"
    with h5py.File(partial(output)) as file:
        assert file.attrs["format"] == FORMAT
        (table,) = (np.asarray(table) for table in file["tables"].values())
    return f"{np.isfinite(table).all(axis=0).mean():.0%} of the load cases"


def difference(path: Path, reference: Path) -> float:
    """Largest relative difference of any numeric dataset of two files; shapes must agree."""
    largest = 0.0
    with h5py.File(path) as one, h5py.File(reference) as two:

        def compare(name: str, item: object) -> None:
            nonlocal largest
            if isinstance(item, h5py.Dataset) and item.dtype.kind in "fciu":
                a, b = np.asarray(item), np.asarray(two[name])
                assert a.shape == b.shape, name
                scale = np.abs(b).max(initial=0.0) or 1.0
                largest = max(largest, float(np.abs(a - b).max(initial=0.0) / scale))

        one.visititems(compare)
        assert set(one) == set(two)
    return largest


def trials(plan: list[tuple[Task, str, int]], random: random.Random) -> list[Trial]:
    """Interrupt every task so many times, at moments spread over its whole run."""
    found = []
    for task, way, count in plan:
        with tempfile.TemporaryDirectory() as folder:
            given = Path(folder) / "whole"
            given.mkdir()
            whole = task.finish(given)
            for number in range(count):
                directory = Path(folder) / f"{way} {number}"
                directory.mkdir()
                at = random.uniform(0.0, whole)
                trial = interrupted(task, way, at, directory, given / task.output, whole)
                print(trial, flush=True)
                found.append(trial)
    return found


def main() -> None:
    """All trials; the table goes beside this file."""
    with tempfile.TemporaryDirectory() as folder:
        response = continuation(Path(folder))
        plan = [
            (FLAT, "killed", 8),
            (FLAT, "disk full", 3),
            (LOADED, "killed", 4),
            (response, "killed", 5),
            (response, "disk full", 2),
            (TWO_RANKS, "rank killed", 3),
        ]
        found = trials(plan, random.Random(SEED))
    head = ("run", "ended by", "after s", "of s", "left", "again s", "difference")
    rows = [head, ("---",) * len(head)]
    rows += [
        (t.task, t.way, f"{t.at:.1f}", f"{t.whole:.1f}", t.kept, f"{t.again:.1f}",
         f"{t.difference:.0e}" if t.difference else "none")
        for t in found
    ]  # fmt: skip
    text = "\n".join("| " + " | ".join(row) + " |" for row in rows)
    about = "`./run python -m tests.stress.interrupt`, "
    about += f"{platform.machine()}, {os.cpu_count()} cores, {time.strftime('%Y-%m-%d')}"
    Path(__file__).with_suffix(".md").write_text(f"{about}\n\n{text}\n")
    assert max(t.difference for t in found if t.way != "rank killed") == 0.0
    assert max(t.difference for t in found) < ROUND_OFF


if __name__ == "__main__":
    main()
