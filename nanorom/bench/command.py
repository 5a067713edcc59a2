"""What `nanorom bench` does: measure, print as it goes, write table and picture."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from nanorom.files.whole import check_directory, make_directory


def run(directory: Path, what: str, quick: bool) -> None:
    """Measure ``what`` (speed, accuracy, scenes, ...); leave its table in a directory."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    check_directory(directory)
    make_directory(directory)
    kinds = {
        "speed": _speed,
        "accuracy": _accuracy,
        "scenes": _scenes,
        "stress": _stress,
        "skips": _skips,
        "size": _size,
    }
    kinds[what](directory, quick)


def _command(option: str, quick: bool) -> str:
    return f"nanorom bench{option}{' --quick' if quick else ''}"


def _shown(rows: Iterator[Any]) -> list[Any]:
    """All rows, each printed when it is there."""
    from nanorom.bench import report

    found: list[Any] = []
    for row in rows:
        if not found:
            import attrs

            print(report.heading([field.name for field in attrs.fields(type(row))]))
        print(report.line(row), flush=True)
        found.append(row)
    return found


def _speed(directory: Path, quick: bool) -> None:
    from nanorom.bench import curves, report, targets

    rows = _shown(curves.rows(quick))
    figures = _shown(targets.start_up())
    if not quick:
        figures += _shown(targets.many_modes())
        figures += _shown(targets.fine_mesh())
    report.write_csv(rows, directory / "speed.csv")
    title = "Run time against error"
    report.write_markdown(title, (figures, rows), directory / "speed.md", _command("", quick))
    report.picture(rows, directory / "speed.png")


def _accuracy(directory: Path, quick: bool) -> None:
    from nanorom.bench import accuracy, report

    rows = _shown(accuracy.rows(quick))
    report.write_csv(rows, directory / "accuracy.csv")
    title = "True error against the estimate"
    command = _command(" --accuracy", quick)
    report.write_markdown(title, (rows,), directory / "accuracy.md", command)
    _scenes(directory, quick)


def _scenes(directory: Path, quick: bool) -> None:
    from nanorom.bench import report, scenes

    drawn = _shown(scenes.rows(directory / "scenes.csv", quick))
    worst = _shown(iter([scenes.summary(drawn)]))
    title = "Random scenes, each against itself at a hundredth of its tolerance"
    command = _command(" --scenes", quick)
    report.write_markdown(title, (worst, drawn), directory / "scenes.md", command)


def _stress(directory: Path, quick: bool) -> None:
    from nanorom.bench import report, stress

    rows = _shown(stress.rows(quick))
    report.write_csv(rows, directory / "stress.csv")
    title = "Numerical stability under extreme parameters"
    command = _command(" --stress", quick)
    report.write_markdown(title, (rows,), directory / "stress.md", command)


def _skips(directory: Path, quick: bool) -> None:
    from nanorom.bench import report, skips

    rows = _shown(skips.rows())
    report.write_csv(rows, directory / "skips.csv")
    title = "What the plan's skips save and change"
    report.write_markdown(title, (rows,), directory / "skips.md", _command(" --skips", quick))


def _size(directory: Path, quick: bool) -> None:
    from nanorom.bench import report, size

    found = size.rows(quick)
    rows = _shown(found) if size.COMM.rank == 0 else list(found)
    if size.COMM.rank == 0:
        name = f"size-{size.COMM.size}"
        report.write_csv(rows, directory / f"{name}.csv")
        title = "Time and memory against the size of the mesh"
        command = f"mpirun -n {size.COMM.size} {_command(' --size', quick)}"
        tables = size.exponents(rows), rows
        report.write_markdown(title, tables, directory / f"{name}.md", command)
        size.picture(rows, directory / f"{name}.png")
