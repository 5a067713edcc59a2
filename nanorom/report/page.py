"""The page of each kind of result, and of a whole run: what is drawn, and the tables below."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from nanorom.errors import FileError
from nanorom.files import stored
from nanorom.report import html, sections, text
from nanorom.report.design import design_text
from nanorom.report.study import study_text
from nanorom.report.viewer import data
from nanorom.report.viewer.pack import Pack
from nanorom.report.viewer.page import Page
from nanorom.results.beside import model_beside
from nanorom.results.design import Design
from nanorom.results.effective import Effective
from nanorom.results.loadcurve import LoadCurve
from nanorom.results.response import Response
from nanorom.results.study import Study
from nanorom.results.verified import Verified
from nanorom.rom.model import ReducedModel
from nanorom.scene.scene import Scene
from nanorom.scene.units import with_unit


def write(
    path: str | Path,
    title: str,
    scene: Scene,
    model: ReducedModel,
    response: Response | None,
    seconds: Mapping[str, float],
    pictures: Iterable[Path],
) -> None:
    """Write the page of a run, whole or not at all; raises FileError.

    seconds: run times by stage; pictures: PNG files, shown where scripts are not run.
    """
    figures = "".join(sections.figure(picture) for picture in pictures)
    below = [f"<noscript>{figures}</noscript>", sections.modes(model)]
    pack = Pack()
    data.add_model(pack, model)
    if response is not None:
        data.add_response(pack, response)
        below += [sections.special_points(response)]
    below += [sections.coefficients(model, order) for order in (3, 2)]
    below += [sections.parameters(scene.to_toml()), sections.provenance(model, seconds)]
    Page(title, _lead(model), pack, below).write(path)


def model_page(model: ReducedModel, path: Path) -> Page:
    """Its modes, coefficients and parameters."""
    pack = Pack()
    data.add_model(pack, model)
    below = [sections.modes(model), *(sections.coefficients(model, order) for order in (3, 2))]
    below += [sections.parameters(model.scene), sections.provenance(model, {})]
    return Page(_title(path), _lead(model), pack, below)


def response_page(response: Response, path: Path) -> Page:
    """The response, and the moving film where its model is beside it."""
    pack, below = Pack(), []
    try:
        model = model_beside(response, path)
    except FileError as error:
        lead = f"the film is not shown: {error}"
    else:
        lead = _lead(model)
        data.add_model(pack, model)
        below += [sections.modes(model)]
    data.add_response(pack, response)
    below += [sections.special_points(response), sections.parameters(response.excitation)]
    return Page(_title(path), lead, pack, below)


def load_curve_page(curve: LoadCurve, path: Path) -> Page:
    """Deflection and frequencies against the load."""
    pack = Pack()
    data.add_load_curve(pack, curve)
    lead = f"{len(curve.load)} states against the {curve.quantity}"
    return Page(_title(path), lead, pack, [sections.plain("States", curve.text())])


def effective_page(effective: Effective, path: Path) -> Page:
    """Coefficients of one mode, and what they come from."""
    table = sections.plain("Effective coefficients", effective.text())
    return Page(_title(path), f"effective coefficients of {effective.mode}", Pack(), [table])


def design_page(design: Design, path: Path) -> Page:
    """The best device, its spread and its scene, and where searches ended."""
    below = [sections.plain("Design", design_text(design)), sections.parameters(design.best)]
    return Page(_title(path), "; ".join(design.asked), Pack(), below)


def study_page(study: Study, path: Path) -> Page:
    """How keys and quantities of many devices are spread."""
    below = [sections.plain("Spread", study_text(study)), sections.parameters(study.scene)]
    return Page(_title(path), f"a study of {text.counted(len(study), 'device')}", Pack(), below)


def verified_page(verified: Verified, path: Path) -> Page:
    """Orbits of the model beside those of the film."""
    pack = Pack()
    data.add_verified(pack, verified)
    table = f"<h2>Orbits</h2>{html.table(*verified.rows())}"
    below = [table, sections.parameters(verified.scene)]
    return Page(_title(path), "; ".join(verified.facts()), pack, below)


def of_file(path: str | Path) -> Page:
    """The page of any of nanorom's files; raises FileError."""
    kind = stored.kind_of(path)
    page: Page = stored.call(kind.page, stored.call(kind.load, path), Path(path))
    return page


def _title(path: Path) -> str:
    path = path.resolve()
    return f"nanorom: {path.parent.name}/{path.name}"


def _lead(model: ReducedModel) -> str:
    lowest = with_unit(float(model.frequency[0]), "Hz", 6)
    method = model.method or "unknown"
    return f"{text.counted(model.size, 'mode')}, {method} reduction, lowest frequency {lowest}"
