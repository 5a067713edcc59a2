"""Designs are the exact ones of membranes and drums; spreads give exact yields; runs go on."""

import csv

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import jn_zeros, ndtr

import nanorom
from nanorom.cli.main import main
from nanorom.devices import catalogue as room
from nanorom.devices import workers
from nanorom.devices.wish import Wish
from nanorom.errors import NanoromError
from nanorom.exact.drum import plate_roots
from nanorom.files import stored
from nanorom.report.design import design_text
from tests.devices.membranes import MEMBRANE
from tests.devices.strings import STRING

MET = 1e-6  # of a design's conditions
J01 = jn_zeros(0, 1)[0]
RADIUS, THICKNESS, DENSITY, TENSION = 2.5e-6, 1e-8, 2267.0, 0.3
TARGET = 12e6  # Hz
WIDE = {"plate.thickness": {"from": "5 nm", "to": "50 nm", "spacing": "log"}}
WIDE_TENSION = {"tension.value": {"from": "0.1 N/m", "to": "1 N/m"}}


@pytest.fixture(scope="module", autouse=True)
def closed_forms():
    """Devices are membranes in closed form, so that searches take no time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(workers, "MODULE", "tests.devices.membranes")
        yield patch


@pytest.fixture(scope="module")
def membrane(tmp_path_factory, closed_forms):
    path = tmp_path_factory.mktemp("design") / "membrane.toml"
    path.write_text(MEMBRANE)
    return path


def exact_frequency(tension=TENSION, thickness=THICKNESS):
    return J01 / (2 * np.pi * RADIUS) * np.sqrt(tension / (DENSITY * thickness))


@pytest.fixture(scope="module")
def tuned(membrane, tmp_path_factory):
    path = tmp_path_factory.mktemp("tuned") / "design.h5"
    found = nanorom.design(
        membrane, WIDE_TENSION, conditions="f1 = 12 MHz +- 200 kHz", of="m1", starts=2,
        spread={"tension.value": "5 %", "plate.thickness": "2 %"}, samples=256, path=path,
        processes=1,
    )  # fmt: skip
    return found, path


def test_a_membrane_is_tuned_to_a_frequency(tuned):
    found, _ = tuned
    exact = TENSION * (TARGET / exact_frequency()) ** 2
    assert found["f1"] == pytest.approx(TARGET, rel=MET)
    assert found["tension.value"] == pytest.approx(exact, rel=2 * MET)
    assert found.reached.all() and found.exact.all()
    assert found.slope[found.of.index("f1"), 0] == pytest.approx(0.5 * TARGET / exact, rel=1e-5)
    best = nanorom.Scene.from_toml(found.best)
    assert best.tension.x == found["tension.value"]


def test_spreads_give_the_deviations_and_yields_of_closed_forms(tuned):
    """f goes with the root of T / h: 2.5 % and 1 %, together those of a normal distribution."""
    found, _ = tuned
    wide = np.hypot(0.05, 0.02) / 2 * TARGET
    row = found.of.index("f1")
    assert found.deviation[row] == pytest.approx(wide, rel=1e-5)
    assert np.abs(found.share[row]) == pytest.approx([0.025 * TARGET, 0.01 * TARGET], rel=1e-5)
    share = 2 * ndtr(2e5 / wide) - 1
    assert found.made["linear"] == pytest.approx(share, abs=0.01)
    off = np.sqrt(share * (1 - share) / 256)
    assert found.made["sampled"] == pytest.approx(share, abs=4 * off)


def test_files_texts_and_pictures_have_the_design(tuned, tmp_path, capsys):
    found, path = tuned
    again = stored.load(path)
    assert again.found == found.found and again.wish == found.wish
    np.testing.assert_array_equal(again.value, found.value)
    assert design_text(again) == design_text(found)
    assert main(["info", str(path)]) == 0
    assert "f1 = 12 MHz +- 200 kHz" in capsys.readouterr().out
    assert main(["plot", str(path), "-o", str(tmp_path)]) == 0
    assert (tmp_path / "design.png").stat().st_size > 5000
    assert main(["view", str(path), "-o", str(tmp_path / "page.html"), "--no-browser"]) == 0
    found.save_csv(tmp_path / "design.csv")
    rows = list(csv.reader((tmp_path / "design.csv").open(encoding="utf-8")))
    assert rows[0] == ["search", "tension.value (N/m)", "f1 (Hz)", "m1 (kg)", "violation"]
    assert len(rows) == len(found.search) + 1
    assert not path.with_name("design.h5.partial").exists()


class Enough(BaseException):
    pass


def test_a_design_that_was_stopped_goes_on_to_the_same_device(membrane, tmp_path, monkeypatch):
    path = tmp_path / "design.h5"
    given = {"conditions": "f1 = 12 MHz", "of": "m1", "starts": 1, "processes": 1, "path": path}
    ask = room.Worker.ask
    asked = []

    def counted(self, job, seconds):
        asked.append(job["scene"])
        if len(asked) == 4:
            raise Enough
        return ask(self, job, seconds)

    monkeypatch.setattr(room.Worker, "ask", counted)
    with pytest.raises(Enough):
        nanorom.design(membrane, WIDE_TENSION, **given)
    assert not path.exists()
    first = list(asked)
    found = nanorom.design(membrane, WIDE_TENSION, **given)
    assert all(scene not in first[:3] for scene in asked[4:])  # none of them is computed again
    again = nanorom.design(membrane, WIDE_TENSION, **given | {"path": None})
    assert found["tension.value"] == again["tension.value"]


def test_a_front_is_the_exact_one(membrane):
    """f and m both large: at the largest tension f^2 m is one constant, whatever the thickness."""
    vary = {**WIDE, **WIDE_TENSION}
    found = nanorom.design(membrane, vary, maximize=["f1", "m1"], starts=2, points=5, processes=1)
    front = found.front
    thickness, tension = found.ended_setting[front].T
    f, m = found.ended_value[front].T
    assert front.sum() >= 5
    np.testing.assert_allclose(tension, 1.0, rtol=MET)
    np.testing.assert_allclose(f, exact_frequency(1.0, thickness), rtol=MET)
    np.testing.assert_allclose(f**2 * m, (f**2 * m)[0], rtol=MET)
    assert thickness.min() == pytest.approx(5e-9) and thickness.max() == pytest.approx(50e-9)
    gaps = np.diff(np.sort(m)) / np.ptp(m)
    assert gaps.max() < 0.3  # evenly spread by the second objective


def exact_kappa():
    """T R^2/D of the drum whose f11 is 2 f01: between a membrane's 1.593 and a plate's 2.08."""

    def gap(kappa):
        lowest = {p: omega for omega, p, _ in reversed(plate_roots(kappa, 6))}
        return lowest[1] / lowest[0] - 2

    assert gap(0.0) > 0.08 and gap(1e4) < -0.35
    return brentq(gap, 0.0, 100.0, xtol=1e-10)


def test_the_drum_whose_second_mode_is_at_twice_the_first_is_the_exact_one(monkeypatch):
    monkeypatch.setattr(workers, "MODULE", "nanorom.devices.worker")
    nu, modulus = 0.16, 410e9
    h = (TENSION * RADIUS**2 / exact_kappa() * 12 * (1 - nu**2) / modulus) ** (1 / 3)
    scene = nanorom.Scene.from_toml(MEMBRANE.replace("membrane", "plate")).with_(
        modes=2, tolerance=1e-6
    )
    vary = {"plate.thickness": {"from": "10 nm", "to": "100 nm", "spacing": "log"}}
    found = nanorom.design(
        scene, vary, conditions="f(f11c) / f(f01) = 2", starts=1, processes=1,
        spread={"plate.thickness": "1 %"},
    )  # fmt: skip
    assert found["plate.thickness"] == pytest.approx(h, rel=1e-5)
    assert found.finer[0] == pytest.approx(2, rel=1e-6)
    step = 1e-4  # by kappa, as h^-3
    ends = [exact_kappa() * np.exp(-3 * side * step) for side in (1, -1)]
    high, low = ({p: w for w, p, _ in reversed(plate_roots(k, 6))} for k in ends)
    slope = (high[1] / high[0] - low[1] / low[0]) / (2 * step)
    assert found.deviation[0] == pytest.approx(0.01 * slope, rel=1e-3)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({}, "minimize, maximize: found 0 formulas"),
        ({"minimize": ["f1", "m1", "k1"]}, "found 3 formulas"),
        ({"minimize": "f9"}, "f9: found 9"),
        ({"minimize": "2"}, "no quantity"),
        ({"minimize": "f1", "conditions": "f1 = two"}, r"conditions\[1\]"),
        ({"minimize": "f1", "spread": {"plate.size": "3 %"}}, "spread.plate.size"),
        ({"minimize": "f1", "spread": {"plate.thickness": "3 kg"}}, "one dimension"),
        ({"minimize": "f1", "starts": 0}, "starts: found 0"),
        ({"minimize": "f1", "vary": {"plate.thickness": ["5 nm"]}}, "vary.plate.thickness"),
        ({"minimize": "f1", "vary": {"plate.thickness": "5 nm +- 1 %"}}, "vary.plate.thickness"),
        ({"minimize": "f1", "vary": {"plate.thicknes": {"from": 1, "to": 2}}}, "unknown key"),
        ({"minimize": "f1", "vary": {"plate.thickness": {"from": 2, "to": 1}}}, "from, to"),
    ],
)
def test_wishes_that_make_no_sense_are_told_in_one_line(membrane, given, told):
    with pytest.raises(NanoromError, match=told) as error:
        Wish.of_table(membrane, {"vary": WIDE, **given})
    assert "\n" not in str(error.value)


def test_what_no_device_meets_is_told_with_the_nearest(membrane):
    found = nanorom.design(
        membrane, WIDE_TENSION, conditions="f1 >= 1 GHz", starts=1, processes=1, evaluations=4
    )
    assert found.chosen == -1 and not found.reached.any()
    assert "no device" in design_text(found) and found.remark[0]
    with pytest.raises(NanoromError, match="no device was found"):
        found["f1"]


BENDING = 1e-5  # of the closed form without it: (D/T)^1/2/L is 5e-4


def string_coefficient(spring):
    """E h w/(2 L) (int phi'^2)^2 of a string that a spring holds at one end, max |phi| = 1."""
    length, stretch = 1e-4, 250e9 * 5e-9 * 2e-6
    kl = brentq(lambda x: spring * length * np.sin(x) + x * np.cos(x), np.pi / 2, np.pi)
    slopes = (kl / length) ** 2 * length * (0.5 + np.sin(2 * kl) / (4 * kl))
    return stretch / (2 * length) * slopes**2


def test_a_strings_duffing_coefficient_is_tuned_through_its_support(monkeypatch):
    """By differences of devices, which are told, to the closed form of the string."""
    monkeypatch.setattr(workers, "MODULE", "nanorom.devices.worker")
    wanted = string_coefficient(3e4)
    vary = {"support.edge.left.spring": {"from": "1e4 N/m^2", "to": "1e5 N/m^2", "spacing": "log"}}
    found = nanorom.design(
        nanorom.Scene.from_toml(STRING), vary, conditions=f"b111 = {float(wanted)!r}", starts=1,
        processes=1,
    )  # fmt: skip
    assert found["support.edge.left.spring"] == pytest.approx(3e4, rel=BENDING)
    assert found.finer[0] == pytest.approx(wanted, rel=1e-6)
    assert not found.exact.any() and "differences" in found.told
    step = 1e-4
    ends = [string_coefficient(3e4 * (1 + side * step)) for side in (1, -1)]
    assert found.slope[0, 0] == pytest.approx((ends[0] - ends[1]) / (6e4 * step), rel=1e-3)


def test_spreads_of_a_scene_are_taken_from_its_file_and_from_the_object(membrane, tmp_path):
    text = MEMBRANE.replace('"10 nm"', '"10 nm +- 3 %"')
    (tmp_path / "spread.toml").write_text(text)
    given = {"vary": WIDE_TENSION, "minimize": "f1"}
    for scene in (tmp_path / "spread.toml", nanorom.Scene.from_toml(text)):
        ((key, spread),) = Wish.of_table(scene, given).spread.items()
        assert key == "plate.thickness"
        assert (spread.mean, spread.deviation) == pytest.approx((1e-8, 3e-10))
    both = nanorom.Scene.from_toml(text.replace('"0.3 N/m"', '"0.3 N/m +- 5 %"'))
    with pytest.raises(NanoromError, match="spread: found tension.value"):
        Wish.of_table(both, given)
