"""What a notebook shows of a model, a response or a load curve: tables, and pictures of modes."""

from __future__ import annotations

from html import escape
from io import BytesIO
from typing import TYPE_CHECKING

from nanorom.report import html, text
from nanorom.rom.model import ReducedModel
from nanorom.scene.units import with_unit

if TYPE_CHECKING:
    from nanorom.results.design import Design
    from nanorom.results.effective import Effective
    from nanorom.results.loadcurve import LoadCurve
    from nanorom.results.response import Response
    from nanorom.results.study import Study
    from nanorom.results.verified import Verified

MOST_PICTURES = 12  # of modes; a notebook stays small and quick
RESOLUTION = 110  # dots per inch, of a gallery as wide as a column of a paper


def model_html(model: ReducedModel) -> str:
    """A table of the modes, pictures of the lowest, and what the model holds."""
    low, high = (with_unit(float(f), "Hz", 6) for f in model.frequency[[0, -1]])
    head = f"<b>Reduced model</b> of {model.size} modes, {low} to {high}"
    held = f"<details><summary>arrays</summary><pre>{escape(repr(model))}</pre></details>"
    parts = [head, html.table(*text.model_rows(model))]
    if model.shapes is not None:
        parts.append(_gallery(model.select(model.number[:MOST_PICTURES].tolist())))
    return "\n".join([*parts, held])


def response_html(response: Response) -> str:
    """The drive levels and a table of the special points."""
    parts = ["<b>Response</b>", html.facts(text.level_facts(response))]
    for head, units, *rows in (text.point_rows(response), text.unexplored_rows(response)):
        parts += [html.table(head, units, *rows)] if rows else []
    return "\n".join(parts)


def load_curve_html(curve: LoadCurve) -> str:
    """The table of states, and what there is to say of it."""
    return f"<pre>{escape(curve.text())}</pre>"


def effective_html(effective: Effective) -> str:
    """The coefficients and what they come from."""
    return f"<pre>{escape(effective.text())}</pre>"


def design_html(design: Design) -> str:
    """The best device, and where searches ended."""
    from nanorom.report.design import design_text

    return f"<pre>{escape(design_text(design))}</pre>"


def study_html(study: Study) -> str:
    """How keys and quantities are spread."""
    from nanorom.report.study import study_text

    return f"<pre>{escape(study_text(study))}</pre>"


def verified_html(verified: Verified) -> str:
    """The table of orbits, and what it comes to."""
    lines = "<br>".join(map(escape, verified.facts()))
    return "\n".join(["<b>Verified</b>", html.table(*verified.rows()), f"<p>{lines}</p>"])


def _gallery(model: ReducedModel) -> str:
    from nanorom.plots import mode_gallery

    file = BytesIO()
    mode_gallery(model).savefig(file, format="png", dpi=RESOLUTION)
    names = ", ".join(model.label)
    return html.picture(file.getvalue(), f"mode shapes {names}", 400)
