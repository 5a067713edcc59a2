"""Responses of a model: levels in order, sound files, and levels that are not computed again."""

import attrs
import h5py
import numpy as np
import pytest

from nanorom.continuation import Unexplored, explore_each
from nanorom.errors import FileError, ModelError, SceneError
from nanorom.plots.response import response_figure
from nanorom.report.summary import of_response
from nanorom.report.text import response_text
from nanorom.results.respond import respond
from nanorom.results.response import Response
from nanorom.rom.model import ReducedModel
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Damping, Sweep

FIRST_ORDER = 2e-3  # relative error of first-order perturbation at these amplitudes
NEAR_PEAK = 2e-2  # relative; the fold lies a little below the highest amplitude


@pytest.fixture(scope="module")
def duffing():
    """One mode with unit mass and frequency: q'' + 0.01 q' + q + q^3 = F cos(w t)."""
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
    )


@pytest.fixture(scope="module")
def response(duffing):
    return respond(duffing, Drive([2e-3, 4e-3]), Sweep("0.9 f1", "1.2 f1"))


def test_levels_are_followed_in_their_order(response):
    assert [diagram.direct for diagram in response.diagrams] == [2e-3, 4e-3]
    peaks = [diagram.branches[0].amplitude.max() for diagram in response.diagrams]
    assert peaks[0] < peaks[1]


def test_fold_lies_at_the_peak_of_the_duffing_backbone(response):
    # w^2 = 1 + 3/4 a^2 with the peak amplitude a = F/(c w), to first order
    for level, diagram in zip((2e-3, 4e-3), response.diagrams):
        top = max((p for p in diagram.special_points if p.type == "LP"), key=lambda p: p.omega)
        amplitude = level / (0.01 * top.omega)
        assert top.amplitude[0] == pytest.approx(amplitude, rel=NEAR_PEAK)
        assert top.omega == pytest.approx(np.sqrt(1 + 0.75 * amplitude**2), rel=FIRST_ORDER)


def test_damping_of_the_sweep_replaces_that_of_the_model(duffing):
    sweep = Sweep("0.9 f1", "1.1 f1")
    broad = respond(duffing, Drive(1e-6), sweep, Damping(10)).diagrams[0]
    assert broad.branches[0].amplitude.max() == pytest.approx(1e-5, rel=0.01)  # F Q / k


def test_parametric_drive_doubles_the_period_at_twice_the_frequency(duffing):
    # q'' + c q' + (1 + P cos w t) q = 0 loses stability at w = 2 where P > 2 / Q = 0.02
    drive = Drive([1e-5, 1e-5], [0.015, 0.03])
    closed, opened = respond(duffing, drive, Sweep("1.9 f1", "2.1 f1")).diagrams
    assert not [p for p in closed.special_points if p.type == "PD"]
    assert len([p for p in opened.special_points if p.type == "PD"]) == 2


def test_progress_counts_the_levels(duffing):
    told = []
    respond(
        duffing,
        Drive([1e-6, 2e-6]),
        Sweep("0.99 f1", "1.01 f1"),
        progress=lambda *state: told.append(state),
    )
    levels = [each for each in told if each[0] == "drive levels"]
    assert levels == [("drive levels", done, 2) for done in (0, 1, 2)]


def test_missing_pattern_and_empty_range_are_named(duffing):
    with pytest.raises(SceneError, match=r"sweep\.to: found 0\.1"):
        respond(duffing, Drive(1.0), Sweep("0.9 f1", "0.1 Hz"))
    with pytest.raises(ModelError, match="drive: the model has no pattern 'pressure'"):
        respond(duffing.select([1]).__class__(**bare(duffing)), Drive(1.0), Sweep(1, 2))


def bare(model):
    names = "frequency mass label number stiffness damping quadratic cubic".split()
    return {name: getattr(model, name) for name in names}


def test_round_trip_is_exact_to_the_last_bit(tmp_path, response):
    response.save(tmp_path / "response.h5")
    loaded = Response.load(tmp_path / "response.h5")
    assert (loaded.drive, loaded.sweep, loaded.label) == (
        response.drive,
        response.sweep,
        response.label,
    )
    assert np.array_equal(loaded.frequency, response.frequency)
    for old, new in zip(response.diagrams, loaded.diagrams, strict=True):
        assert (old.direct, old.parametric) == (new.direct, new.parametric)
        for a, b in zip(old.branches, new.branches, strict=True):
            for name in ("omega", "amplitude", "stable", "multipliers"):
                assert np.array_equal(getattr(a, name), getattr(b, name)), name
            for name in ("parent", "origin", "period_multiple", "ending"):
                assert getattr(a, name) == getattr(b, name)
            assert all(map(np.array_equal, a.coefficients, b.coefficients))
        for p, q in zip(old.special_points, new.special_points, strict=True):
            for name in ("type", "omega", "branch", "period_multiple"):
                assert getattr(p, name) == getattr(q, name)
            for name in ("amplitude", "multipliers", "state", "coefficients"):
                assert np.array_equal(getattr(p, name), getattr(q, name)), name


