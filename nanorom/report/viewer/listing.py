"""Pages of files beside them, and of a folder: what each file holds, with a link to its page."""

from __future__ import annotations

import os
from html import escape
from pathlib import Path
from urllib.parse import quote

from nanorom.errors import FileError
from nanorom.files import hdf5, stored
from nanorom.files.whole import make_directory
from nanorom.report import page
from nanorom.report.text import counted
from nanorom.report.viewer.pack import Pack
from nanorom.report.viewer.page import Page

MOST = 50  # files that a listing takes; a page is made of each
DEEPEST = 4  # folders below the one that is listed
SUFFIX = ".h5"
INDEX = "nanorom.html"
USUAL = {kind.name for kind in stored.KINDS.values()}


def view(path: Path, output: Path | None = None) -> Path:
    """Write the page of a file, or of a folder with the pages of its files; returns its path.

    output: the page, or the folder for the pages; by default they are beside the files, of the
    same names. Raises FileError.
    """
    if path.is_dir():
        return _folder(path, path if output is None else output)
    target = path.with_suffix(".html") if output is None else output
    page.of_file(path).write(target)
    return target


def results(folder: Path) -> list[Path]:
    """Files of nanorom in a folder and those below it, by name, damaged ones among them."""
    found: list[Path] = []
    for place, folders, names in os.walk(folder):
        deep = len(Path(place).relative_to(folder).parts) >= DEEPEST
        folders[:] = [] if deep else sorted(n for n in folders if not n.startswith("."))
        files = (Path(place) / name for name in sorted(names) if name.endswith(SUFFIX))
        found += [file for file in files if _ours(file)]
    return found


def _ours(file: Path) -> bool:
    """Whether a file is one of nanorom's, or has the name of one and is damaged."""
    kind = hdf5.kind_of(file)
    return kind in stored.KINDS or (not kind and file.name in USUAL)


def _folder(folder: Path, output: Path) -> Path:
    found = results(folder)
    if not found:
        raise FileError(f"{folder}: there is no file of nanorom in it; those end in {SUFFIX}")
    rows = [_row(file, file.relative_to(folder), output) for file in found[:MOST]]
    left = len(found) - MOST
    more = f'<p class="note">{left} more files are not listed</p>' if left > 0 else ""
    table = f'<table class="facts"><tbody>{"".join(rows)}</tbody></table>{more}'
    index = make_directory(output) / INDEX
    title = f"nanorom: {folder.resolve().name}"
    Page(title, counted(len(found), "file"), Pack(), [table]).write(index)
    return index


def _row(file: Path, name: Path, output: Path) -> str:
    """A row of the listing; the page of the file is written, unless the file is damaged."""
    target = (output / name).with_suffix(".html")
    shown = escape(str(name))
    try:
        made = page.of_file(file)
    except FileError as error:
        return f"<tr><td>{shown}</td><td>{escape(str(error))}</td></tr>"
    make_directory(target.parent)
    made.write(target)
    link = quote(target.relative_to(output).as_posix())
    return f'<tr><td><a href="{link}">{shown}</a></td><td>{escape(made.lead)}</td></tr>'
