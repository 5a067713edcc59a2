"""Options and arguments that several commands share."""

from __future__ import annotations

import argparse
from pathlib import Path


def scene(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", type=Path, metavar="SCENE", help="scene file (TOML)")


def columns(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--columns",
        metavar="NAMES",
        help="which columns of a table are meant, by name or number: frequency=f0,amplitude=3",
    )


def overrides(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("instead of what the scene says")
    group.add_argument("--method", help="direct | step | tangent")
    group.add_argument("--in-plane", help="free | fixed")
    group.add_argument("--solver", help="auto | factors | multigrid: slower, for less memory")
    group.add_argument("--modes", help="a count (11) or mode numbers (1,2,6)")
    group.add_argument("--tolerance", help="relative error to aim at (1e-6)")
    group.add_argument("--degree", help="polynomial degree, together with a mesh size")
    group.add_argument("--mesh-size", help='size of the cells ("0.2 um")')


def groups(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--groups",
        metavar="G",
        help="under mpirun: groups of ranks that share load cases, each with the whole mesh "
        "(default: as many as share classes of symmetry and fit into memory)",
    )
