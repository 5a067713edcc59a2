"""Responses held against the film: what is chosen, estimated, solved for, kept and drawn."""

import numpy as np
import pytest

import nanorom
from nanorom.continuation.diagrams.selection import of_level
from nanorom.errors import SceneError
from nanorom.results.verified import Verified
from nanorom.verification import compare
from nanorom.verification.assemble import rungs
from nanorom.verification.newton import NoOrbitError
from tests.verification.conftest import drum

POINTS = 6
TOO_SMALL, TOO_LARGE = 3.0, 30.0  # factors by which an estimate may be wrong
LINEAR = 1e-5  # of a multiplier: what a drive of a thousandth of a Pa adds is far below
FEW_NAMED = 7  # modes that pressure moves: of the first 14 of a drum there are fewer, of 42 more
SAME_FILM = 1e-5  # of the two meshes, which are made for 14 and for 42 modes
ONLY_BELOW = 0.1  # of the errors that an estimate is held to
FEW = 1e-6  # errors below are those of the orbits of the model


@pytest.fixture(scope="module")
def pressed():
    """A drum with two modes under pressure, at two levels."""
    scene = drum(
        [1, 6],
        tension=(0.3, 0.3),
        quality=100.0,
        drive=nanorom.Drive([20.0, 40.0]),
        sweep=nanorom.Sweep("0.95 f1", "1.3 f1"),
    )
    model = nanorom.reduce(scene)
    response = nanorom.respond(model, scene.drive, scene.sweep, processes=1)
    return scene, response


@pytest.fixture(scope="module")
def verified(pressed):
    scene, response = pressed
    return nanorom.verify(scene, response, level=2, points=POINTS)


