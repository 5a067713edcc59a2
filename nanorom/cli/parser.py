"""Options and arguments of the command line."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from nanorom.cli import commands


def build_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="nanorom",
        description="Reduced-order models of nanomechanical resonators from first principles.",
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and exit")
    shared = argparse.ArgumentParser(add_help=False)
    shared.add_argument("--debug", action="store_true", help="show tracebacks")
    verbs = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)

    def command(name: str, run: Any, text: str) -> argparse.ArgumentParser:
        sub = verbs.add_parser(name, parents=[shared], help=text, description=text)
        sub.set_defaults(command=run)
        return sub

    sub = command(
        "run", commands.run_command, "Do everything a scene asks for: model, response, pictures."
    )
    sub.add_argument("scene", type=Path, metavar="SCENE", help="scene file (TOML)")
    where = "results; default: results/SCENE without .toml"
    sub.add_argument("-o", "--output", type=Path, metavar="DIR", help=where)
    _add_groups(sub)
    _add_overrides(sub)

    sub = command(
        "plan",
        commands.plan_command,
        "Say what a scene needs, what is skipped and why, and its cost.",
    )
    sub.add_argument("scene", type=Path, metavar="SCENE", help="scene file (TOML)")
    _add_overrides(sub)

    sub = command("reduce", commands.reduce_command, "Reduce a scene to its modal model.")
    sub.add_argument("scene", type=Path, metavar="SCENE", help="scene file (TOML)")
    sub.add_argument("-o", "--output", type=Path, required=True, metavar="ROM", help="rom.h5")
    _add_groups(sub)
    _add_overrides(sub)

    sub = command(
        "tune",
        commands.tune_command,
        "Follow deflection and frequencies as a scene's [load] grows.",
    )
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

    sub = command(
        "info", commands.info_command, "Print what a rom.h5, a response.h5 or a tuning.h5 holds."
    )
    sub.add_argument("file", type=Path, metavar="FILE", help="rom.h5, response.h5 or tuning.h5")

    sub = command(
        "respond", commands.respond_command, "Follow the frequency response of a reduced model."
    )
    sub.add_argument("model", type=Path, metavar="ROM", help="rom.h5")
    sub.add_argument("sweep", type=Path, metavar="SWEEP", help="TOML with [drive] and [sweep]")
    sub.add_argument(
        "-o", "--output", type=Path, required=True, metavar="RESPONSE", help="response.h5"
    )

    sub = command(
        "export", commands.export_command, "Hand a reduced model to AUTO-07p, MATLAB or a table."
    )
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

    sub = command(
        "identify", commands.identify_command, "Find tension and Young's modulus from resonances."
    )
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

    sub = command(
        "plot", commands.plot_command, "Draw a rom.h5 (mode gallery), a response.h5 or a tuning.h5."
    )
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

    sub = command(
        "bench", commands.bench_command, "Measure run time against error, and numerical stability."
    )
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
        from nanorom.version import version

        print(f"nanorom {version()}")
        parser.exit()