def test_levels_in_a_file_are_not_computed_again(tmp_path, duffing, monkeypatch):
    path, sweep = tmp_path / "response.h5", Sweep("0.9 f1", "1.1 f1")
    whole = respond(duffing, Drive([2e-3, 4e-3, 6e-3]), sweep, path=path)
    with h5py.File(path, "r+") as file:
        del file["level/1"]
    assert Response.load(path).drive.direct == (2e-3, 6e-3)
    asked = []

    def counted(system, omega, levels, *others, **options):
        asked.extend(levels)
        return explore_each(system, omega, levels, *others, **options)

    monkeypatch.setattr("nanorom.results.respond.explore_each", counted)
    again = respond(duffing, Drive([2e-3, 4e-3, 6e-3]), sweep, path=path)
    assert asked == [(4e-3, 0.0)]
    for a, b in zip(whole.diagrams, again.diagrams, strict=True):
        assert np.array_equal(a.branches[0].omega, b.branches[0].omega)
    # another question is another result
    respond(duffing, Drive([2e-3]), sweep, path=path)
    respond(duffing, Drive([2e-3]), sweep, Damping(50), path=path)
    respond(duffing, Drive([2e-3]), Sweep("0.9 f1", "1.11 f1"), path=path)
    assert asked[1:] == [(2e-3, 0.0)] * 3
    assert len(Response.load(path).diagrams) == 1


def remove(name):
    return lambda file: file.__delitem__(name)


def assign(name, value):
    def change(file):
        del file[name]
        file[name] = value

    return change


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (remove("level"), "level: missing"),
        (remove("level/1/branch/0/omega"), "omega: missing"),
        (assign("level/0/branch/0/omega", [np.nan]), "omega: contains NaN"),
        (assign("level/0/branch/0/amplitude", [[1.0]]), "amplitude: found shape"),
        (assign("level/0/branch/0/rows", [1, 2]), "rows: found shape"),
        (assign("level/0/branch/0/coefficients", [[1.0]]), "coefficients: found shape"),
        (lambda f: f["level/0"].attrs.__setitem__("branches", 10**9), "branches: found"),
        (lambda f: f["level/0/special_points/branch"].__setitem__(0, 99), "lies on no branch"),
        (lambda f: f["level/0/special_points/type"].__setitem__(0, "XX"), "found type 'XX'"),
        (lambda f: f.attrs.__setitem__("excitation", "[drive"), "not valid TOML"),
        (lambda f: f.attrs.__delitem__("excitation"), "damaged"),
        (lambda f: f.attrs.__setitem__("format", "nanorom-rom"), "expected 'nanorom-response'"),
    ],
)
def test_unsound_file_gives_one_line_that_names_the_cause(tmp_path, response, damage, message):
    path = tmp_path / "response.h5"
    response.save(path)
    with h5py.File(path, "r+") as file:
        damage(file)
    with pytest.raises(FileError, match=message) as caught:
        Response.load(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


def test_what_was_not_explored_is_kept_and_told(duffing, tmp_path):
    found = respond(duffing, Drive(4e-3), Sweep("0.9 f1", "1.2 f1"))
    left = Unexplored("branch", 1.1, "it could not be started")
    diagram = attrs.evolve(found.diagrams[0], unexplored=[left])
    response = attrs.evolve(found, diagrams=(diagram,))
    response.save(tmp_path / "response.h5")
    read = Response.load(tmp_path / "response.h5")
    assert read.diagrams[0].unexplored == [left]
    text = response_text(read)
    assert "1 not explored" in text
    assert left.why in text
    assert of_response(read)["response"][0]["unexplored"] == [
        {"kind": left.kind, "frequency_Hz": left.omega / (2 * np.pi), "why": left.why}
    ]
    figure = response_figure(read)
    crosses = [line for line in figure.axes[0].lines if line.get_marker() == "x"]
    assert len(crosses) == 1
    assert "not explored" in [text.get_text() for text in figure.axes[0].get_legend().get_texts()]


def test_a_file_of_before_says_nothing_of_what_was_not_explored(response, tmp_path):
    response.save(tmp_path / "response.h5")
    with h5py.File(tmp_path / "response.h5", "r+") as file:
        for level in file["level"].values():
            del level["unexplored"]
    assert [d.unexplored for d in Response.load(tmp_path / "response.h5").diagrams] == [[], []]


def test_families_and_double_points_are_kept(tmp_path):
    one = np.eye(2)
    isotropic = np.einsum("rj,kl->rjkl", one, one) + np.einsum("rk,jl->rjkl", one, one)
    pair = ReducedModel(
        frequency=[1 / (2 * np.pi)] * 2,
        mass=[1.0, 1.0],
        label=["f11c", "f11s"],
        number=[1, 2],
        stiffness=one,
        damping=0.01 * one,
        quadratic=np.zeros((2, 2, 2)),
        cubic=(isotropic + np.einsum("rl,jk->rjkl", one, one)) / 3,
        drive={"pressure": [0.0, 0.0]},
        parametric={"tension": -one},
    )
    respond(pair, Drive(0.0, 0.05), Sweep("1.9 f1", "2.1 f1")).save(tmp_path / "response.h5")
    (diagram,) = Response.load(tmp_path / "response.h5").diagrams
    assert [point.multiplicity for point in diagram.points("PD")] == [2, 2]
    assert [branch.family for branch in diagram.branches] == [False, True, True]
    assert [branch.wave for branch in diagram.branches] == ["", "standing", "standing"]