def test_points_are_special_ones_and_others_along_the_branches(pressed):
    _, response = pressed
    diagram = response.diagrams[1]
    chosen = of_level(1, diagram, POINTS)
    special = [point for point in chosen if point.type != "-"]
    assert len(chosen) == POINTS
    assert len(special) == min(len(diagram.special_points), POINTS // 2)
    assert len({point.orbit.omega for point in chosen}) == POINTS


def test_film_s_orbits_are_found_and_the_estimate_is_near_their_error(verified):
    assert len(verified) == POINTS
    assert verified.solved.all()
    assert (verified.residual <= compare.VERIFIED).all()
    error = np.abs(verified.error)
    plain = np.array([kind != "LP" for kind in verified.type]) & (error < ONLY_BELOW)
    plain &= (error > FEW) & (verified.omega_full == verified.omega)
    assert plain.any()
    ratio = verified.estimate[plain] / error[plain]
    assert (ratio > 1 / TOO_SMALL).all()
    assert (ratio < TOO_LARGE).all()
    folds = [row for row, kind in enumerate(verified.type) if kind == "LP"]
    assert folds
    shift, told = np.abs(verified.error_omega[folds]), np.abs(verified.estimate_omega[folds])
    assert (told > (shift - FEW) / TOO_SMALL).all()
    assert (told < TOO_LARGE * (shift + FEW)).all()


def test_estimates_are_to_be_had_without_the_film_s_orbits(pressed, verified):
    scene, response = pressed
    alone = nanorom.verify(scene, response, level=2, points=POINTS, solve=False)
    assert not alone.solved.any()
    assert alone.estimate == pytest.approx(verified.estimate, rel=1e-6)
    assert "none of them solved for" in alone.text()


def test_search_in_vain_says_how_far_it_came(pressed, monkeypatch):
    scene, response = pressed
    ends = iter([0.5, 0.25, 0.125, 0.125])

    def correct(*_):
        raise NoOrbitError(next(ends), 7)

    monkeypatch.setattr(compare, "correct", correct)
    told = nanorom.verify(scene, response, level=2, points=2, more=8)
    assert not told.solved.any()
    assert max(told.left) <= 0.5
    assert min(told.left) == 0.125
    assert f"2 not found: the search ended at a residual of 1e-01 to {max(told.left):.0e}" in (
        told.text()
    )


def test_film_s_own_orbits_have_multipliers_and_small_ones_decay_as_their_slowest_mode(pressed):
    scene, _ = pressed
    scene = scene.with_(drive=nanorom.Drive([1e-3]), sweep=nanorom.Sweep("1.2 f1", "1.3 f1"))
    response = nanorom.respond(nanorom.reduce(scene), scene.drive, scene.sweep, processes=1)
    small = nanorom.verify(scene, response, points=2)
    periods = 2 * np.pi * small.period_multiple / small.omega
    decay = np.exp(-np.pi * small.frequency[0] * periods / scene.damping.quality_factor[0])
    assert small.multiplier_film == pytest.approx(decay, abs=LINEAR)
    assert small.multiplier_model == pytest.approx(decay, abs=LINEAR)
    assert "alone" not in small.text()


def test_modes_outside_make_an_orbit_of_the_film_unstable_that_is_stable_in_the_model():
    """Tension modulated at twice f11: its threshold 2 k/(Q |P|) is closed, f01 does not see it."""
    around = {"drive": nanorom.Drive(1.0), "sweep": nanorom.Sweep("3 f1", "3.4 f1")}
    at_rest = drum(3, tension=(0.3, 0.3), quality=100.0, **around)
    both = nanorom.reduce(at_rest)
    modulated = abs(both.parametric["tension"][1, 1])
    threshold = 2 * both.stiffness[1, 1] / (100.0 * modulated)
    twice = 2 * both.frequency[1]
    for level, stable in ((0.9, True), (1.1, False)):
        scene = at_rest.with_(
            modes=1,
            drive=nanorom.Drive([1e-3], [level * threshold]),
            sweep=nanorom.Sweep(0.9999 * twice, 1.0001 * twice),
        )
        found = nanorom.verify(scene, points=1)
        assert (found.multiplier_model < 1).all()
        assert (found.multiplier_film < 1).all() == stable
        assert ("1 stable in the model alone" in found.text()) is not stable


def test_orbits_that_few_modes_do_not_lead_to_are_found_with_more(pressed, verified, monkeypatch):
    """The search goes on from the orbit of the modes before, and the table says how many led."""
    scene, response = pressed
    whole, starts = compare.correct, []

    def correct(model, x, rate, border, *given):
        starts.append((model.size, float(model.equations.residual(x, rate)[0].std())))
        if model.size < FEW_NAMED:
            raise NoOrbitError(0.5, 1)
        return whole(model, x, rate, border, *given)

    monkeypatch.setattr(compare, "correct", correct)
    again = nanorom.verify(scene, response, level=2, points=POINTS)
    assert again.solved.all()
    first = scene.modes.highest + rungs(scene)[0]
    assert (again.named == scene.modes.highest + rungs(scene)[1]).all()
    assert set(verified.outside_label) < set(again.outside_label)
    assert f"{POINTS} of them" not in again.text()  # all of them: there is nothing to set apart
    assert (verified.named == first).all()
    plain = verified.omega_full == verified.omega
    assert again.full[plain] == pytest.approx(verified.full[plain], rel=SAME_FILM)
    assert again.omega_full == pytest.approx(verified.omega_full, rel=SAME_FILM)
    assert any(size < FEW_NAMED for size, _ in starts)


@pytest.mark.parametrize(
    ("modes", "named"), [(1, [9, 27, 72]), (11, [22, 66]), (20, [40, 72]), (40, [60]), (100, [100])]
)
def test_more_modes_are_tried_within_bounds(modes, named):
    tried = rungs(drum(modes))
    assert [modes + more for more in tried] == named


def test_table_is_the_same_from_its_file_and_can_be_drawn(verified, tmp_path):
    from nanorom.files import stored
    from nanorom.plots import verified_figure

    path = tmp_path / "verified.h5"
    verified.save(path)
    again = stored.load(path)
    assert isinstance(again, Verified)
    assert np.array_equal(again.full, verified.full)
    assert again.type == verified.type
    assert again.text() == verified.text()
    figure = verified_figure(again, tmp_path / "verified.png")
    assert len(figure.axes) == 2
    assert (tmp_path / "verified.png").stat().st_size > 0


def test_response_of_other_modes_is_refused(pressed):
    _, response = pressed
    with pytest.raises(SceneError, match="level"):
        nanorom.verify(pressed[0], response, level=3)
