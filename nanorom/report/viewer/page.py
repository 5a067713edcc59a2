"""The page's file: its text, its style, its program, the libraries, and what it shows."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template

import attrs

from nanorom.files.whole import atomic_path
from nanorom.report.viewer.pack import Pack, packed

ASSETS = files("nanorom.report.viewer")
LIBRARIES = {"three": "vendor/three.min.js", "uplot": "vendor/uplot.min.js"}
PROGRAM = (
    "chart", "curves", "dom", "film", "gallery", "loads", "main", "motion", "orbit", "response",
    "selection", "spectrum", "store", "surface", "tables", "theme", "thinned", "units", "verified",
)  # fmt: skip
STYLES = ("vendor/uplot.css", "assets/style.css")


@attrs.frozen(eq=False)
class Page:
    """A page: its title, a line below it, what its program draws, and sections of HTML."""

    title: str
    lead: str
    pack: Pack
    sections: Sequence[str] = ()

    def html(self) -> str:
        """The whole page as text."""
        scripts = {name: _text(path) for name, path in LIBRARIES.items()}
        scripts |= {name: _text(f"assets/{name}.js") for name in PROGRAM}
        return Template(_text("assets/page.html")).substitute(
            title=escape(self.title),
            lead=escape(self.lead),
            style="\n".join(map(_text, STYLES)),
            sections="\n".join(self.sections),
            modules="\n".join(_script(name, packed(t.encode())) for name, t in scripts.items()),
            table=self.pack.table().replace("<", "\\u003c"),
            data=_script("data", self.pack.bytes()),
            boot=_text("assets/boot.js"),
        )

    def write(self, path: str | Path) -> None:
        """Write the page, whole or not at all; raises FileError."""
        text = self.html()
        with atomic_path(path) as temporary:
            temporary.write_text(text, encoding="utf-8")


def _text(name: str) -> str:
    return ASSETS.joinpath(name).read_text(encoding="utf-8")


def _script(name: str, text: str) -> str:
    return f'<script type="text/plain" data-packed="{name}">{text}</script>'
