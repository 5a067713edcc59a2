"""Every number that a panel of the live page shows is one of the file."""

import io
import re

import numpy as np
import pytest

from nanorom.report.viewer.listing import view
from nanorom.results.loadcurve import LoadCurve
from nanorom.results.verified import Verified
from nanorom.rom import motion
from tests.report import live
from tests.report.live import SINGLE, amount, click_point, facts, point_of

pytestmark = live.needs_chromium

SHOWN = {3: 5.1e-3, 4: 5.1e-4, 6: 5.1e-6, 8: 5.1e-8}  # relative, by the digits that are written
NUMBER = r"[-\d.e]+"


def told(browser, expression):
    """What the page says there, with plain minus signs."""
    return browser.evaluate(expression).replace("−", "-")


def test_facts_beside_the_motion_are_those_of_the_point(opened, response):
    found = click_point(opened, 1, 10)
    of, _, at = point_of(response, found)
    shown = facts(opened)
    assert shown["drive level"] == response.drive.names[found["level"]]
    branch = response.diagrams[found["level"]].branches[found["branch"]]
    assert shown["branch"] == f"{found['branch']}, point {at + 1} of {len(branch)}"
    assert shown["period"] == "that of the drive" and of.period_multiple == 1
    assert shown["the branch ends"] == branch.ending


def test_reading_of_the_diagram_is_that_of_the_point(opened, response):
    of, _, at = point_of(response, click_point(opened, 1, 10))
    assert at is not None
    reading = told(opened, "nanorom.response.note.textContent")
    hertz, metres = map(amount, re.findall(rf"({NUMBER} [kMG]?Hz), ({NUMBER} \w?m)", reading)[0])
    assert hertz == pytest.approx(of.frequency[at], rel=SHOWN[8])
    size = np.linalg.norm(of.amplitude[at])
    assert metres == pytest.approx(size, rel=SHOWN[6])


def test_multipliers_stand_on_the_circle_where_the_file_has_them(opened, response):
    of, _, at = point_of(response, click_point(opened, 1, 10))
    rows = opened.evaluate(
        "[...document.querySelectorAll('svg.circle circle title')].map((t) => "
        "[t.textContent, Number(t.parentNode.getAttribute('cx')), "
        "Number(t.parentNode.getAttribute('cy')), "
        "Number(t.closest('svg').querySelector('.unit').getAttribute('r'))])"
    )
    multipliers = of.multipliers[at]
    assert len(rows) == len(multipliers)
    for (text, x, y, unit), expected in zip(rows, multipliers):
        real, sign, imaginary, modulus = re.fullmatch(
            rf"({NUMBER}) ([-+]) ({NUMBER}) i, modulus ({NUMBER})", text.replace("−", "-")
        ).groups()
        number = float(real) + 1j * float(sign + imaginary)
        assert abs(number - expected) < SHOWN[6] * abs(expected)
        assert float(modulus) == pytest.approx(abs(expected), rel=SHOWN[6])
        if abs(expected) < 1.2:
            assert abs(x / unit - 1j * y / unit - expected) < 5 * SINGLE


def test_ends_of_the_colours_are_the_largest_deflection(opened, model, response):
    _, orbit, _ = point_of(response, click_point(opened, 1, 10))
    instants = np.arange(motion.INSTANTS) * orbit.period / motion.INSTANTS
    most = np.abs(motion.deflection(model, orbit, instants)).max()
    low, high = (told(opened, f"nanorom.film.ends[{i}].textContent") for i in (0, 1))
    assert amount(high) == pytest.approx(most, rel=SHOWN[4])
    assert low == f"-{high.split()[0]}"


def test_levels_and_their_branches_are_counted(opened, response):
    rows = opened.evaluate(
        "[...document.querySelectorAll('.switches summary')].map((row) => row.textContent.trim())"
    )
    for row, name, diagram in zip(rows, response.drive.names, response.diagrams, strict=True):
        count = len(diagram.branches)
        assert row == f"{name} · {count} {'branches' if count > 1 else 'branch'}"


def test_gallery_has_the_frequencies_of_the_modes(opened, model):
    tiles = opened.evaluate(
        "[...document.querySelectorAll('.gallery .tile')].map((tile) => "
        "[...tile.querySelectorAll('span, small')].map((part) => part.textContent))"
    )
    for (name, hertz), label, frequency in zip(tiles, model.label, model.frequency, strict=True):
        assert name == label
        assert amount(hertz) == pytest.approx(frequency, rel=SHOWN[6])


def test_table_of_special_points_is_that_of_the_file(opened, response):
    rows = opened.evaluate(
        "[...document.querySelectorAll('[data-rows=special-points] tbody tr')].map((row) => "
        "[...row.cells].map((cell) => cell.textContent.trim()))"
    )
    heads = opened.evaluate(
        "[...document.querySelectorAll('[data-rows=special-points] thead th')]"
        ".map((cell) => cell.innerText.trim().split(/\\s+/))"
    )
    units = [words[-1] for words in heads]
    points = [
        (number, point)
        for number, diagram in enumerate(response.diagrams, 1)
        for point in diagram.special_points
    ]
    assert len(points) > 0
    for row, (level, point) in zip(rows, points, strict=True):
        assert row[:2] == [str(level), point.type]
        assert amount(f"{row[2]} {units[2]}") == pytest.approx(point.frequency, rel=SHOWN[8])
        size = np.linalg.norm(point.amplitude)
        assert amount(f"{row[3]} {units[3]}") == pytest.approx(size, rel=SHOWN[6])
        assert row[4] == response.label[int(np.argmax(point.amplitude))]
        assert row[6] == str(point.branch)


