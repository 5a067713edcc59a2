"""Commands about many devices: what runs them, and their options."""

from __future__ import annotations

import argparse
from pathlib import Path

from nanorom.cli.given import integer, progress_bar


def sweep_command(options: argparse.Namespace) -> None:
    from nanorom.devices.request import Request
    from nanorom.devices.study import carry_out
    from nanorom.files.whole import check_writable
    from nanorom.report.study import study_text

    files = [options.output.with_suffix(suffix) for suffix in (".h5", ".csv", ".png")]
    for file in files:
        check_writable(file)
    processes = None
    if options.processes is not None:
        processes = integer("--processes", options.processes)
    request = Request.read(options.scene, options.study)
    with progress_bar() as progress:
        found = carry_out(request, processes, files[0], progress)
    from nanorom.plots import study_figure

    found.save_csv(files[1])
    study_figure(found, files[2])
    print(study_text(found))


def design_command(options: argparse.Namespace) -> None:
    from nanorom.devices.design import carry_out
    from nanorom.devices.wish import Wish
    from nanorom.files.whole import atomic_path, check_writable
    from nanorom.report.design import design_text

    files = [options.output.with_suffix(suffix) for suffix in (".h5", ".csv", ".png", ".toml")]
    for file in files:
        check_writable(file)
    processes = None
    if options.processes is not None:
        processes = integer("--processes", options.processes)
    wish = Wish.read(options.scene, options.design)
    with progress_bar() as progress:
        found = carry_out(wish, processes, files[0], progress)
    from nanorom.plots import design_figure

    found.save_csv(files[1])
    design_figure(found, files[2])
    with atomic_path(files[3]) as temporary:
        temporary.write_text(found.best, encoding="utf-8")
    print(design_text(found))


def design_options(parser: argparse.ArgumentParser) -> None:
    """Scene, wish, file and processes."""
    parser.add_argument("scene", type=Path, metavar="SCENE", help="scene file (TOML)")
    parser.add_argument(
        "design", type=Path, metavar="DESIGN", help="what may vary, and what is wished (TOML)"
    )
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        default=Path("design.h5"),
        metavar="FILE",
        help="HDF5; the history (CSV), a picture and the best scene (TOML) come beside it "
        "(default: design.h5)",
    )
    parser.add_argument(
        "--processes", metavar="N", help="that work at once (default: the cores at hand)"
    )


def sweep_options(parser: argparse.ArgumentParser) -> None:
    """Scene, study, table and processes."""
    parser.add_argument("scene", type=Path, metavar="SCENE", help="scene file (TOML)")
    parser.add_argument(
        "study", type=Path, metavar="STUDY", help="what varies, and what is wanted (TOML)"
    )
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        default=Path("study.h5"),
        metavar="TABLE",
        help="HDF5; CSV and a picture come beside it (default: study.h5)",
    )
    parser.add_argument(
        "--processes", metavar="N", help="that work at once (default: the cores at hand)"
    )
