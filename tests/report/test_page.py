"""report.html: one file with everything, that opens without a network."""

import base64
import gzip
import json
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

import nanorom
from nanorom.errors import FileError
from nanorom.report import page, sections
from nanorom.report.viewer.listing import INDEX, MOST, view
from nanorom.report.viewer.pack import Pack
from nanorom.report.viewer.page import ASSETS, LIBRARIES, PROGRAM
from nanorom.results.respond import respond
from nanorom.rom.tables import CoefficientTable
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Sweep

SECONDS = {"reduce": 1.25, "respond": 2.5}
NEEDS_NETWORK = ("http:", "https:", "@import", "url(")
EMPTY = ("meta", "link", "img")  # elements without an end
SEED = 20


class Reader(HTMLParser):
    """Elements, links and text of a page; whether its elements are nested as they should be."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.links: list[str] = []
        self.words: list[str] = []
        self.rows: list[list[str]] = []
        self.sound = True
        self.feed(text)
        self.sound = self.sound and not self.open

    def handle_starttag(self, tag, attributes):
        self.links += [value for name, value in attributes if name in ("src", "href")]
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")
        if tag not in EMPTY:
            self.open.append(tag)

    def handle_endtag(self, tag):
        self.sound = self.sound and bool(self.open) and self.open.pop() == tag

    def handle_data(self, data):
        self.words.append(data)
        if {"td", "th"} & set(self.open):
            self.rows[-1][-1] += data


@pytest.fixture
def scene(drum_toml):
    return nanorom.Scene.from_toml(drum_toml)


@pytest.fixture
def model(make_model):
    return make_model(2, quadratic=np.zeros((2, 2, 2)), scene="")


@pytest.fixture
def picture(tmp_path):
    path = tmp_path / "response.png"
    path.write_bytes(b"\x89PNG made up")
    return path


def written(path: Path, *arguments, title="a drum") -> Reader:
    page.write(path, title, *arguments)
    return Reader(path.read_text(encoding="utf-8"))


def test_page_holds_pictures_and_asks_for_nothing_else(tmp_path, scene, model, picture):
    found = written(tmp_path / "report.html", scene, model, None, SECONDS, [picture])
    assert found.sound
    data = [link for link in found.links if link.startswith("data:image/png;base64,")]
    assert base64.b64decode(data[0].partition(",")[2]) == picture.read_bytes()
    assert all(link.startswith("data:") for link in found.links)
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert not [word for word in NEEDS_NETWORK if word in text]
    assert "default-src 'none'" in text  # a browser would refuse to fetch anything


def test_program_and_libraries_ask_for_nothing_else():
    """Addresses in the libraries are those of their authors, of bugs and of XML's names."""
    for name in PROGRAM:
        text = ASSETS.joinpath(f"assets/{name}.js").read_text(encoding="utf-8")
        assert not re.findall(r"fetch\(|XMLHttpRequest|WebSocket|sendBeacon", text)
        asked = set(re.findall(r'from "(.*?)"', text))
        assert asked <= set(PROGRAM) | set(LIBRARIES)
    assert {path.name for path in ASSETS.joinpath("assets").iterdir()} == {
        *(f"{name}.js" for name in PROGRAM), "boot.js", "page.html", "style.css",
    }  # fmt: skip


def test_libraries_are_those_of_the_versions_that_are_told():
    folder = ASSETS.joinpath("vendor")
    told = folder.joinpath("README.md").read_text()
    made = folder.joinpath("make").read_text()
    for name, file in (("three", "three.min.js"), ("uplot", "uplot.min.js")):
        version = re.search(rf"`{file}` \| {name} \| ([\d.]+) \| MIT", told)[1]
        assert f"{name}@{version}" in made
        library = folder.joinpath(file).read_text(encoding="utf-8")
        assert version in library or f'"{version.split(".")[1]}"' in library
        assert "MIT" in library[:200]  # the licence is in the page, too
        assert "Permission is hereby granted" in folder.joinpath(f"{name}.LICENSE").read_text()


def test_numbers_of_a_page_are_those_that_were_packed():
    """As its program takes them apart, for random arrays of all types, shapes and folders."""
    rng = np.random.default_rng(SEED)
    pack, given = Pack(), {}
    for number in range(60):
        shape = tuple(rng.integers(0, 6, size=rng.integers(1, 4)))
        dtype = rng.choice(["f8", "f4", "i4", "u4", "i2", "u2", "u1"])
        values = (rng.standard_normal(shape) * 100).astype("f8")
        values = values if dtype[0] == "f" else np.abs(values).round()
        path = f"part{number % 3}/{number}"
        pack.sub(f"part{number % 3}").numbers(str(number), values, dtype, "m")
        given[path] = values.astype(dtype)
    table = json.loads(pack.table())
    data = gzip.decompress(base64.b64decode(pack.bytes()))
    assert set(table) == set(given)
    for path, values in given.items():
        entry = table[path]
        assert entry["at"] % values.itemsize == 0
        size = values.size * values.itemsize
        found = np.frombuffer(data[entry["at"] : entry["at"] + size], f"<{entry['type']}")
        assert np.array_equal(found.reshape(entry["shape"]), values)


