"""The live page in a browser: what it shows and moves is what the files hold."""

import csv
import io

import attrs
import numpy as np
import pytest

from nanorom.continuation import Diagram
from nanorom.plots.curves import stretches
from nanorom.report import page
from nanorom.report.viewer.listing import INDEX, view
from nanorom.results import table
from nanorom.results.loadcurve import LoadCurve
from nanorom.rom import motion
from tests.report import live
from tests.report.live import SINGLE, amount, click_point, facts, point_of, selected

pytestmark = live.needs_chromium

SHOWN = 5.1e-6  # relative: numbers that are written with six digits
SIZE = 3_000_000  # bytes of a page at most


def all_branches(response):
    return [(k, b) for k, d in enumerate(response.diagrams) for b in range(len(d.branches))]


def test_click_selects_the_point_and_says_what_its_file_says(opened, response):
    rng = np.random.default_rng(0)
    for number, (level, name) in enumerate(all_branches(response)):
        branch = response.diagrams[level].branches[name]
        for index in rng.integers(len(branch), size=4):
            found = click_point(opened, number, index)
            of, _, at = point_of(response, found)
            shown = facts(opened)
            # the nearest on the screen may be a neighbour, or a special point: that one is told
            frequency = of.frequency if at is None else of.frequency[at]
            multipliers = of.multipliers if at is None else of.multipliers[at]
            assert amount(shown["drive frequency"]) == pytest.approx(frequency, rel=1e-9)
            largest = np.abs(multipliers).max()
            assert float(shown["largest multiplier"]) == pytest.approx(largest, rel=SHOWN)
            if at is not None:
                assert shown["this point"] == ("stable" if of.stable[at] else "unstable")
                own = branch.frequency[index]
                assert frequency == pytest.approx(own, rel=0.02)


def test_amplitudes_and_energies_of_the_modes_are_those_of_the_orbit(opened, model, response):
    found = click_point(opened, 1, 10)
    of, orbit, at = point_of(response, found)
    rows = opened.evaluate(
        "[...document.querySelectorAll('.modes tbody tr')].map((row) => "
        "[...row.cells].map((cell) => cell.textContent.trim()))"
    )
    amplitude = of.amplitude if at is None else of.amplitude[at]
    shares = motion.energy_shares(model, orbit)
    assert len(rows) > 0
    for name, size, share in rows:
        mode = model.label.index(name)
        assert amount(size) == pytest.approx(amplitude[mode], rel=SHOWN)
        percent = float(share.removesuffix("%").replace("−", "-"))
        assert percent == pytest.approx(100 * shares[mode], rel=6e-3)


def test_spectrum_is_that_of_the_orbit(opened, response):
    of, orbit, _ = point_of(response, click_point(opened, 1, 12))
    _, amplitudes = orbit.spectrum()
    shown = opened.evaluate(
        "(() => { const { orbit } = nanorom.motion.seen; return "
        f"Array.from({{ length: {len(response.label)} }}, (_, r) => orbit.lines(r)); }})()"
    )
    for mode, sizes in enumerate(shown):
        expected = np.abs(amplitudes[: len(sizes), mode])
        assert np.abs(np.array(sizes) - expected).max() < SINGLE * np.abs(amplitudes).max()
        dropped = np.abs(amplitudes[len(sizes) :, mode])
        assert dropped.max(initial=0.0) < 1e-6 * np.abs(amplitudes).max()


def test_table_that_is_saved_is_the_one_that_export_writes(opened, response):
    text = opened.evaluate("import('tables').then(({ csv }) => csv(nanorom.response.response))")
    head, *rows = csv.reader(io.StringIO(text))
    columns = table.columns(response)
    assert head == list(table.headings(response).values())
    assert len(rows) == len(columns["level"])
    for name, column in zip(columns, zip(*rows)):
        if name == "special":
            assert list(column) == columns[name].tolist()
        else:
            assert np.array_equal(np.array(column, dtype=float), columns[name])


