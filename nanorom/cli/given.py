"""What options of the command line say, read; files that it is given; progress that it draws."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from nanorom.errors import FileError, NanoromError


def scene_of(options: argparse.Namespace) -> Any:
    """The scene of a file, with what options say instead."""
    from nanorom.scene.scene import Scene

    return Scene.from_file(options.scene).with_(
        method=options.method,
        in_plane=options.in_plane,
        solver=options.solver,
        modes=None if options.modes is None else _modes(options.modes),
        tolerance=options.tolerance,
        degree=None if options.degree is None else integer("--degree", options.degree),
        mesh_size=number(options.mesh_size),
    )


def _modes(text: str) -> int | list[int]:
    numbers = [integer("--modes", part) for part in text.split(",")]
    return numbers if "," in text else numbers[0]


def integer(option: str, text: str) -> int:
    """A whole number of an option."""
    try:
        return int(text)
    except ValueError:
        raise NanoromError(f"{option}: found {text!r}; allowed: whole numbers") from None


def groups_of(options: argparse.Namespace) -> int | None:
    """Groups of ranks, if given."""
    return None if options.groups is None else integer("--groups", options.groups)


def number(text: str | None) -> str | float | None:
    """A plain number is in SI, as in a scene file; anything else carries its unit."""
    try:
        return text if text is None else float(text)
    except ValueError:  # with its unit, which is read later
        return text


def columns_of(options: argparse.Namespace) -> dict[str, str]:
    """What columns of a measurement are called, by what they are."""
    return pairs_of("--columns", options.columns, "frequency=NAME,amplitude=NAME")


def pairs_of(
    option: str, text: str | None, allowed: str = "plate.thickness=3%,tension=5%"
) -> dict[str, str]:
    """What an option says by name, NAME=VALUE between commas."""
    found = {}
    for part in filter(None, (text or "").split(",")):
        name, sign, value = part.partition("=")
        if not sign:
            raise FileError(f"{option}: found {part!r}; allowed: {allowed}")
        found[name.strip()] = value.strip()
    return found


def names_of(text: str) -> list[str]:
    """Names between commas; those within brackets belong to a name."""
    return [name.strip() for name in re.split(r",(?![^(]*\))", text)]


def load(path: Path) -> tuple[Any, Any]:
    """The kind of a file and what it holds."""
    from nanorom.files import stored

    kind = stored.kind_of(path)
    return kind, stored.call(kind.load, path)


@contextmanager
def progress_bar() -> Iterator[Any]:
    """A callable(stage, done, total) that draws a bar, or None where nobody would see it."""
    from nanorom.launch import mpi_rank

    if mpi_rank() != 0 or not sys.stderr.isatty():
        yield None
        return
    from tqdm import tqdm

    from nanorom.launch import bar

    shown = "{desc}: {n_fmt}/{total_fmt} [{elapsed}]"
    with bar(tqdm, file=sys.stderr, bar_format=shown) as show:
        yield show
