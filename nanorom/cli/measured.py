"""Commands that read measurements: resonances, sweeps, ring-downs."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from nanorom.cli import shared
from nanorom.cli.given import columns_of, names_of, progress_bar
from nanorom.errors import FileError


def identify_command(options: argparse.Namespace) -> None:
    from nanorom.files.whole import check_directory, make_directory
    from nanorom.measurement.data import Resonances, is_sweep
    from nanorom.measurement.identify import identify
    from nanorom.measurement.unknowns import USUAL
    from nanorom.report import text as report
    from nanorom.scene.scene import Scene

    if options.output is not None:
        check_directory(options.output)
    scene = Scene.from_file(options.scene)
    if is_sweep(options.measured[0], columns_of(options)):
        identify_from_sweeps(scene, options)
        return
    if len(options.measured) > 1 or options.labels is not None:
        raise FileError(
            f"{options.measured[0]}: found resonances without amplitudes; allowed: one such table, "
            "without --labels"
        )
    measured = Resonances.from_file(options.measured[0], columns_of(options))
    unknowns = USUAL if options.unknowns is None else names_of(options.unknowns)
    found = identify(scene, measured, unknowns)
    print(report.identification_text(found))
    if options.output is not None:
        from nanorom.plots import resonance_figure

        make_directory(options.output)
        found.save_scene(options.output / "identified.toml")
        resonance_figure(found, options.output / "resonances.png")


def identify_from_sweeps(scene: Any, options: argparse.Namespace) -> None:
    from nanorom.files.whole import make_directory
    from nanorom.measurement.data import MeasuredResponse
    from nanorom.measurement.device.identify import identify_sweeps
    from nanorom.report.device import device_text

    measured = MeasuredResponse.from_files(options.measured, columns_of(options))
    unknowns, labels = (
        None if given is None else names_of(given) for given in (options.unknowns, options.labels)
    )
    with progress_bar() as progress:
        found = identify_sweeps(scene, measured, unknowns, labels=labels or (), progress=progress)
    print(device_text(found))
    if options.output is not None:
        from nanorom.plots import device_figure

        make_directory(options.output)
        found.save_scene(options.output / "identified.toml")
        device_figure(found, options.output / "sweeps.png")


def peaks_command(options: argparse.Namespace) -> None:
    from nanorom.files.whole import check_directory, make_directory
    from nanorom.measurement.data import MeasuredResponse, RingdownRecord, has_time
    from nanorom.measurement.sweeps.peaks import find_peaks
    from nanorom.measurement.sweeps.ringdown import fit_ringdown
    from nanorom.report import peaks as report

    if options.output is not None:
        check_directory(options.output)
    named = columns_of(options)
    if has_time(options.measured[0], named):
        for path in options.measured:
            print(report.ringdown_text(fit_ringdown(RingdownRecord.from_file(path, named))))
        return
    measured = MeasuredResponse.from_files(options.measured, named)
    with progress_bar() as progress:
        found = find_peaks(measured, progress)
    print(report.peaks_text(found, measured.left_out))
    if options.output is not None:
        from nanorom.plots import peaks_figure

        make_directory(options.output)
        report.save_table(found, options.output / "peaks.csv")
        for number, peak in enumerate(found, 1):
            peaks_figure(peak, options.output / f"peak-{number}.png")


def identify_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "scene", type=Path, metavar="SCENE", help="scene file (TOML), a first guess"
    )
    parser.add_argument(
        "measured",
        type=Path,
        nargs="+",
        metavar="MEASURED",
        help="tables of resonances (frequency, label) or of sweeps (frequency, amplitude, level)",
    )
    shared.columns(parser)
    parser.add_argument(
        "--labels", metavar="NAMES", help="of sweeps: modes of the peaks by frequency, f01,f11s"
    )
    parser.add_argument(
        "--unknowns",
        metavar="NAMES",
        help="what to find, such as tension,density; an unknown name is answered with all",
    )
    parser.add_argument(
        "-o", "--output", type=Path, metavar="DIR", help="gets identified.toml and pictures"
    )


def peaks_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "measured",
        type=Path,
        nargs="+",
        metavar="SWEEPS",
        help="tables: frequency, amplitude, sweep, level; or of ring-downs: time, amplitude",
    )
    shared.columns(parser)
    parser.add_argument(
        "-o", "--output", type=Path, metavar="DIR", help="gets peaks.csv and a picture of each peak"
    )
