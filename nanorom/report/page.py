"""All results of a run in one HTML file that needs no network: pictures are part of it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from html import escape
from pathlib import Path
from string import Template

import numpy as np

from nanorom.continuation.orbits.bifurcations import KINDS
from nanorom.files.whole import atomic_path
from nanorom.report import html
from nanorom.report import text as report
from nanorom.results.response import Response
from nanorom.rom.model import ReducedModel
from nanorom.rom.tables import NEGLIGIBLE, CoefficientTable
from nanorom.scene.scene import Scene
from nanorom.scene.units import with_unit

MOST_CELLS = 30_000  # of a table of coefficients; larger ones are for other programs
CAPTIONS = {
    "response.png": "Frequency response at every drive level: total amplitude, the root of the sum "
    "of the squares of max |q_r| over a period.",
    "amplitudes.png": "The same mode by mode, for the modes that take part.",
    "modes.png": "Mode shapes, scaled to max |φ| = 1.",
}

PAGE = Template("""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="icon" href="data:,">
<title>$title</title>
<style>
body { font: 16px/1.5 system-ui, sans-serif; color: #222; background: #fff;
       max-width: 60rem; margin: 0 auto; padding: 1rem; }
h1 { font-size: 1.5rem; margin: .5rem 0; }
h2 { font-size: 1.15rem; margin: 2rem 0 .5rem; border-bottom: 1px solid #ccc; }
figure { margin: 1rem 0; break-inside: avoid; }
img { display: block; max-width: 100%; height: auto; margin: 0 auto; }
figcaption { text-align: center; }
figcaption, .note { color: #555; font-size: .875rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .875rem; font-variant-numeric: tabular-nums; }
th, td { padding: .15rem .6rem; text-align: right; white-space: nowrap; }
th { font-weight: 600; vertical-align: bottom; }
th small { display: block; font-weight: 400; color: #555; }
tbody tr:nth-child(odd) { background: #f4f4f4; }
table.facts td { text-align: left; white-space: normal; overflow-wrap: anywhere; }
table.facts td:first-child { white-space: nowrap; color: #555; vertical-align: top; }
pre { background: #f4f4f4; padding: .75rem; overflow-x: auto; font-size: .8125rem; }
summary { cursor: pointer; }
@media print { body { font-size: 10pt; max-width: none; padding: 0; }
  .wide, pre { overflow: visible; } table, pre { font-size: 7pt; } pre { white-space: pre-wrap; }
  img { max-height: 20cm; } tr { break-inside: avoid; } }
</style>
</head>
<body>
<h1>$title</h1>
<p class="note">$lead</p>
$sections
</body>
</html>
""")


def write(
    path: str | Path,
    title: str,
    scene: Scene,
    model: ReducedModel,
    response: Response | None,
    seconds: Mapping[str, float],
    pictures: Iterable[Path],
) -> None:
    """Write the page, whole or not at all; raises FileError.

    seconds: run times by stage; pictures: PNG files, which are copied into it.
    """
    sections = [_figure(picture) for picture in pictures]
    sections += [_modes(model)]
    if response is not None:
        sections += [_special_points(response)]
    sections += [_coefficients(model, order) for order in (3, 2)]
    sections += [_parameters(scene), _provenance(model, seconds)]
    lowest = with_unit(float(model.frequency[0]), "Hz", 6)
    lead = f"{model.size} modes, {model.method} reduction, lowest frequency {lowest}"
    page = PAGE.substitute(title=escape(title), lead=escape(lead), sections="\n".join(sections))
    with atomic_path(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


def _figure(picture: Path) -> str:
    caption = CAPTIONS.get(picture.name, picture.stem)
    image = html.picture(picture.read_bytes(), caption)
    return f"<figure>{image}<figcaption>{escape(caption)}</figcaption></figure>"


def _modes(model: ReducedModel) -> str:
    return "<h2>Modes</h2>" + html.table(*report.model_rows(model))


def _special_points(response: Response) -> str:
    head, units, *rows = report.point_rows(response)
    names = ", ".join(f"{kind.code} {kind.name}" for kind in KINDS.values())
    text = html.facts(report.level_facts(response)) + f'<p class="note">{escape(names)}</p>'
    tables = [html.table(head, units, *rows)] if rows else []
    head, units, *rows = report.unexplored_rows(response)
    tables += [html.table(head, units, *rows)] if rows else []
    return "<h2>Response</h2>" + text + "".join(tables)


def _coefficients(model: ReducedModel, order: int) -> str:
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


def _parameters(scene: Scene) -> str:
    return f"<h2>Parameters (SI units)</h2><pre>{escape(scene.to_toml().strip())}</pre>"


def _provenance(model: ReducedModel, seconds: Mapping[str, float]) -> str:
    times = ", ".join(f"{name} {value:.2f} s" for name, value in seconds.items())
    return "<h2>How it was made</h2>" + html.facts(
        [*report.model_facts(model), ("run times", times)]
    )
