"""Options and arguments of the command line: one row of COMMANDS for each command."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

from nanorom.cli import shared


class Command(NamedTuple):
    """What runs a command, what its help says, and who adds its options to a parser."""

    run: Callable[[argparse.Namespace], None]
    text: str
    options: Callable[[argparse.ArgumentParser], None]


def build_parser(arguments: Sequence[str] | None = None) -> argparse.ArgumentParser:
    """The parser of all commands; ``command`` of what it parses runs the one that was given.

    arguments : what it is for, if known; commands that are not among them get no options then.
    """
    parser = argparse.ArgumentParser(
        prog="nanorom",
        description="Reduced-order models of nanomechanical resonators from first principles.",
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and exit")
    debug = argparse.ArgumentParser(add_help=False)
    debug.add_argument("--debug", action="store_true", help="show tracebacks")
    verbs = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for name, (run, text, options) in COMMANDS.items():
        if arguments is not None and name not in arguments:
            verbs.add_parser(name, add_help=False, help=text)
            continue
        command = verbs.add_parser(name, parents=[debug], help=text, description=text)
        command.set_defaults(command=run)
        options(command)
    return parser


def _run(parser: argparse.ArgumentParser) -> None:
    shared.scene(parser)
    where = "results; default: results/SCENE without .toml"
    parser.add_argument("-o", "--output", type=Path, metavar="DIR", help=where)
    shared.groups(parser)
    shared.overrides(parser)


def _plan(parser: argparse.ArgumentParser) -> None:
    shared.scene(parser)
    shared.overrides(parser)


def _reduce(parser: argparse.ArgumentParser) -> None:
    shared.scene(parser)
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="ROM", help="rom.h5")
    shared.groups(parser)
    shared.overrides(parser)


def _tune(parser: argparse.ArgumentParser) -> None:
    shared.scene(parser)
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        required=True,
        metavar="CURVE",
        help="tuning.h5; the table tuning.csv and the picture tuning.png come beside it",
    )
    parser.add_argument("--points", default="20", help="about how many states (20)")
    parser.add_argument("--at", metavar="LOADS", help='these alone, rising: "2 V, 5 V, 8 V"')
    shared.overrides(parser)


def _verify(parser: argparse.ArgumentParser) -> None:
    shared.scene(parser)
    parser.add_argument(
        "response",
        type=Path,
        nargs="?",
        metavar="RESPONSE",
        help="response.h5 of the scene's model; left out, it is made first",
    )
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        required=True,
        metavar="VERIFIED",
        help="verified.h5; the picture verified.png comes beside it",
    )
    parser.add_argument("--level", help="which of the drive levels, from 1 (all)")
    parser.add_argument("--points", default="24", help="how many orbits of each level (24)")
    parser.add_argument(
        "--more",
        help="modes beyond the model's highest that lead to the film's orbits and are told apart "
        "(as many as it has, from 8 to 20, and three times as many modes where these do not)",
    )
    parser.add_argument(
        "--estimate", action="store_true", help="estimate errors alone, solve for no orbit"
    )
    shared.overrides(parser)


def _info(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", type=Path, metavar="FILE", help="any of nanorom's HDF5 files")


def _respond(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("model", type=Path, metavar="ROM", help="rom.h5")
    parser.add_argument(
        "sweep",
        type=Path,
        metavar="SWEEP",
        nargs="?",
        help="TOML with [drive] and [sweep] (those of the scene that the model is of)",
    )
    parser.add_argument(
        "-o", "--output", type=Path, required=True, metavar="RESPONSE", help="response.h5"
    )


def _export(parser: argparse.ArgumentParser) -> None:
    from nanorom.export import formats

    parser.add_argument("model", type=Path, metavar="FILE", help="rom.h5 or response.h5")
    parser.add_argument(
        "--to",
        required=True,
        metavar="FORMAT",
        help=f"{formats.names(False)}; of a response: {formats.names(True)}",
    )
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="TARGET",
        help="directory (auto, coco) or file (default: beside FILE)",
    )
    group = parser.add_argument_group("the drive of a model (default: what its scene says)")
    group.add_argument(
        "--sweep", type=Path, metavar="SWEEP", help="TOML with [drive], [sweep] and [damping]"
    )
    group.add_argument("--level", type=int, default=1, help="which of its drive levels, from 1")
    group.add_argument(
        "--omega", nargs=2, metavar=("FROM", "TO"), help='drive frequencies ("0.8 f1", "20 MHz")'
    )
    group.add_argument("--direct", metavar="LEVEL", help='direct drive ("5 Pa")')
    group.add_argument("--parametric", metavar="LEVEL", help='parametric drive ("5 mN/m")')
    parser.add_argument(
        "--at",
        metavar="FREQUENCY",
        help="vtk of a response: moves the film of the rom.h5 beside it as it does at the largest "
        "stable orbit of --level there (default: of all)",
    )


def _effective(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "model", type=Path, metavar="ROM", help="rom.h5, or a scene (.toml) that is reduced first"
    )
    parser.add_argument("--mode", default="1", help="number or name of the mode (1)")
    parser.add_argument("--order", default="7", help="of the manifold (7)")
    parser.add_argument(
        "--film",
        action="store_true",
        help="of a scene: let every degree of freedom of the film follow, not its modes alone",
    )
    parser.add_argument(
        "--reach", metavar="AMPLITUDE", help='raise the order until it holds to there ("20 nm")'
    )
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="EFFECTIVE",
        help="effective.h5; the picture comes beside it",
    )


def _sensitivity(parser: argparse.ArgumentParser) -> None:
    shared.scene(parser)
    parser.add_argument(
        "--of",
        metavar="NAMES",
        help="f1,m1,k1,b111,f2/f1,LP1,... (default: every f and b of one mode)",
    )
    parser.add_argument(
        "--by", metavar="KEYS", help="plate.thickness,tension.x,... (default: all that act)"
    )
    parser.add_argument(
        "--spread",
        metavar="DEVIATIONS",
        help="plate.thickness=3%%,tension=5%%,...: what these make of each quantity, beside what "
        'the scene says ("10 nm +- 3 %%")',
    )
    parser.add_argument(
        "-o", "--output", type=Path, metavar="TABLE", help="CSV; a picture comes beside it"
    )
    shared.overrides(parser)


def _plot(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", type=Path, metavar="FILE", help="any of nanorom's HDF5 files")
    parser.add_argument(
        "--data",
        type=Path,
        nargs="+",
        metavar="MEASURED",
        help="tables to draw over a response: frequency, amplitude (unit), sweep, level",
    )
    shared.columns(parser)
    parser.add_argument(
        "--read",
        metavar="OUTPUT",
        help='of a response, instead: decibels and phase of a mode (f01), a point ("1 um, 0 um") '
        "or the readout's spot; of its voltage where there is a readout",
    )
    parser.add_argument(
        "--harmonic", default="1", help="of the drive's frequency that is read (1); 1/2, 2, ..."
    )
    parser.add_argument(
        "--comb",
        action="store_true",
        help="of a response, instead: the spectrum over drive frequency of a sweep up in time at "
        "one level, by the rom.h5 beside it",
    )
    parser.add_argument("--level", help="of the comb, from 1 (the last)")
    parser.add_argument(
        "-o", "--output", type=Path, metavar="DIR", help="where to (default: beside FILE)"
    )


def _view(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "path", type=Path, metavar="PATH", help="any of nanorom's HDF5 files, or a folder of them"
    )
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="PAGE",
        help="the page, or the folder for the pages (default: beside the files)",
    )
    parser.add_argument("--no-browser", action="store_true", help="write the page, open no browser")


def _bench(parser: argparse.ArgumentParser) -> None:
    what = parser.add_mutually_exclusive_group()
    for name, text in (
        ("accuracy", "true error against the estimate: drums, squares, strings and random scenes"),
        ("scenes", "the random scenes alone; goes on where it was interrupted"),
        ("stress", "extreme parameters, each against an exact or a finer solution"),
        ("skips", "what each skip of the plan saves, and what it changes"),
        ("size", "time and memory against unknowns, on the ranks of mpirun"),
    ):
        what.add_argument(f"--{name}", dest="what", action="store_const", const=name, help=text)
    parser.add_argument("--quick", action="store_true", help="a few cases of each kind only")
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        default=Path("results/bench"),
        metavar="DIR",
        help="where tables and pictures go (default: results/bench)",
    )


class _Version(argparse.Action):
    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        from nanorom.version import version

        print(f"nanorom {version()}")
        parser.exit()


def _of(module: str, function: str) -> Callable[[Any], None]:
    """A function of a module beside this one, imported when it runs: help needs none of them."""

    def run(given: Any) -> None:
        getattr(import_module(f"nanorom.cli.{module}"), function)(given)

    return run


COMMANDS = {
    "run": Command(
        _of("commands", "run_command"),
        "Do everything a scene asks for: model, response, pictures.",
        _run,
    ),
    "plan": Command(
        _of("commands", "plan_command"),
        "Say what a scene needs, what is skipped and why, and its cost.",
        _plan,
    ),
    "reduce": Command(
        _of("commands", "reduce_command"), "Reduce a scene to its modal model.", _reduce
    ),
    "tune": Command(
        _of("commands", "tune_command"),
        "Follow deflection and frequencies as a scene's [load] grows.",
        _tune,
    ),
    "verify": Command(
        _of("commands", "verify_command"),
        "Hold a response against the whole film's own periodic orbits.",
        _verify,
    ),
    "info": Command(_of("commands", "info_command"), "Print what a file of nanorom holds.", _info),
    "respond": Command(
        _of("commands", "respond_command"),
        "Follow the frequency response of a reduced model.",
        _respond,
    ),
    "export": Command(
        _of("commands", "export_command"),
        "Hand a model or a response to other programs or tables.",
        _export,
    ),
    "effective": Command(
        _of("commands", "effective_command"),
        "Tell what a fit of a single oscillator to a mode returns, and which modes cause it.",
        _effective,
    ),
    "identify": Command(
        _of("measured", "identify_command"),
        "Find tension, Young's modulus and more from resonances.",
        _of("measured", "identify_options"),
    ),
    "sensitivity": Command(
        _of("commands", "sensitivity_command"),
        "Tell by how many per cent results change for each per cent of a scene's numbers.",
        _sensitivity,
    ),
    "sweep": Command(
        _of("devices", "sweep_command"),
        "Reduce many devices, a grid or samples of a scene's keys, into one table.",
        _of("devices", "sweep_options"),
    ),
    "design": Command(
        _of("devices", "design_command"),
        "Find the device that is best at something, within bounds and under conditions.",
        _of("devices", "design_options"),
    ),
    "peaks": Command(
        _of("measured", "peaks_command"),
        "Find Q, Duffing coefficient, damping and folds of every peak, without a model.",
        _of("measured", "peaks_options"),
    ),
    "plot": Command(
        _of("commands", "plot_command"),
        "Draw a result file: modes, responses, load curves, the film beside its model.",
        _plot,
    ),
    "view": Command(
        _of("commands", "view_command"),
        "Make a page to work with of a file, or of a folder: diagrams, the moving film, tables.",
        _view,
    ),
    "bench": Command(
        _of("commands", "bench_command"),
        "Measure run time against error, and numerical stability.",
        _bench,
    ),
}
