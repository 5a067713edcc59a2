"""Modes chosen by the response, and what modes that are left out are told to make of it."""

import attrs
import numpy as np
import pytest

import nanorom
from nanorom.errors import AccuracyWarning, SceneError
from nanorom.report.text import model_text, response_text
from nanorom.results.response import Response
from nanorom.verification import modes
from tests.verification.conftest import drum

TOLERANCE = 1e-3
TOO_SMALL = 3.0  # factor by which an estimate may be below the true error
NEGLIGIBLE = 1e-5  # errors below are not compared
SECTIONS = {
    "tension": (0.3, 0.3),
    "drive": nanorom.Drive([10.0, 15.0]),
    "sweep": nanorom.Sweep("0.9 f1", "1.3 f1"),
}


def followed(scene):
    model = nanorom.reduce(scene)
    return model, nanorom.respond(model, scene.drive, scene.sweep, processes=1)


@pytest.fixture(scope="module")
def few():
    return followed(drum([1], **SECTIONS))


@pytest.fixture(scope="module")
def chosen():
    scene = drum("auto", **SECTIONS)
    return followed(scene.with_(accuracy=attrs.evolve(scene.accuracy, response=TOLERANCE)))


@pytest.fixture(scope="module")
def many():
    """Twice as many modes as are chosen, of the classes that the pressure drives."""
    return followed(drum([1, 4, 6, 11, 13, 17, 24, 26, 30, 31], **SECTIONS))


def differences(response, other):
    """Relative differences of frequency and amplitude of each point from the nearest of another."""
    for diagram, rest in zip(response.diagrams, other.diagrams):
        for point in diagram.special_points:
            same = [p for p in rest.special_points if p.type == point.type]
            near = min(same, key=lambda p: abs(p.omega - point.omega))
            by_amplitude = point.amplitude.max() / near.amplitude.max() - 1
            yield point, abs(near.omega / point.omega - 1), abs(by_amplitude)


def test_every_special_point_of_chosen_modes_is_that_of_twice_as_many(chosen, many):
    model, response = chosen
    assert 1 < model.size <= 7
    assert set(model.diagnostics["chosen"]) == set(model.label)
    assert model.diagnostics["chosen"]["f01"] == "driven"
    assert model.diagnostics["error_response"] < TOLERANCE
    assert response.error < TOLERANCE
    for _, omega, amplitude in differences(response, many[1]):
        assert max(omega, amplitude) < TOLERANCE


def test_scene_of_chosen_modes_is_that_of_a_selection(chosen):
    model, _ = chosen
    scene = nanorom.Scene.from_toml(model.scene)
    assert scene.modes.numbers == tuple(model.number)
    again = nanorom.reduce(scene)
    assert again.cubic == pytest.approx(model.cubic, rel=1e-5, abs=1e-6 * np.abs(model.cubic).max())


def test_estimates_of_too_few_modes_are_near_their_errors_and_name_what_is_missing(few, many):
    _, response = few
    worst = 0.0
    for level, diagram in enumerate(response.diagrams):
        for point in diagram.special_points:
            row = response.estimated(level, point)
            assert row is not None
            table = response.estimates[level]
            assert table.making(row, response.outside_label)[0][0] == "f02"
            worst = max(worst, table.error[row])
    true = max(amplitude for _, _, amplitude in differences(response, many[1]))
    assert true > TOLERANCE
    assert true / TOO_SMALL < worst < TOO_SMALL * true
    assert "f02" in response_text(response)


def test_estimates_survive_their_file_and_are_drawn_as_a_band(few, tmp_path):
    from nanorom.plots import response_figure

    _, response = few
    response.save(tmp_path / "response.h5")
    again = Response.load(tmp_path / "response.h5")
    assert again.outside_label == response.outside_label
    for table, read in zip(response.estimates, again.estimates):
        assert np.array_equal(table.omega_change, read.omega_change)
        assert np.array_equal(table.share, read.share)
    figure = response_figure(again, tmp_path / "response.png")
    assert len(figure.axes[0].patches) == len(again.estimates)


def test_modes_are_chosen_for_a_response_alone():
    with pytest.raises(SceneError, match=r"modes.count: found auto without \[drive\]"):
        drum("auto")
    with pytest.raises(SceneError, match="modes.count: found 'all'"):
        drum("all")


def test_a_larger_model_that_cannot_be_had_is_told():
    """Of a block as thick as this, the plane follows no mode but the first statically."""
    scene = nanorom.Scene(
        geometry=nanorom.Disc(radius=1e-6),
        plate=nanorom.Plate(thickness=7e-7, model="plate"),
        material=nanorom.Material(410e9, 0.16, 2267),
        modes=nanorom.Modes(1),
        damping=nanorom.Damping(100),
        drive=nanorom.Drive(1.0),
        sweep=nanorom.Sweep("0.9 f1", "1.1 f1"),
        accuracy=nanorom.Accuracy(degree=4, mesh_size=5e-7),
    )
    with pytest.warns(AccuracyWarning, match="errors of the response are not estimated: in-plane"):
        model = nanorom.reduce(scene)
    assert model.larger is None
    assert "not_estimated" in model_text(model)


@pytest.mark.parametrize(
    ("asked", "looked_at"),
    [(3, 11), (95, 100), ([1, 2, 150], 100), (100, None)],
)
def test_no_larger_model_has_more_modes_than_a_model_may(asked, looked_at, monkeypatch):
    """Ninety modes and more could not be reduced once, for there are none a hundred and two."""
    scene, model = drum(asked, **SECTIONS), nanorom.reduce(drum(1))
    seen = []

    def reduced(wide, **_):
        seen.append(wide.modes.numbers)
        raise ValueError("as it is")

    monkeypatch.setattr(modes, "reduce_scene", reduced)
    told = "no model has more than 100" if looked_at is None else "as it is"
    with pytest.warns(AccuracyWarning, match=told):
        modes.with_larger(scene, model)
    if looked_at:
        assert len(seen[0]) == looked_at
        assert set(scene.modes.numbers) < set(seen[0])


STRING = nanorom.Scene(
    geometry=nanorom.String(300e-6, 3e-6),
    plate=nanorom.Plate(thickness=100e-9),
    material=nanorom.Material(250e9, 0.23, 3100.0),
    tension=nanorom.Tension(80.0, 0.0),
    support=nanorom.Support({"left": "clamped", "right": "clamped"}),
    modes=nanorom.Modes("auto"),
    accuracy=nanorom.Accuracy(1e-3, response=TOLERANCE),
    damping=nanorom.Damping(1e4),
    drive=nanorom.Drive([0.4]),
    sweep=nanorom.Sweep("0.9996 f1", "1.0014 f1"),
)


def test_modes_of_a_string_are_chosen_among_those_that_do_not_bend_it_sideways():
    """Its twist beside its bending would, below the modes that the pressure moves."""
    model, response = followed(STRING)
    assert set(model.label) <= {"(1,0)", "(3,0)", "(5,0)", "(7,0)"}
    assert model.larger is not None
    assert "(3,0)" in model.larger.label
    assert not any("1)" in label for label in model.larger.label)
    assert 0 < response.error < TOLERANCE
    _, more = followed(STRING.with_(modes=nanorom.Modes(select=[1, 3, 5, 7])))
    for _, omega, amplitude in differences(response, more):
        assert max(omega, amplitude) < TOLERANCE
