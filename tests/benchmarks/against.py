"""This commit's run times beside an earlier one's: the same programs, turn by turn, CPU seconds.

    ./run python -m tests.benchmarks.against COMMIT [--turns 5] [-o tests/benchmarks/against.md]

The earlier commit is checked out beside this one for as long as it takes. Of every program the
shortest turn counts, since other work on the machine only adds; the two trees take their turns one
after the other, so that a slower minute of the machine meets both. It asserts nothing.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

import attrs

from nanorom.bench import report

HERE = Path(__file__).parents[2]
FILM = """
[geometry]
{geometry}
[plate]
thickness = "10 nm"
[material]
youngs_modulus = "410 GPa"
poisson_ratio = 0.16
density = "2267 kg/m^3"
[tension]
{tension}
[support]
edge = "clamped"
[modes]
count = {count}
[accuracy]
tolerance = {tolerance}
[reduction]
method = "{method}"
"""
DRUM = {
    "geometry": 'shape = "disc"\nradius = "2.5 um"',
    "tension": 'x = "0.321 N/m"\ny = "0.257 N/m"',
}
COARSE = "paper's drum, 1e-5, 11 modes"
FILMS = {
    COARSE: {**DRUM, "count": 11, "tolerance": 1e-5, "method": "direct"},
    "paper's drum, 1e-8, 11 modes": {**DRUM, "count": 11, "tolerance": 1e-8, "method": "direct"},
    "paper's drum, STEP, 1e-8, 11 modes": {
        **DRUM,
        "count": 11,
        "tolerance": 1e-8,
        "method": "step",
    },
    "rectangle 5 x 3 um, 1e-6, 11 modes": {
        "geometry": 'shape = "rectangle"\nlength = "5 um"\nwidth = "3 um"',
        "tension": 'x = "0.3 N/m"\ny = "0.3 N/m"',
        "count": 11,
        "tolerance": 1e-6,
        "method": "direct",
    },
}
PROCESS = ", process"
PROCESSES = 7  # a turn's, one tree after the other: they are short, other work adds most to them
# prints the shortest of seven reductions, after one that fills the caches
REDUCE = """
import sys, time, nanorom
scene = nanorom.Scene.from_file(sys.argv[1])
nanorom.reduce(scene)
times = []
for _ in range(7):
    start = time.process_time()
    nanorom.reduce(scene)
    times.append(time.process_time() - start)
print(min(times))
"""


@attrs.frozen
class Row:
    """Shortest CPU seconds of a program in the earlier commit and in this one."""

    program: str
    before: float
    after: float
    ratio: float


def process_time(tree: Path, arguments: Sequence[str]) -> float:
    """CPU seconds of a whole process of a tree's Python."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    run(tree, arguments)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def run(tree: Path, arguments: Sequence[str]) -> str:
    """What a tree's Python prints."""
    command = [str(tree / ".venv" / "bin" / "python"), *arguments]
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    return subprocess.run(
        command, cwd=tree, env=environment, check=True, capture_output=True, text=True
    ).stdout


def rows(earlier: Path, turns: int, scenes: Path) -> list[Row]:
    """All programs, each by both trees in turn."""
    coarse = scenes / "coarse.toml"
    coarse.write_text(FILM.format(**FILMS[COARSE]))
    programs = {
        f"import nanorom{PROCESS}": lambda tree: process_time(tree, ["-c", "import nanorom"]),
        f"nanorom reduce, coarse drum{PROCESS}": lambda tree: process_time(
            tree, ["-m", "nanorom", "reduce", str(coarse), "-o", str(scenes / "rom.h5")]
        ),
        f"nanorom --help{PROCESS}": lambda tree: process_time(tree, ["-m", "nanorom", "--help"]),
    }
    for number, (name, film) in enumerate(FILMS.items()):
        scene = scenes / f"{number}.toml"
        scene.write_text(FILM.format(**film))
        programs[name] = lambda tree, scene=scene: float(run(tree, ["-c", REDUCE, str(scene)]))
    found = []
    for name, measured in programs.items():
        repeats = turns * (PROCESSES if name.endswith(PROCESS) else 1)
        pairs = [(measured(earlier), measured(HERE)) for _ in range(repeats)]
        before, after = (min(times) for times in zip(*pairs))
        found.append(Row(name, before, after, after / before))
        print(report.line(found[-1]), flush=True)
    return found


def main() -> None:
    """Check the earlier commit out, measure, write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("commit")
    parser.add_argument("--turns", type=int, default=5)
    parser.add_argument("-o", "--output", type=Path, default=HERE / "tests/benchmarks/against.md")
    asked = parser.parse_args()
    git = ["git", "-C", str(HERE), "worktree"]
    with tempfile.TemporaryDirectory() as folder:
        earlier = Path(folder) / "earlier"
        subprocess.run([*git, "add", "--quiet", "--detach", str(earlier), asked.commit], check=True)
        try:
            subprocess.run([str(earlier / "run"), "python", "-c", ""], check=True)
            found = rows(earlier, asked.turns, Path(folder))
        finally:
            subprocess.run([*git, "remove", "--force", str(earlier)], check=True)
    command = f"python -m tests.benchmarks.against {asked.commit} --turns {asked.turns}"
    title = f"Run times beside those of {asked.commit}"
    report.write_markdown(title, (found,), asked.output, command)


if __name__ == "__main__":
    main()
