"""The site's tutorials run as they stand and show what they say; its pages are all there."""

import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest

REPOSITORY = Path(__file__).parents[2]
DOCS = REPOSITORY / "docs"
PAPER_F01 = 21.15119357  # MHz; spectral solution of the paper's drum, no finite elements
PRINTED = 5e-5  # MHz: half of the last digit that the page prints
HOLE = 0.1  # what a small hole and bending may change
SQUARE_F11 = 12.70  # MHz: sqrt(2 T/(rho h))/(2 a) of the square membrane without its hole


@pytest.fixture(scope="module")
def make():
    spec = importlib.util.spec_from_file_location("make", DOCS / "make.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_first_drum_has_the_papers_frequency(make, tmp_path):
    page = make.executed(DOCS / "tutorials/first-drum.md", tmp_path)
    printed = float(re.search(r"^f01 +([\d.]+) MHz$", page, re.MULTILINE)[1])
    assert printed == pytest.approx(PAPER_F01, abs=PRINTED)
    assert "![response.png](response.png)" in page and (tmp_path / "response.png").is_file()


def test_diagram_has_the_points_that_the_page_explains(make, tmp_path):
    page = make.executed(DOCS / "tutorials/diagram.md", tmp_path)
    assert len(re.findall(r"^LP  omega", page, re.MULTILINE)) == 2
    assert "a multiplier of -1.000000" in page and "![diagram.png]" in page


def test_own_film_is_meshed_and_held_by_its_names(make, tmp_path):
    page = make.executed(DOCS / "tutorials/own-film.md", tmp_path)
    printed = float(re.search(r"^mode 1: ([\d.]+) MHz$", page, re.MULTILINE)[1])
    assert printed == pytest.approx(SQUARE_F11, rel=HOLE)
    assert "![modes.png]" in page


def test_laser_drives_what_pressure_does_not(make, tmp_path):
    page = make.executed(DOCS / "howto/laser.md", tmp_path)
    pressure, spot = map(
        float, re.search(r"^f11c +pressure (\S+) N/Pa, spot (\S+)", page, re.M).groups()
    )
    assert abs(spot) > 1e-13 > abs(pressure)


def test_how_to_pages_of_the_second_half_print_what_they_say(make, tmp_path):
    drives = make.executed(DOCS / "howto/drives.md", tmp_path)
    gains = [float(gain) for gain in re.findall(r"^phase .*gain ([\d.]+)$", drives, re.M)]
    assert gains == pytest.approx([1 / 0.1, 1 / 1.9], abs=1e-3)
    heat = make.executed(DOCS / "howto/heat.md", tmp_path)
    assert "HB at power 0.20840" in heat and "stable True" in heat
    instruments = make.executed(DOCS / "howto/instruments.md", tmp_path)
    up, down = (float(w) for w in re.findall(r"^largest at omega ([\d.]+)$", instruments, re.M))
    assert up > down + 0.1
    quality = float(re.search(r"^quality factor ([\d.]+)$", instruments, re.M)[1])
    assert quality == pytest.approx(50, rel=0.1)


def test_spectrum_gives_the_device_that_it_was_made_of(make, tmp_path):
    """The frequencies are exact ones of known tensions and modulus, each changed by some 0.1 %."""
    page = make.executed(DOCS / "tutorials/spectrum.md", tmp_path)
    for name, true in (("tension_x", 0.321), ("tension_y", 0.257), ("youngs_modulus", 410e9)):
        value, interval = map(float, re.search(rf"^{name} +(\S+) \+- (\S+)$", page, re.M).groups())
        assert abs(value - true) < 2 * interval
    assert "f01 f11s f11c f21c" in page and "![response.png]" in page


def test_gate_lowers_the_frequency_before_it_raises_it(make, tmp_path):
    page = make.executed(DOCS / "tutorials/gate.md", tmp_path)
    rows = re.findall(r"^ *([\d.]+) V +(\S+) nm +([\d.]+) MHz$", page, re.M)
    voltage, centre, frequency = map(list, zip(*[map(float, row) for row in rows]))
    assert voltage[0] == 0.0 and voltage[-1] == 12.0
    assert (np.diff(np.abs(centre)) > 0).all()
    assert min(frequency) < frequency[0] < frequency[-1]
    told = float(re.search(r"^([\d.]+) MHz, a111", page, re.M)[1])
    assert told == pytest.approx(frequency[-1], rel=1e-3)


def test_film_is_asked_what_one_mode_leaves_out(make, tmp_path):
    page = make.executed(DOCS / "tutorials/check.md", tmp_path)
    row = r"^1 +0 +- +[\d.]+ +f01 +([\d.]+) +([\d.]+) +\S+ +(\S+)"
    rows = [tuple(map(float, found)) for found in re.findall(row, page, re.M)]
    assert len(rows) == 2
    for model, film, estimate in rows:
        assert 0 < abs(model / film - 1) < 3 * estimate


TRIED = set(re.findall(r'DOCS / "([\w/-]+\.md)"', Path(__file__).read_text(encoding="utf-8")))
OTHERS = {str(page.relative_to(DOCS)) for page in DOCS.rglob("*.md")} - TRIED


@pytest.mark.parametrize("name", sorted(OTHERS))
def test_blocks_of_every_other_page_run_where_the_site_is_built(make, tmp_path, name):
    """In a folder of nothing, as `./run docs` does; what a page prints is part of it."""
    page = make.executed(DOCS / name, tmp_path)
    assert page.count("```python") == (DOCS / name).read_text(encoding="utf-8").count("```python")


def test_command_line_page_has_every_command(make):
    page = make.command_line()
    for name in ("reduce", "respond", "identify", "export"):
        assert f"## nanorom {name}" in page


def test_every_page_is_in_the_menu_and_every_link_leads_somewhere():
    menu = set(re.findall(r"^ +- ([\w/-]+\.md)$", (REPOSITORY / "mkdocs.yml").read_text(), re.M))
    pages = {str(page.relative_to(DOCS)) for page in DOCS.rglob("*.md")} | {"cli.md"}
    assert menu == pages
    for page in DOCS.rglob("*.md"):
        for link in re.findall(r"\]\(([\w/.-]+\.md)\)", page.read_text()):
            target = (page.parent / link).resolve().relative_to(DOCS)
            assert str(target) in pages, f"{page}: {link}"