def test_drawn_curves_are_those_of_the_pictures(opened, response):
    for number, (level, name) in enumerate(all_branches(response)):
        diagram = response.diagrams[level]
        branch = diagram.branches[name]
        drawn = opened.evaluate(
            "nanorom.response.curves.get(nanorom.response.response.branches["
            f"{number}]).map(({{ points, stable }}) => [points, stable])"
        )
        expected = list(stretches(branch, diagram.points(branch=name)))
        assert [stable for _, stable in drawn] == [curve.stable for curve in expected]
        scale = np.append(branch.omega.max(), np.full(len(response.label), branch.amplitude.max()))
        for (points, _), curve in zip(drawn, expected):
            own = np.column_stack([curve.omega, curve.amplitude])
            assert np.abs((np.array(points) - own) / scale).max() < 1e-9


def test_keys_move_along_the_branch_and_to_the_next(opened, response):
    opened.evaluate(
        "nanorom.selection.set({ branch: nanorom.response.response.branches[0], index: 3 })"
    )
    opened.evaluate("nanorom.response.chart.plotted.focus()")
    opened.key("ArrowRight")
    opened.key("ArrowRight")
    assert selected(opened)["index"] == 5
    opened.key("ArrowLeft")
    assert selected(opened)["index"] == 4
    opened.key("PageDown")
    found = selected(opened)
    assert (found["level"], found["branch"]) == all_branches(response)[1]


def test_zoom_keeps_the_middle_and_shows_all_again(opened):
    view = "[...nanorom.response.chart.view.x, ...nanorom.response.chart.view.y]"
    opened.evaluate("nanorom.response.chart.zoom(0)")
    full = np.array(opened.evaluate(view)).reshape(2, 2)
    opened.evaluate("nanorom.response.chart.plotted.focus()")
    opened.key("+")
    near = np.array(opened.evaluate(view)).reshape(2, 2)
    assert np.allclose(np.diff(near), np.diff(full) / 1.5)
    assert np.allclose(near.mean(axis=1), full.mean(axis=1))
    scale = "[nanorom.response.chart.plot.scales.x.min, nanorom.response.chart.plot.scales.x.max]"
    assert np.allclose(opened.evaluate(scale), near[0])
    opened.key("0")
    assert np.allclose(opened.evaluate(view), full.ravel())


def test_levels_and_branches_are_switched(opened, response):
    count = "nanorom.response.candidates().length"
    all_points = opened.evaluate(count)
    boxes = "document.querySelectorAll('.switches summary input')"
    opened.evaluate(f"{boxes}[1].click()")
    first = response.diagrams[0]
    assert opened.evaluate(count) == sum(map(len, first.branches)) + len(first.special_points)
    opened.evaluate(f"{boxes}[1].click()")
    assert opened.evaluate(count) == all_points


def test_rows_of_special_points_lead_to_them(opened, response):
    points = [point for diagram in response.diagrams for point in diagram.special_points]
    rows = "document.querySelectorAll('[data-rows] tbody tr')"
    assert opened.evaluate(f"{rows}.length") == len(points) > 0
    opened.evaluate(f"{rows}[{len(points) - 1}].click()")
    shown = facts(opened)
    assert points[-1].type in shown["this point"]
    assert amount(shown["drive frequency"]) == pytest.approx(points[-1].frequency, rel=1e-9)


@pytest.mark.parametrize(("width", "dark"), [(360, False), (360, True), (1280, True)])
def test_page_fits_narrow_screens_and_dark_ones(browser, folder, width, dark):
    browser.open(view(folder / "response.h5"), width, dark)
    size = browser.evaluate("[document.documentElement.scrollWidth, innerWidth]")
    assert size[0] <= size[1] == width
    ground = browser.evaluate("getComputedStyle(document.body).backgroundColor")
    assert (ground == "rgb(255, 255, 255)") is not dark
    assert browser.complaints == browser.foreign == []


def test_print_is_on_white_whatever_the_screen(browser, folder):
    browser.open(view(folder / "response.h5"), dark=True)
    dark, light = "rgb(27, 27, 29)", "rgb(255, 255, 255)"
    ground = "getComputedStyle(document.body).backgroundColor"
    assert browser.evaluate(ground) == dark
    browser.call("Emulation.setEmulatedMedia", media="print")
    assert browser.evaluate(ground) == light
    browser.call("Emulation.setEmulatedMedia", media="")
    assert browser.call("Page.printToPDF")["data"]


