"""The command line. Bad input gets one line and status 1; a traceback needs --debug."""

from __future__ import annotations

import argparse
import logging
import os
import sys
import time
import traceback
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO

from nanorom.errors import FileError, NanoromError

MOST_POINTS = 1000  # of a load curve
PATIENCE = 10.0  # seconds that a failed rank waits for the others to fail, too


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit status."""
    # Threaded BLAS makes the many small dense operations here several times slower.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    options = _parser().parse_args(arguments)
    if not options.debug:
        logging.disable(logging.INFO)  # the form compiler prints its C compiler's command lines
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _show_warning
            options.command(options)
        sys.stdout.flush()
    except BrokenPipeError:  # the reader of a pipe has had enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except KeyboardInterrupt:
        return _fail(options, "interrupted", 130)
    except NanoromError as error:
        return _fail(options, str(error))
    except MemoryError:
        return _fail(options, "not enough memory; ask for fewer modes or a coarser mesh")
    except Exception as error:
        message = f"unexpected {type(error).__name__}: {error} (--debug shows where)"
        return _fail(options, message)
    return 0


def _show_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    from nanorom.workflow import mpi_rank

    if mpi_rank() == 0 and not issubclass(category, DeprecationWarning):  # those are for developers
        print(f"nanorom: warning: {' '.join(str(message).split())}", file=sys.stderr)


def _fail(options: argparse.Namespace, message: str, status: int = 1) -> int:
    from nanorom.workflow import mpi_rank

    together = _others_failed_too()
    if options.debug:
        traceback.print_exc()
    if mpi_rank() == 0 or not together:
        line = "".join(c if c.isprintable() else "?" for c in " ".join(message.split()))
        print(f"nanorom: error: {line}", file=sys.stderr, flush=True)
    if not together:
        sys.modules["mpi4py.MPI"].COMM_WORLD.Abort(status)
    return status


def _others_failed_too() -> bool:
    """Whether every rank got here; if not, the others would wait for this one for ever."""
    mpi: Any = sys.modules.get("mpi4py.MPI")  # loaded by the finite-element half, if at all
    if mpi is None or mpi.COMM_WORLD.size == 1:
        return True
    met = mpi.COMM_WORLD.Ibarrier()
    deadline = time.monotonic() + PATIENCE
    while not met.Test():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.01)
    return True


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="nanorom",
        description="Reduced-order models of nanomechanical resonators from first principles.",
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and exit")
    shared = argparse.ArgumentParser(add_help=False)
    shared.add_argument("--debug", action="store_true", help="show tracebacks")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)

    def command(name: str, run: Any, text: str) -> argparse.ArgumentParser:
        sub = commands.add_parser(name, parents=[shared], help=text, description=text)
        sub.set_defaults(command=run)
        return sub

    sub = command("run", _run, "Do everything a scene asks for: model, response, pictures.")
    sub.add_argument("scene", type=Path, metavar="SCENE", help="scene file (TOML)")
    where = "results; default: results/SCENE without .toml"
    sub.add_argument("-o", "--output", type=Path, metavar="DIR", help=where)
    _add_groups(sub)
    _add_overrides(sub)

    sub = command("plan", _plan, "Say what a scene needs, what is skipped and why, and its cost.")
    sub.add_argument("scene", type=Path, metavar="SCENE", help="scene file (TOML)")
    _add_overrides(sub)

    sub = command("reduce", _reduce, "Reduce a scene to its modal model.")
    sub.add_argument("scene", type=Path, metavar="SCENE", help="scene file (TOML)")
    sub.add_argument("-o", "--output", type=Path, required=True, metavar="ROM", help="rom.h5")
    _add_groups(sub)
    _add_overrides(sub)

    sub = command("tune", _tune, "Follow deflection and frequencies as a scene's [load] grows.")
    sub.add_argument("scene", type=Path, metavar="SCENE", help="scene file (TOML)")
    sub.add_argument(
        "-o",
        "--output",
        type=Path,
        required=True,
        metavar="CURVE",
        help="tuning.h5; the table tuning.csv and the picture tuning.png come beside it",
    )
    sub.add_argument("--points", default="20", help="about how many states (20)")
    _add_overrides(sub)

    sub = command("info", _info, "Print what a rom.h5, a response.h5 or a tuning.h5 holds.")
    sub.add_argument("file", type=Path, metavar="FILE", help="rom.h5, response.h5 or tuning.h5")

    sub = command("respond", _respond, "Follow the frequency response of a reduced model.")
    sub.add_argument("model", type=Path, metavar="ROM", help="rom.h5")
    sub.add_argument("sweep", type=Path, metavar="SWEEP", help="TOML with [drive] and [sweep]")
    sub.add_argument(
        "-o", "--output", type=Path, required=True, metavar="RESPONSE", help="response.h5"
    )

    sub = command("export", _export, "Hand a reduced model to AUTO-07p, MATLAB or a table.")
    sub.add_argument("model", type=Path, metavar="ROM", help="rom.h5")
    sub.add_argument("--to", required=True, choices=("auto", "matlab", "csv"), help="for whom")
    sub.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="TARGET",
        help="directory (auto) or file (default: beside ROM)",
    )
    group = sub.add_argument_group("what AUTO follows (default: what the model's scene says)")
    group.add_argument(
        "--sweep", type=Path, metavar="SWEEP", help="TOML with [drive], [sweep] and [damping]"
    )
    group.add_argument("--level", type=int, default=1, help="which of its drive levels, from 1")
    group.add_argument(
        "--omega", nargs=2, metavar=("FROM", "TO"), help='drive frequencies ("0.8 f1", "20 MHz")'
    )
    group.add_argument("--direct", metavar="LEVEL", help='direct drive ("5 Pa")')
    group.add_argument("--parametric", metavar="LEVEL", help='parametric drive ("5 mN/m")')

    sub = command("identify", _identify, "Find tension and Young's modulus from resonances.")
    sub.add_argument("scene", type=Path, metavar="SCENE", help="scene file (TOML), a first guess")
    sub.add_argument("measured", type=Path, metavar="MEASURED", help="CSV: frequency, label, ...")
    sub.add_argument(
        "--unknowns",
        metavar="NAMES",
        help="of tension, tension_x, tension_y, youngs_modulus, density (comma-separated)",
    )
    sub.add_argument(
        "-o", "--output", type=Path, metavar="DIR", help="gets identified.toml and resonances.png"
    )

    sub = command("plot", _plot, "Draw a rom.h5 (mode gallery), a response.h5 or a tuning.h5.")
    sub.add_argument("file", type=Path, metavar="FILE", help="rom.h5 or response.h5")
    sub.add_argument(
        "--data",
        type=Path,
        metavar="MEASURED",
        help="CSV to draw over a response: frequency, amplitude (unit), sweep, level",
    )
    sub.add_argument(
        "-o", "--output", type=Path, metavar="DIR", help="where to (default: beside FILE)"
    )

    sub = command("bench", _bench, "Measure run time against error, and numerical stability.")
    what = sub.add_mutually_exclusive_group()
    for name, text in (
        ("accuracy", "true error against the estimate, for drums, squares and strings"),
        ("stress", "extreme parameters, each against an exact or a finer solution"),
        ("skips", "what each skip of the plan saves, and what it changes"),
        ("size", "time and memory against unknowns, on the ranks of mpirun"),
    ):
        what.add_argument(f"--{name}", dest="what", action="store_const", const=name, help=text)
    sub.add_argument("--quick", action="store_true", help="a few cases of each kind only")
    sub.add_argument(
        "-o",
        "--output",
        type=Path,
        default=Path("results/bench"),
        metavar="DIR",
        help="where tables and pictures go (default: results/bench)",
    )
    return parser


def _add_overrides(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("instead of what the scene says")
    group.add_argument("--method", help="direct | step | tangent")
    group.add_argument("--in-plane", help="free | fixed")
    group.add_argument("--solver", help="auto | factors | multigrid: slower, for less memory")
    group.add_argument("--modes", help="a count (11) or mode numbers (1,2,6)")
    group.add_argument("--tolerance", help="relative error to aim at (1e-6)")
    group.add_argument("--degree", help="polynomial degree, together with a mesh size")
    group.add_argument("--mesh-size", help='size of the cells ("0.2 um")')


def _add_groups(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--groups",
        metavar="G",
        help="under mpirun: groups of ranks that share load cases, each with the whole mesh "
        "(default: as many as share classes of symmetry and fit into memory)",
    )


class _Version(argparse.Action):
    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        import nanorom

        print(f"nanorom {nanorom.__version__}")
        parser.exit()


def _scene(options: argparse.Namespace) -> Any:
    from nanorom.scene import Scene

    return Scene.from_file(options.scene).with_(
        method=options.method,
        in_plane=options.in_plane,
        solver=options.solver,
        modes=None if options.modes is None else _modes(options.modes),
        tolerance=options.tolerance,
        degree=None if options.degree is None else _integer("--degree", options.degree),
        mesh_size=_number(options.mesh_size),
    )


def _modes(text: str) -> int | list[int]:
    numbers = [_integer("--modes", part) for part in text.split(",")]
    return numbers if "," in text else numbers[0]


def _integer(option: str, text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise NanoromError(f"{option}: found {text!r}; allowed: whole numbers") from None


def _groups(options: argparse.Namespace) -> int | None:
    return None if options.groups is None else _integer("--groups", options.groups)


def _number(text: str | None) -> str | float | None:
    """A plain number is in SI, as in a scene file; anything else carries its unit."""
    try:
        return text if text is None else float(text)
    except ValueError:
        return text


def _run(options: argparse.Namespace) -> None:
    from nanorom.workflow import mpi_rank, run

    scene = _scene(options)
    directory = options.output or Path("results") / options.scene.stem
    with _progress() as progress:
        summary = run(scene, directory, progress, groups=_groups(options))
    if summary is not None and mpi_rank() == 0:
        total = sum(summary["seconds"].values())
        print(f"results in {directory} after {total:.1f} s")


def _plan(options: argparse.Namespace) -> None:
    from nanorom.workflow import plan

    print(plan(_scene(options)))


def _reduce(options: argparse.Namespace) -> None:
    from nanorom.files import check_writable
    from nanorom.workflow import reduce

    scene = _scene(options)
    check_writable(options.output)
    with _progress() as progress:
        reduce(scene, progress, options.output, _groups(options))


def _tune(options: argparse.Namespace) -> None:
    from nanorom.files import check_writable
    from nanorom.workflow import mpi_rank, tune

    points = _integer("--points", options.points)
    if not 2 <= points <= MOST_POINTS:
        raise NanoromError(f"--points: found {points}; allowed: 2 to {MOST_POINTS}")
    scene = _scene(options)
    files = [options.output.with_suffix(suffix) for suffix in (".h5", ".csv", ".png")]
    for file in files:
        check_writable(file)
    with _progress() as progress:
        curve = tune(scene, points, progress)
    if mpi_rank() == 0:
        from nanorom.plots import load_curve

        curve.save(files[0])
        curve.save_csv(files[1])
        load_curve(curve, files[2])
        print(curve.text())


def _info(options: argparse.Namespace) -> None:
    from nanorom import report

    kind, content = _load(options.file)
    texts: dict[str, Any] = {"rom": report.model_text, "response": report.response_text}
    print(content.text() if kind == "curve" else texts[kind](content))


def _respond(options: argparse.Namespace) -> None:
    from nanorom.excitation import Excitation
    from nanorom.files import check_writable
    from nanorom.response import respond
    from nanorom.rom import ReducedModel

    check_writable(options.output)
    excitation = Excitation.from_file(options.sweep)
    model = ReducedModel.load(options.model)
    with _progress() as progress:
        respond(
            model,
            excitation.drive,
            excitation.sweep,
            excitation.damping,
            progress,
            path=options.output,
        )


def _export(options: argparse.Namespace) -> None:
    from nanorom import export
    from nanorom.excitation import Excitation
    from nanorom.rom import ReducedModel

    omega: Any = options.omega and [_number(end) for end in options.omega]
    suffix = {"auto": ".auto", "matlab": ".mat", "csv": ".csv"}[options.to]
    excitation = None if options.sweep is None else Excitation.from_file(options.sweep)
    written = export.export_model(
        ReducedModel.load(options.model),
        options.to,
        options.output or options.model.with_suffix(suffix),
        excitation,
        level=options.level,
        omega=omega,
        direct=_number(options.direct),
        parametric=_number(options.parametric),
    )
    print(written)


def _identify(options: argparse.Namespace) -> None:
    from nanorom import report
    from nanorom.files import check_directory, make_directory
    from nanorom.identify import USUAL, identify
    from nanorom.measured import Resonances
    from nanorom.scene import Scene

    if options.output is not None:
        check_directory(options.output)
    scene = Scene.from_file(options.scene)
    measured = Resonances.from_file(options.measured)
    unknowns = USUAL if options.unknowns is None else options.unknowns.split(",")
    found = identify(scene, measured, unknowns)
    print(report.identification_text(found))
    if options.output is not None:
        from nanorom.plots import resonance_figure

        make_directory(options.output)
        found.save_scene(options.output / "identified.toml")
        resonance_figure(found, options.output / "resonances.png")


def _plot(options: argparse.Namespace) -> None:
    from nanorom.files import check_directory, make_directory

    directory = options.file.parent if options.output is None else options.output
    check_directory(directory)
    kind, content = _load(options.file)
    measured = None
    if options.data is not None:
        from nanorom.measured import MeasuredResponse

        if kind == "rom":
            raise FileError(f"{options.file}: --data goes with a response.h5, not with a model")
        measured = MeasuredResponse.from_file(options.data)
    from nanorom import plots

    make_directory(directory)
    if kind == "rom":
        plots.mode_gallery(content, directory / "modes.png")
    elif kind == "curve":
        plots.load_curve(content, directory / options.file.with_suffix(".png").name)
    else:
        plots.response_figure(content, directory / "response.png", measured)
        plots.amplitude_panels(content, directory / "amplitudes.png")


def _bench(options: argparse.Namespace) -> None:
    from nanorom.bench import command

    command.run(options.output, options.what or "speed", options.quick)


def _load(path: Path) -> tuple[str, Any]:
    from nanorom import hdf5, loadcurve, responsefile, romfile

    kind = hdf5.kind_of(path)
    if kind == responsefile.FORMAT:
        return "response", responsefile.load(path)
    if kind == loadcurve.FORMAT:
        return "curve", loadcurve.LoadCurve.load_file(path)
    if kind in ("", romfile.FORMAT):
        return "rom", romfile.load(path)
    expected = "a rom.h5, a response.h5 or a tuning.h5"
    raise FileError(f"{path}: an HDF5 file of format {kind!r}; expected {expected}")


@contextmanager
def _progress() -> Iterator[Any]:
    """A callable(stage, done, total) that draws a bar, or None where nobody would see it."""
    from nanorom.workflow import mpi_rank

    if mpi_rank() != 0 or not sys.stderr.isatty():
        yield None
        return
    from tqdm import tqdm

    bar = tqdm(file=sys.stderr, leave=False, bar_format="{desc}: {n_fmt}/{total_fmt} [{elapsed}]")

    def show(stage: str, done: int, total: int) -> None:
        bar.total, bar.n = total, done
        bar.set_description_str(stage)

    try:
        yield show
    finally:
        bar.close()