def test_folder_has_a_page_of_each_sound_file_and_says_what_is_wrong_with_others(
    tmp_path, make_model
):
    make_model(2).save(tmp_path / "rom.h5")
    (tmp_path / "deep").mkdir()
    make_model(3).save(tmp_path / "deep" / "other.h5")
    (tmp_path / "deep" / "anyones.h5").write_bytes(b"of something else")
    whole = (tmp_path / "rom.h5").read_bytes()
    (tmp_path / "response.h5").write_bytes(whole[: len(whole) // 2])
    index = view(tmp_path)
    found = Reader(index.read_text(encoding="utf-8"))
    assert index == tmp_path / INDEX
    assert [link for link in found.links if link.endswith("html")] == [
        "rom.html",
        "deep/other.html",
    ]
    assert (tmp_path / "deep" / "other.html").is_file()
    rows = dict(found.rows)
    assert list(rows) == ["response.h5", "rom.h5", "deep/other.h5"]
    assert rows["response.h5"].startswith(f"{tmp_path / 'response.h5'}: ")
    (tmp_path / "empty").mkdir()
    with pytest.raises(FileError, match="no file of nanorom"):
        view(tmp_path / "empty")


def test_listing_of_very_many_files_says_how_many_are_left_out(tmp_path, monkeypatch, make_model):
    assert MOST > 10
    monkeypatch.setattr("nanorom.report.viewer.listing.MOST", 2)
    for number in range(3):
        make_model(1, shapes=None).save(tmp_path / f"rom{number}.h5")
    text = view(tmp_path).read_text(encoding="utf-8")
    assert "1 more files are not listed" in text
    assert not (tmp_path / "rom2.html").exists()


def test_page_has_modes_coefficients_parameters_versions_and_times(tmp_path, scene, model):
    found = written(tmp_path / "report.html", scene, model, None, SECONDS, [])
    text = " ".join(found.words)
    for label, frequency in zip(model.label, model.frequency):
        row = next(row for row in found.rows if row[1:2] == [label])
        assert float(row[2]) == pytest.approx(frequency / 1e6, rel=1e-9)
    (b111,) = [row for row in found.rows if row[0] == "1,1,1"]
    assert float(b111[1]) == pytest.approx(model.b(1)[1, 1, 1], rel=1e-4)
    assert len([row for row in found.rows if "," in row[0]]) == len(
        CoefficientTable.of(model).nonzero().products
    )
    assert "alpha_jk" not in text  # all are zero
    assert 'shape = "disc"' in text and "quality_factor" in text
    assert "dolfinx 0.5.2" in text
    assert "reduce 1.25 s, respond 2.50 s" in text


def test_page_lists_levels_and_special_points(tmp_path, scene, make_model):
    given = {"cubic": np.full((1, 1, 1, 1), 1e16), "drive": {"pressure": np.array([1e-11])}}
    model = make_model(1, quadratic=np.zeros((1, 1, 1)), **given)
    response = respond(model, Drive(["1 Pa", "100 Pa"]), Sweep("0.9 f1", "1.2 f1"), processes=1)
    found = written(tmp_path / "report.html", scene, model, response, SECONDS, [])
    folds = [row for row in found.rows if row[1:2] == ["LP"]]
    points = [p for diagram in response.diagrams for p in diagram.points("LP")]
    assert [float(row[2]) for row in folds] == pytest.approx([p.frequency / 1e6 for p in points])
    assert len(folds) > 0
    assert [row for row in found.rows if row[0] == "level 2" and "100 Pa direct" in row[1]]


def test_names_of_the_user_are_text_and_not_markup(tmp_path, scene, make_model):
    model = make_model(1, label=["<b>&"])
    found = written(tmp_path / "report.html", scene, model, None, {}, [], title="<script>")
    assert found.sound
    assert "script" not in found.open
    assert [row for row in found.rows if "<b>&" in row]


def test_large_tables_are_left_to_other_programs(tmp_path, scene, model, monkeypatch):
    monkeypatch.setattr(sections, "MOST_CELLS", 1)
    found = written(tmp_path / "report.html", scene, model, None, {}, [])
    assert "nanorom export rom.h5 --to csv" in " ".join(found.words)


def test_failure_leaves_an_earlier_page(tmp_path, scene, model, monkeypatch):
    (tmp_path / "report.html").write_text("earlier")
    with pytest.raises(FileNotFoundError):
        page.write(tmp_path / "report.html", "t", scene, model, None, {}, [tmp_path / "none.png"])
    assert (tmp_path / "report.html").read_text() == "earlier"
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]