def test_load_curve_is_read_as_its_file_has_it(browser, tmp_path):
    load = np.linspace(0, 10, 6)
    frequency = np.column_stack([2e7 + 1e5 * load, 5e7 - 3e5 * load])
    frequency[-1] = np.nan
    curve = LoadCurve("pressure", load, 1e-9 * load, 1.1e-9 * load, frequency, [10.0])
    curve.save(tmp_path / "tuning.h5")
    browser.open(view(tmp_path / "tuning.h5"))
    for row in (1, 4):
        browser.evaluate(f"nanorom.loads.read({row})")
        text = browser.evaluate("nanorom.loads.note.textContent")
        head, *parts = text.split("; ")[0].split(": ") + text.split("; ")[1].split(", ")
        assert amount(parts[0].removeprefix("deflection ")) == pytest.approx(curve.centre[row])
        for part, expected in zip(parts[1:], curve.frequency[row]):
            assert amount(" ".join(part.split()[-2:])) == pytest.approx(expected, rel=1e-7)
    text = browser.evaluate("nanorom.loads.csv(nanorom.store)")
    values = np.genfromtxt(io.StringIO(text), delimiter=",", skip_header=1)
    expected = np.column_stack([curve.load, curve.centre, curve.largest, curve.frequency])
    assert np.array_equal(values, expected, equal_nan=True)
    assert browser.complaints == browser.foreign == []


def test_response_without_its_model_has_no_film_but_all_else(browser, tmp_path, response):
    response.save(tmp_path / "response.h5")
    browser.open(view(tmp_path / "response.h5"))
    assert not browser.evaluate("Boolean(nanorom.film)")
    click_point(browser, 0, 4)
    assert facts(browser)["drive frequency"].endswith("MHz")
    assert browser.complaints == browser.foreign == []


def test_folder_lists_its_files_and_links_to_pages_that_open(browser, folder, tmp_path):
    index = view(folder, tmp_path / "pages")
    assert index.name == INDEX
    browser.open(index)
    links = browser.evaluate("[...document.querySelectorAll('td a')].map((a) => a.textContent)")
    assert links == ["response.h5", "rom.h5"]
    browser.evaluate("document.querySelectorAll('td a')[1].click()")
    browser.wait_for_page("rom.html")
    assert browser.evaluate("document.title").endswith("rom.h5")
    assert browser.complaints == browser.foreign == []


def test_large_results_make_pages_that_are_not_too_large(browser, tmp_path, make_model, response):
    """Thirty modes on a fine mesh, ten levels: orbits are thinned and shapes rounded, and said."""
    size, rng = 30, np.random.default_rng(1)
    from tests.conftest import square_shapes

    shapes = square_shapes(rng, size, points=140)
    model = make_model(size, quadratic=np.zeros((size,) * 3), shapes=shapes)
    branch = response.diagrams[0].branches[0]
    harmonics = [rng.standard_normal((61, size)) * 1e-9 for _ in range(300)]
    wide = attrs.evolve(
        branch,
        omega=2 * np.pi * np.linspace(18e6, 30e6, 300),
        amplitude=np.abs(rng.standard_normal((300, size))) * 1e-9,
        stable=np.ones(300, dtype=bool),
        multipliers=rng.standard_normal((300, 2 * size)) + 0j,
        coefficients=harmonics,
        parent=None,
    )
    many = attrs.evolve(
        response,
        diagrams=tuple(Diagram([wide], [], n, 0.0) for n in (1.0, 2.0)),
        frequency=model.frequency,
        label=model.label,
    )
    model.save(tmp_path / "rom.h5")
    made = page.response_page(many, tmp_path / "response.h5")
    made.write(tmp_path / "page.html")
    assert (tmp_path / "page.html").stat().st_size < SIZE
    browser.open(tmp_path / "page.html")
    browser.evaluate(
        "nanorom.selection.set({ branch: nanorom.response.response.branches[0], index: 1 })"
    )
    assert "nearest point that the page holds" in facts(browser)["motion"]
    assert browser.complaints == browser.foreign == []
