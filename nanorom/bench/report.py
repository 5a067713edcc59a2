"""Tables on screen, CSV and Markdown files, and a log-log picture."""

from __future__ import annotations

import csv
import datetime
import os
import platform
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from nanorom.bench.measure import Row
from nanorom.files.whole import atomic_path

COLUMNS = tuple(field.name for field in attrs.fields(Row))
WIDTHS = {"case": 20, "note": 30, "code": 8, "route": 8, "name": 66, "parameter": 22, "verdict": 60}
NARROWEST = 10.0  # errors to either side of a panel's middle, so that ticks have room


def heading(names: Sequence[str] = COLUMNS) -> str:
    """First line of the table on the screen."""
    return "  ".join(_fit(name, name) for name in names)


def line(row: Any) -> str:
    """A row of the table on the screen."""
    return "  ".join(_fit(f.name, getattr(row, f.name)) for f in attrs.fields(type(row)))


def _fit(name: str, value: Any) -> str:
    if isinstance(value, str):
        width = WIDTHS.get(name, 11)
        return f"{value[:width]:{width}}"
    return f"{_text(value):>11}"


def _text(value: Any) -> str:
    if isinstance(value, float):
        return "-" if np.isnan(value) else f"{value:.3g}"
    return str(value)


def write_csv(rows: Iterable[Any], path: Path, kind: type[Any] | None = None) -> None:
    """All rows, whole or not at all; kind: of the rows, needed where there may be none."""
    rows = list(rows)
    with atomic_path(path) as temporary, open(temporary, "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([field.name for field in attrs.fields(kind or type(rows[0]))])
        writer.writerows(attrs.astuple(row) for row in rows)


def write_markdown(title: str, tables: Iterable[Sequence[Any]], path: Path, command: str) -> None:
    """Tables with the machine, the date, the load and the command."""
    lines = [f"# {title}", "", *conditions(command), ""]
    for rows in tables:
        if rows:
            names = [field.name for field in attrs.fields(type(rows[0]))]
            lines += ["| " + " | ".join(n.replace("_", " ") for n in names) + " |"]
            lines += ["|" + "---|" * len(names)]
            cells = ([_cell(value) for value in attrs.astuple(row)] for row in rows)
            lines += ["| " + " | ".join(row) + " |" for row in cells]
            lines += [""]
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join(lines))


def tabled(case: Callable[[int], Any], module: str, default: int) -> None:
    """Print the row of every seed, as many as the command line says, and write their table.

    It stands beside the module that computes the rows, and bears its name.
    """
    count = int(sys.argv[1]) if sys.argv[1:] else default
    rows = []
    for seed in range(count):
        rows.append(case(seed))
        print(line(rows[-1]), flush=True)
    path = Path(*module.split(".")).with_suffix(".md")
    write_markdown(path.stem.capitalize(), [rows], path, f"python -m {module} {count}")


def _cell(value: Any) -> str:
    return _text(value).replace("|", "/")


def conditions(command: str) -> list[str]:
    """Machine, date, load and command, as lines of Markdown."""
    load = ", ".join(f"{x:.2f}" for x in os.getloadavg())
    now = datetime.datetime.now(datetime.UTC)
    return [
        f"* command: `{command}`",
        f"* date: {now:%Y-%m-%d}",
        f"* machine: {_processor()}, {os.cpu_count()} processors, one thread; "
        f"Python {platform.python_version()}; {_versions()}",
        f"* load average at the end (1, 5, 15 min; 1.0 is this run alone): {load}",
    ]


def _processor() -> str:
    try:
        text = Path("/proc/cpuinfo").read_text()
        return next(x.split(":")[1].strip() for x in text.splitlines() if "model name" in x)
    except (OSError, StopIteration):  # not Linux: less telling
        return platform.processor() or platform.machine()


def _versions() -> str:
    from importlib.metadata import PackageNotFoundError, version

    found = []
    for name in ("fenics-dolfinx", "petsc4py", "ngsolve", "numpy", "scipy"):
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            found.append(f"{name} not installed")
    return ", ".join(found)


def picture(rows: Sequence[Row], path: Path) -> None:
    """Processor time against the larger of the true errors, one panel per case."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib.figure import Figure

    from nanorom.plots.style import COLUMN, RESOLUTION, SETTINGS

    cases = list(dict.fromkeys(row.case for row in rows))
    with matplotlib.rc_context(SETTINGS):
        columns = min(2, len(cases))
        n_rows = -(-len(cases) // columns)
        figure = Figure(figsize=(columns * COLUMN, n_rows * 0.95 * COLUMN), layout="constrained")
        axes = figure.subplots(n_rows, columns, squeeze=False, sharey=True)
        for ax in axes.flat[len(cases) :]:
            ax.set_visible(False)
        for ax, case in zip(axes.flat, cases):
            _panel(ax, case, [row for row in rows if row.case == case and row.error > 0])
        with atomic_path(path) as temporary:
            figure.savefig(temporary, dpi=RESOLUTION)


def _panel(ax: Any, case: str, rows: list[Row]) -> None:
    series: dict[str, list[Row]] = {}
    for row in rows:
        series.setdefault(_series(row), []).append(row)
    markers = {"nanorom": "o", "DOLFINx": "s", "NGSolve": "^"}
    for name, members in series.items():
        by_tolerance = members[0].note.startswith("tolerance")
        members = sorted(members, key=lambda row: row.error)
        ax.loglog(
            [row.error for row in members],
            [row.cpu for row in members],
            marker=markers[members[0].code],
            markersize=3.5,
            linestyle="-" if by_tolerance or members[0].code != "nanorom" else ":",
            label=name,
        )
    low, high = ax.get_xlim()
    middle = (low * high) ** 0.5
    ax.set_xlim(max(high, NARROWEST * middle), min(low, middle / NARROWEST))  # smaller to the right
    ax.set_title(case)
    ax.set_xlabel("true error (frequencies and tensor)")
    ax.set_ylabel("processor time (s)")
    # below: in the panel it would hide curves
    ax.legend(ncols=2, fontsize=5.5, loc="upper left", bbox_to_anchor=(0.0, -0.25))


def _series(row: Row) -> str:
    if row.note.startswith("tolerance"):
        return f"{row.code}, {row.route}"
    route = "" if row.code == "NGSolve" else f", {row.route}"
    return f"{row.code}{route}, degree {row.degree}"
