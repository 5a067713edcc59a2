"""Commands about many devices: what runs them, and their options."""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path

from nanorom.cli import shared
from nanorom.cli.given import integer, progress_bar


def sweep_command(options: argparse.Namespace) -> None:
    from nanorom.devices.request import Request
    from nanorom.devices.study import carry_out
    from nanorom.report.study import study_text

    table, csv, picture = _files(options, ".h5", ".csv", ".png")
    processes = _processes(options)
    request = Request.read(options.scene, options.study)
    with progress_bar() as progress:
        found = carry_out(request, processes, table, progress)
    from nanorom.plots import study_figure

    found.save_csv(csv)
    study_figure(found, picture)
    print(study_text(found))


def design_command(options: argparse.Namespace) -> None:
    from nanorom.devices.design import carry_out
    from nanorom.devices.wish import Wish
    from nanorom.files.whole import atomic_path
    from nanorom.report.design import design_text

    table, csv, picture, best = _files(options, ".h5", ".csv", ".png", ".toml")
    processes = _processes(options)
    wish = Wish.read(options.scene, options.design)
    with progress_bar() as progress:
        found = carry_out(wish, processes, table, progress)
    from nanorom.plots import design_figure

    found.save_csv(csv)
    design_figure(found, picture)
    with atomic_path(best) as temporary:
        temporary.write_text(found.best, encoding="utf-8")
    print(design_text(found))


def _files(options: argparse.Namespace, *suffixes: str) -> list[Path]:
    """The files that a command writes, which it can; raises FileError."""
    from nanorom.files.whole import check_writable

    files = [options.output.with_suffix(suffix) for suffix in suffixes]
    for file in files:
        check_writable(file)
    return files


def _processes(options: argparse.Namespace) -> int | None:
    return None if options.processes is None else integer("--processes", options.processes)


def _options(name: str, asked: str, beside: str, parser: argparse.ArgumentParser) -> None:
    """Scene, what is asked of it, file and processes."""
    shared.scene(parser)
    parser.add_argument(name, type=Path, metavar=name.upper(), help=f"{asked} (TOML)")
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        default=Path(f"{name}.h5"),
        metavar="FILE",
        help=f"HDF5; {beside} come beside it (default: {name}.h5)",
    )
    parser.add_argument(
        "--processes", metavar="N", help="that work at once (default: the cores at hand)"
    )


sweep_options = partial(_options, "study", "what varies, and what is wanted", "CSV and a picture")
design_options = partial(
    _options,
    "design",
    "what may vary, and what is wished",
    "the history (CSV), a picture and the best scene (TOML)",
)
