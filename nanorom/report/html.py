"""Tables and pictures as HTML, for the page of a run and for notebooks."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from html import escape


def facts(rows: Sequence[tuple[str, str]]) -> str:
    """Names and values, one row each."""
    cells = [f"<tr><td>{escape(name)}</td><td>{escape(value)}</td></tr>" for name, value in rows]
    return f'<table class="facts">{"".join(cells)}</table>'


def table(head: Sequence[str], units: Sequence[str], *rows: Sequence[str]) -> str:
    """Columns under their names and units."""
    cells = [f"<th>{escape(n)}<small>{escape(u)}</small></th>" for n, u in zip(head, units)]
    body = ["".join(f"<td>{escape(cell)}</td>" for cell in row) for row in rows]
    lines = "\n".join(f"<tr>{row}</tr>" for row in body)
    return (
        f'<div class="wide"><table><thead><tr>{"".join(cells)}</tr></thead>\n'
        f"<tbody>{lines}</tbody></table></div>"
    )


def picture(png: bytes, caption: str, width: int = 600) -> str:
    """A picture that is part of the page; the caption is what a screen reader says."""
    data = base64.b64encode(png).decode("ascii")
    return f'<img alt="{escape(caption)}" width="{width}" src="data:image/png;base64,{data}">'
