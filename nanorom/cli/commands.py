"""The command line. Bad input gets one line and status 1; a traceback needs --debug."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import Any

from nanorom.cli.given import (
    columns_of,
    groups_of,
    integer,
    load,
    names_of,
    number,
    pairs_of,
    progress_bar,
    scene_of,
)
from nanorom.errors import FileError, NanoromError

MOST_POINTS = 1000  # of a load curve


def run_command(options: argparse.Namespace) -> None:
    from nanorom.launch import mpi_rank
    from nanorom.workflow import run

    scene = scene_of(options)
    directory = options.output or Path("results") / options.scene.stem
    with progress_bar() as progress:
        summary = run(scene, directory, progress, groups=groups_of(options))
    if summary is not None and mpi_rank() == 0:
        total = sum(summary["seconds"].values())
        print(f"results in {directory} after {total:.1f} s")


def plan_command(options: argparse.Namespace) -> None:
    from nanorom.workflow import plan

    print(plan(scene_of(options)))


def reduce_command(options: argparse.Namespace) -> None:
    from nanorom.files.whole import check_writable
    from nanorom.workflow import reduce

    scene = scene_of(options)
    check_writable(options.output)
    with progress_bar() as progress:
        reduce(scene, progress, options.output, groups_of(options))


def tune_command(options: argparse.Namespace) -> None:
    from nanorom.files.whole import check_writable
    from nanorom.launch import mpi_rank
    from nanorom.workflow import tune

    points = integer("--points", options.points)
    if not 2 <= points <= MOST_POINTS:
        raise NanoromError(f"--points: found {points}; allowed: 2 to {MOST_POINTS}")
    at = None if options.at is None else [each.strip() for each in options.at.split(",")]
    scene = scene_of(options)
    files = [options.output.with_suffix(suffix) for suffix in (".h5", ".csv", ".png")]
    for file in files:
        check_writable(file)
    with progress_bar() as progress:
        curve = tune(scene, points, progress, at)
    if mpi_rank() == 0:
        from nanorom.plots import load_curve

        curve.save(files[0])
        curve.save_csv(files[1])
        load_curve(curve, files[2])
        print(curve.text())


def verify_command(options: argparse.Namespace) -> None:
    from nanorom.launch import mpi_rank
    from nanorom.workflow import verify

    points = integer("--points", options.points)
    if not 1 <= points <= MOST_POINTS:
        raise NanoromError(f"--points: found {points}; allowed: 1 to {MOST_POINTS}")
    level = None if options.level is None else integer("--level", options.level)
    more = None if options.more is None else integer("--more", options.more)
    scene = scene_of(options)
    with progress_bar() as progress:
        found = verify(
            scene,
            options.response,
            options.output,
            level=level,
            points=points,
            solve=not options.estimate,
            progress=progress,
            more=more,
        )
    if mpi_rank() == 0:
        from nanorom.plots import verified_figure

        verified_figure(found, options.output.with_suffix(".png"))
        print(found.text())


def info_command(options: argparse.Namespace) -> None:
    from nanorom.files import stored

    kind, content = load(options.file)
    print(stored.call(kind.text, content))


def respond_command(options: argparse.Namespace) -> None:
    from nanorom.files.whole import check_writable
    from nanorom.results.respond import respond
    from nanorom.rom.model import ReducedModel
    from nanorom.scene.excitation import Excitation

    check_writable(options.output)
    model = ReducedModel.load(options.model)
    sweep = options.sweep
    excitation = Excitation.asked(model.scene) if sweep is None else Excitation.from_file(sweep)
    with progress_bar() as progress:
        respond(
            model,
            excitation.drive,
            excitation.sweep,
            excitation.damping,
            progress,
            path=options.output,
            readout=excitation.readout,
        )


def export_command(options: argparse.Namespace) -> None:
    from nanorom.export import export
    from nanorom.export.formats import FORMATS
    from nanorom.results.response import Response
    from nanorom.rom.model import ReducedModel
    from nanorom.scene.excitation import Excitation

    if options.to not in FORMATS:
        raise FileError(f"--to: found {options.to!r}; allowed: {', '.join(FORMATS)}")
    target = options.output or options.model.with_suffix(FORMATS[options.to].suffix)
    _, content = load(options.model)
    if isinstance(content, Response) and FORMATS[options.to].motion:
        from nanorom.results.beside import model_beside

        model = model_beside(content, options.model)
        orbit = export.orbit_of(content, options.level, number(options.at))
        print(export.export_motion(model, orbit, options.to, target))
        return
    if isinstance(content, Response):
        print(export.export_response(content, options.to, target))
        return
    if not isinstance(content, ReducedModel):
        raise FileError(f"{options.model}: export is for a rom.h5 or a response.h5")
    omega: Any = options.omega and [number(end) for end in options.omega]
    written = export.export_model(
        content,
        options.to,
        target,
        None if options.sweep is None else Excitation.from_file(options.sweep),
        level=options.level,
        omega=omega,
        direct=number(options.direct),
        parametric=number(options.parametric),
    )
    print(written)


def effective_command(options: argparse.Namespace) -> None:
    from nanorom.files.whole import check_writable
    from nanorom.results.effective import effective
    from nanorom.rom.manifold.reduced import ORDER
    from nanorom.rom.model import ReducedModel
    from nanorom.scene.units import to_si

    order = integer("--order", options.order)
    mode = int(options.mode) if options.mode.isdecimal() else options.mode
    reach = None if options.reach is None else to_si(number(options.reach), "m", "--reach")
    if options.output is not None:
        check_writable(options.output)
    if options.model.suffix == ".toml":
        model = _of_scene(options.model, mode, order, reach, options.film)
        order = model.diagnostics.get(ORDER, order)  # which the reach may have raised
    elif options.film:
        raise FileError(f"--film: found {options.model}; allowed with a scene (.toml)")
    else:
        model = ReducedModel.load(options.model)
    found = effective(model, mode, order, reach)
    print(found.text())
    if options.output is not None:
        from nanorom.plots import effective_figure

        found.save(options.output)
        effective_figure(found, options.output.with_suffix(".png"))


def _of_scene(path: Path, mode: int | str, order: int, reach: float | None, film: bool) -> Any:
    """The model of a scene's modes, or of the fields of its film's manifold of one mode."""
    from nanorom.rom.manifold.reduced import check
    from nanorom.scene.scene import Scene
    from nanorom.workflow import manifold, reduce

    check(order, "normal")
    scene = Scene.from_file(path)
    if film:
        return manifold(scene, [mode], order, reach=reach).model
    with progress_bar() as progress:
        return reduce(scene, progress=progress)


def sensitivity_command(options: argparse.Namespace) -> None:
    from nanorom.files.whole import check_writable
    from nanorom.launch import mpi_rank
    from nanorom.report.sensitivity import sensitivity_text
    from nanorom.scene.fields import parse_toml, read_text
    from nanorom.workflow import sensitivity

    if options.output is not None:
        check_writable(options.output)
    of, by = (None if names is None else names_of(names) for names in (options.of, options.by))
    scene, spread = scene_of(options), pairs_of("--spread", options.spread)
    written = parse_toml(read_text(options.scene))
    with progress_bar() as progress:
        found = sensitivity(scene, of, by, progress, spread, written=written)
    if mpi_rank() == 0:
        print(sensitivity_text(found))
        if options.output is not None:
            from nanorom.plots import sensitivity_figure

            found.save_csv(options.output)
            sensitivity_figure(found, options.output.with_suffix(".png"))


def plot_command(options: argparse.Namespace) -> None:
    from nanorom.files import stored
    from nanorom.files.whole import check_directory, make_directory

    directory = options.file.parent if options.output is None else options.output
    check_directory(directory)
    kind, content = load(options.file)
    measured = None
    if options.data is not None:
        from nanorom.measurement.data import MeasuredResponse

        measured = MeasuredResponse.from_files(options.data, columns_of(options))
    level = None if options.level is None else integer("--level", options.level)
    make_directory(directory)
    if options.comb:
        from nanorom.plots.files import draw_comb

        with progress_bar() as progress:
            draw_comb(content, options.file, directory, level, progress)
        return
    if options.read is not None:
        from nanorom.plots.files import draw_reading

        draw_reading(content, options.file, directory, options.read, options.harmonic)
        return
    stored.call(kind.draw, content, options.file, directory, measured)


def view_command(options: argparse.Namespace) -> None:
    from nanorom.report.viewer.listing import view

    page = view(options.path, options.output)
    print(page)
    if not options.no_browser and _has_screen():
        import webbrowser

        webbrowser.open(page.resolve().as_uri())


def _has_screen() -> bool:
    """Whether a browser would have a window: one that runs in the terminal is not wanted."""
    named = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
    return sys.platform in ("darwin", "win32") or any(map(os.environ.get, named))


def bench_command(options: argparse.Namespace) -> None:
    from nanorom.bench import command

    command.run(options.output, options.what or "speed", options.quick)
