"""Sections of a page in HTML: tables of modes, special points and coefficients, parameters."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from pathlib import Path

import numpy as np

from nanorom.continuation.orbits.bifurcations import KINDS
from nanorom.report import html
from nanorom.report import text as report
from nanorom.results.response import Response
from nanorom.rom.model import ReducedModel
from nanorom.rom.tables import NEGLIGIBLE, CoefficientTable

MOST_CELLS = 30_000  # of a table of coefficients; larger ones are for other programs
CAPTIONS = {
    "response.png": "Frequency response at every drive level: total amplitude, the root of the sum "
    "of the squares of max |q_r| over a period.",
    "amplitudes.png": "The same mode by mode, for the modes that take part.",
    "modes.png": "Mode shapes, scaled to max |φ| = 1.",
}


def figure(picture: Path) -> str:
    """A picture with its caption."""
    caption = CAPTIONS.get(picture.name, picture.stem)
    image = html.picture(picture.read_bytes(), caption)
    return f"<figure>{image}<figcaption>{escape(caption)}</figcaption></figure>"


def modes(model: ReducedModel) -> str:
    """The table of modes."""
    return "<h2>Table of modes</h2>" + html.table(*report.model_rows(model))


def special_points(response: Response) -> str:
    """The drive levels, the special points, and what was not explored."""
    head, units, *rows = report.point_rows(response)
    names = ", ".join(f"{kind.code} {kind.name}" for kind in KINDS.values())
    text = html.facts(report.level_facts(response)) + f'<p class="note">{escape(names)}</p>'
    tables = []
    if rows:  # the page's program links them to the diagram
        tables += [f'<div data-rows="special-points">{html.table(head, units, *rows)}</div>']
    head, units, *rows = report.unexplored_rows(response)
    tables += [html.table(head, units, *rows)] if rows else []
    return "<h2>Special points</h2>" + text + "".join(tables)


def coefficients(model: ReducedModel, order: int) -> str:
    """The nonlinear coefficients of one order, folded; nothing where all vanish."""
    table = CoefficientTable.of(model, order).nonzero()
    if not table.products:
        return ""
    name = "b_jkl" if order == 3 else "alpha_jk"
    if table.values.size > MOST_CELLS:
        body = '<p class="note">Too many for a page: nanorom export rom.h5 --to csv</p>'
    else:
        least = NEGLIGIBLE * np.abs(table.values).max()
        rows = [
            (",".join(map(str, product)), *(f"{b:.4e}" if abs(b) > least else "0" for b in row))
            for product, row in zip(table.products, table.values)
        ]
        body = html.table((name, *table.labels), ("",) * (len(table.labels) + 1), *rows)
    return (
        f"<h2>Coefficients {name} in {escape(table.unit)}</h2><details><summary>"
        f"{len(table.products)} products of amplitudes, one column per equation</summary>"
        f"{body}</details>"
    )


def parameters(toml: str) -> str:
    """The scene, or drive and sweep, as TOML."""
    return plain("Parameters (SI units)", toml.strip())


def plain(title: str, content: str) -> str:
    """Text as it is, under a title."""
    return f"<h2>{escape(title)}</h2><pre>{escape(content)}</pre>" if content else ""


def provenance(model: ReducedModel, seconds: Mapping[str, float]) -> str:
    """What the reduction reports about itself, and run times by stage."""
    times = ", ".join(f"{name} {value:.2f} s" for name, value in seconds.items())
    return "<h2>How it was made</h2>" + html.facts(
        [*report.model_facts(model), *([("run times", times)] if times else [])]
    )
