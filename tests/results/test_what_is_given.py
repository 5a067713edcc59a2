"""A response takes what people give first, or says what to give instead."""

import attrs
import numpy as np
import pytest

from nanorom.errors import FileError, SceneError
from nanorom.plots import mode_gallery, response_figure
from nanorom.results.respond import respond
from nanorom.results.response import Response
from nanorom.rom.model import ReducedModel
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Damping, Sweep
from nanorom.scene.scene import Scene

QUESTION = """
[drive]
direct = [2e-3, 4e-3]
[sweep]
from = "0.95 f1"
to = "1.1 f1"
"""


@pytest.fixture(scope="module")
def duffing():
    """q'' + 0.01 q' + q + q^3 = F cos(w t), of a scene that asks for two levels."""
    return ReducedModel(
        frequency=[1 / (2 * np.pi)],
        mass=[1.0],
        label=["f01"],
        number=[1],
        stiffness=[[1.0]],
        damping=[[0.01]],
        quadratic=[[[0.0]]],
        cubic=[[[[1.0]]]],
        drive={"pressure": [1.0]},
        parametric={"tension": [[-1.0]]},
        scene=QUESTION,
    )


def ends(response):
    return [diagram.branches[0].amplitude[-1].tolist() for diagram in response.diagrams]


@pytest.fixture(scope="module")
def spelled_out(duffing):
    return respond(duffing, Drive([2e-3, 4e-3]), Sweep("0.95 f1", "1.1 f1"))


def test_a_model_is_asked_what_its_scene_asks_where_nothing_else_is_given(
    duffing, spelled_out, tmp_path
):
    duffing.save(tmp_path / "rom.h5")
    for model in (duffing, tmp_path / "rom.h5", str(tmp_path / "rom.h5")):
        assert ends(respond(model)) == ends(spelled_out)
    assert len(respond(duffing, 2e-3).diagrams) == 1
    with pytest.raises(SceneError, match=r"^drive: missing; give one, or a model whose scene has"):
        respond(attrs.evolve(duffing, scene=""), sweep=("0.95 f1", "1.1 f1"))


def test_levels_ends_and_quality_factor_stand_for_their_sections(duffing, spelled_out):
    short = respond(duffing, ["2 mPa", "4 mPa"], ("0.95 f1", "1.1 f1"))
    table = respond(duffing, {"direct": [2e-3, 4e-3]}, {"from": "0.95 f1", "to": "1.1 f1"})
    assert ends(short) == ends(table) == ends(spelled_out)
    damped = respond(duffing, "2 mPa", ("0.95 f1", "1.1 f1"), 50)
    assert ends(damped) == ends(
        respond(duffing, Drive(2e-3), Sweep("0.95 f1", "1.1 f1"), Damping(50))
    )


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (("5 V", ("0.9 f1", "1.1 f1")), r"^drive\.direct: found '5 V', of another dimension"),
        (("5 Pa", "0.9 f1"), r"^sweep: found '0.9 f1'; allowed: lowest and highest drive freq"),
        (("5 Pa", ("0.9 f1", "1.1 f1"), "much"), r"^damping\.quality_factor: found 'much'"),
        (("5 Pa", {"from": "0.9 f1"}), r"^sweep\.to: missing"),
    ],
)
def test_what_is_none_of_these_gets_one_line(duffing, given, message):
    with pytest.raises(SceneError, match=message):
        respond(duffing, *given)


def test_what_is_no_model_and_no_scene_is_told_what_to_give(duffing, spelled_out, tmp_path):
    spelled_out.save(tmp_path / "response.h5")
    with pytest.raises(FileError, match=r"response\.h5: found a response\.h5; expected a rom\.h5"):
        respond(tmp_path / "response.h5")
    with pytest.raises(FileError, match=r"^found a Response; allowed: a ReducedModel, or the name"):
        respond(spelled_out)
    with pytest.raises(SceneError, match=r"^scene: found ReducedModel; allowed: a Scene, its tab"):
        Scene.of(duffing)


def test_pictures_are_drawn_of_files_too(spelled_out, tmp_path):
    path = tmp_path / "response.h5"
    spelled_out.save(path)
    lines = [len(response_figure(given).axes[0].lines) for given in (path, Response.load(path))]
    assert lines[0] == lines[1]
    with pytest.raises(FileError, match=r"found a Response; mode_gallery draws a ReducedModel"):
        mode_gallery(path)


def test_coefficients_are_told_by_the_largest(make_model):
    model = make_model(4)
    told = repr(model.b(1))
    assert len(told) < 400
    assert told.endswith("... 12 smaller ones}")
    largest = max(model.b(1), key=lambda index: abs(model.b(1)[index]))
    assert f"{largest}: {model.b(1)[largest]:.6g}" in told


def test_one_mode_may_be_selected_by_its_name(make_model):
    model = make_model(3)
    name = model.label[1]
    assert model.select(name).label == model.select([name]).label == (name,)


def test_levels_are_told_by_what_drives():
    voltage = Drive(voltage=["50 mV", "100 mV"])
    assert voltage.names == voltage.told == ["50 mV", "100 mV"]
    both = Drive(["5 Pa", "10 Pa"], "2 mN/m")
    assert both.names == ["5 Pa + 2 mN/m", "10 Pa + 2 mN/m"]
    assert both.told[0] == "5 Pa direct, 2 mN/m parametric"
    assert Drive(["5 Pa", "10 Pa"]).names == ["5 Pa", "10 Pa"]