def test_load_curve_tells_tension_and_cubic_coefficients(browser, tmp_path):
    load = np.linspace(0, 10, 5)
    frequency = np.column_stack([2e7 - 1e5 * load, 5e7 + 3e5 * load])
    cubic = np.column_stack([1e15 - 3e14 * load, 2e16 + 1e14 * load])
    frequency[-1] = cubic[-1] = np.nan
    curve = LoadCurve(
        "voltage", load, 1e-9 * load, 1.1e-9 * load, frequency, [10.0], None, ("f01", "f11c"),
        0.3 + 0.01 * load, cubic,
    )  # fmt: skip
    curve.save(tmp_path / "tuning.h5")
    browser.open(view(tmp_path / "tuning.h5"))
    browser.evaluate("nanorom.loads.read(2)")
    text = told(browser, "nanorom.loads.note.textContent")
    volts, metres, hertz, tension, coefficients = re.split("[:;] ", text)
    assert amount(volts.removeprefix("voltage ")) == load[2]
    assert amount(metres.removeprefix("deflection ")) == pytest.approx(curve.centre[2])
    assert amount(tension.removeprefix("tension ")) == pytest.approx(curve.tension[2])
    for r, name in enumerate(curve.names):
        found = re.search(rf"{name} ({NUMBER} \w+)", hertz)[1]
        assert amount(found) == pytest.approx(frequency[2, r], rel=SHOWN[8])
        found = re.search(rf"{name} ({NUMBER}) N/m\^3", coefficients)[1]
        assert float(found) == pytest.approx(cubic[2, r], rel=SHOWN[4])
    curve.save_csv(tmp_path / "tuning.csv")
    text = browser.evaluate("nanorom.loads.csv(nanorom.store)")
    written = (tmp_path / "tuning.csv").read_text()
    assert text.splitlines()[0].replace('"', "") == written.splitlines()[0]
    ours, theirs = (
        np.genfromtxt(io.StringIO(t), delimiter=",", skip_header=1) for t in (text, written)
    )
    assert np.allclose(ours, theirs, rtol=1e-9, atol=0.0, equal_nan=True)
    assert browser.complaints == browser.foreign == []


def made_up_orbits():
    """Three orbits of two modes, the film's of the last not found."""
    rng = np.random.default_rng(3)
    n = 3
    modal = rng.uniform(1e-9, 2e-8, (n, 2))
    full = modal * (1 + rng.uniform(-1e-2, 1e-2, (n, 2)))
    full[-1] = np.nan

    def one(low, high):
        return rng.uniform(low, high, n)

    return Verified(
        scene="",
        versions={},
        label=("f01", "f11"),
        frequency=np.array([2e7, 3e7]),
        outside_label=("f02",),
        level=np.array([0, 0, 1]),
        direct=one(1, 2),
        parametric=np.zeros(n),
        branch=np.array([0, 1, 0]),
        type=("-", "LP", "-"),
        omega=one(1e8, 2e8),
        period_multiple=np.array([1, 1, 2]),
        harmonics=np.full(n, 9),
        modal=modal,
        full=full,
        omega_full=one(1e8, 2e8),
        outside=one(1e-12, 1e-11)[:, None],
        deflection=one(1e-9, 2e-8)[:, None].repeat(2, 1),
        residual=one(1e-9, 1e-7),
        modal_residual=one(1e-5, 1e-3),
        estimate=one(1e-5, 1e-3),
        error=one(1e-5, 1e-3),
        estimate_omega=one(1e-6, 1e-5),
        takes_part=np.ones((n, 1)),
        largest_multiplier=one(0.9, 1.1),
    )


def test_orbits_of_the_film_are_read_as_their_file_has_them(browser, tmp_path):
    orbits = made_up_orbits()
    orbits.save(tmp_path / "verified.h5")
    browser.open(view(tmp_path / "verified.h5"))
    for i in range(3):
        browser.evaluate(f"nanorom.verified.read(nanorom.verified.rows[{i}])")
        text = told(browser, "nanorom.verified.note.textContent")
        head, rest = text.split(": ")
        where = f"level {orbits.level[i] + 1}, branch {orbits.branch[i]}"
        assert head.startswith(where) and ("LP" in head) == (orbits.type[i] == "LP")
        hertz = amount(head.split(", ")[-1])
        assert hertz == pytest.approx(orbits.omega[i] / (2 * np.pi), rel=SHOWN[8])
        mode = int(np.argmax(orbits.modal[i]))
        name, model, film = re.match(
            rf"(\w+) ({NUMBER} \w+) in the model, (.+) in the film", rest
        ).groups()
        assert name == orbits.label[mode]
        assert amount(model) == pytest.approx(orbits.modal[i, mode], rel=SHOWN[6])
        if np.isfinite(orbits.full[i, mode]):
            assert amount(film) == pytest.approx(orbits.full[i, mode], rel=SHOWN[6])
        else:
            assert film == "–"
        for word, expected in (("estimate", orbits.estimate), ("error", np.abs(orbits.error))):
            shown = float(re.search(rf"{word} ({NUMBER})", rest)[1])
            assert shown == pytest.approx(expected[i], rel=SHOWN[3])
    assert browser.complaints == browser.foreign == []
