"""One declaration per array: files, checks, selection, documents and repr follow from it."""

import ast
import importlib
from pathlib import Path

import attrs
import h5py
import numpy as np
import pytest

import nanorom
from nanorom.errors import FileError, ModelError
from nanorom.files import layout, schema, stored
from nanorom.files.schema import POTENTIAL, array, family
from nanorom.results.loadcurve import LoadCurve
from nanorom.results.response import Response
from nanorom.rom.arrays import as_arrays, as_optional
from nanorom.rom.model import ReducedModel
from nanorom.scene.units import tabulated
from nanorom.types import Array
from tests.files import layouts

PACKAGE = Path(nanorom.__file__).parent
DATA = Path(__file__).parent / "data"
SCREEN = (40, 100)  # lines and characters
MANY = 3  # names of arrays in one literal: a second list of them

# Written by nanorom 0.1.0 at commit 338ce30, before there were schemas, by its own save(): a
# clamped drum of 3 modes under a pressure, with the bending, stretching and damping of a viscous
# one and 24 triangles of its shapes; its first mode at two levels; a membrane above a gate.
FILES = {"rom-1.h5": ReducedModel, "response-1.h5": Response, "tuning-1.h5": LoadCurve}


def contents(path):
    """Datasets with their units, and attributes, as any HDF5 reader sees them."""
    found = {}

    def look(name, item):
        if isinstance(item, h5py.Dataset):
            found[name] = (item[()], item.dtype, item.attrs.get("unit"))
        found.update({f"{name}@{key}": (value, None, None) for key, value in item.attrs.items()})

    with h5py.File(path) as file:
        look("", file)
        file.visititems(look)
    return found


@pytest.mark.parametrize("name", FILES)
def test_a_file_of_format_1_is_read_and_written_again_to_the_last_bit(tmp_path, name):
    content = stored.load(DATA / name)
    assert type(content) is FILES[name]
    content.save(tmp_path / name)
    old, new = contents(DATA / name), contents(tmp_path / name)
    assert old.keys() <= new.keys() | {"@key"}  # it says that a run is not at its end
    for key in old.keys() - {"@nanorom_version", "@key"}:
        (a, kind, unit), (b, new_kind, new_unit) = old[key], new[key]
        assert np.asarray(a).tobytes() == np.asarray(b).tobytes(), key
        assert kind == new_kind or a.size == 0, key  # without points, 0.1.0 wrote no type of theirs
        assert unit is None or unit == new_unit, key


def test_model_of_format_1_has_the_arrays_that_are_in_its_file():
    model = ReducedModel.load(DATA / "rom-1.h5")
    held = contents(DATA / "rom-1.h5")
    read = {leaf.path: leaf.value for leaf in schema.leaves(model)}
    datasets = {path for path in held if "@" not in path}
    assert read.keys() == datasets
    for path in datasets - {"label"}:
        assert np.array_equal(read[path], held[path][0]), path
    assert set(model.static) == {
        "deflection",
        "largest_deflection",
        "centre_deflection",
        "mean_tension",
    }


@pytest.mark.parametrize("document", layouts.DOCUMENTS, ids=lambda path: path.name)
def test_documents_show_what_the_classes_declare(document):
    text = document.read_text("utf-8")
    assert layouts.with_tables(text) == text, "run: ./run python -m tests.files.layouts"


def test_selection_takes_the_modes_of_every_array_that_has_some(make_model):
    model = make_model(4, bending=np.eye(4), stretching=make_model(4).cubic)
    part, pick = model.select([2, 4]), np.array([1, 3])
    whole = {leaf.path: leaf.value for leaf in schema.leaves(model)}
    for path, item, value in schema.leaves(part):
        if item.kind == "name":
            assert value == tuple(whole[path][i] for i in pick)
            continue
        places = [
            pick if axis == "L" else np.arange(n)
            for axis, n in zip(item.axes, np.shape(whole[path]))
        ]
        expected = whole[path][np.ix_(*places)] if places else whole[path]
        assert np.array_equal(value, expected), path


@attrs.frozen(eq=False, kw_only=True, repr=False)
class Extended(ReducedModel):
    """A model with more arrays: each is one declaration."""

    surplus: Array | None = attrs.field(
        converter=as_optional,
        default=None,
        metadata=array("L, L, L, L", "N/m^3", "made up", symmetry=POTENTIAL, path="more/surplus"),
    )
    rate: Array | None = attrs.field(
        converter=as_optional, default=None, metadata=array("S, S", "1/s", "first-order states")
    )
    slope: Array | None = attrs.field(
        converter=as_optional, default=None, metadata=array("S, 2L", "1/m", "of states by modes")
    )
    harmonic: dict[str, Array] = attrs.field(
        converter=as_arrays,
        factory=dict,
        metadata=family("H, L", "N", "forces by harmonics of the drive"),
    )


@pytest.fixture
def extended(make_model):
    model = make_model(3)
    own = {field.name: getattr(model, field.name) for field in attrs.fields(ReducedModel)}
    rng = np.random.default_rng(5)
    return Extended(
        **own,
        surplus=-model.cubic,
        rate=rng.normal(size=(2, 2)),
        slope=rng.normal(size=(2, 6)),
        harmonic={"gate": rng.normal(size=(4, 3))},
    )


def test_a_new_array_is_one_declaration(tmp_path, extended):
    path = tmp_path / "rom.h5"
    extended.save(path)
    held = contents(path)
    assert held["more/surplus"][2] == "N/m^3" and held["harmonic/gate"][0].shape == (4, 3)
    again = Extended.load(path)
    for name in ("surplus", "rate", "slope"):
        assert np.array_equal(getattr(again, name), getattr(extended, name))
    assert np.array_equal(again.harmonic["gate"], extended.harmonic["gate"])
    part = again.select([1, 3])
    assert np.array_equal(part.surplus, -part.cubic)
    assert np.array_equal(part.harmonic["gate"], extended.harmonic["gate"][:, [0, 2]])
    assert np.array_equal(part.rate, extended.rate)
    assert np.array_equal(part.slope, extended.slope[:, [0, 2, 3, 5]])
    assert ("more/surplus", "(L, L, L, L)", "N/m^3") in {row[:3] for row in layout.rows(Extended)}
    assert "more/surplus" in repr(again)
    # an older nanorom, which does not know them, reads the rest
    assert np.array_equal(ReducedModel.load(path).cubic, extended.cubic)


def test_a_new_array_that_does_not_fit_is_refused(extended):
    for change, message in [
        ({"surplus": np.zeros((2,) * 4)}, r"more/surplus: found shape \(2, 2, 2, 2\)"),
        ({"rate": np.zeros((2, 3))}, r"rate: found shape \(2, 3\); expected \(2, 2\)"),
        ({"slope": np.zeros((2, 3))}, r"slope: found shape \(2, 3\); expected \(2, 6\)"),
        ({"harmonic": {"gate": np.zeros((4, 2))}}, r"harmonic/gate: found .*; expected \(any, 3\)"),
        ({"rate": np.full((2, 2), np.nan)}, "rate: contains NaN"),
    ]:
        with pytest.raises(ModelError, match=message):
            attrs.evolve(extended, **change)


def test_a_static_quantity_without_a_name_is_refused(make_model):
    with pytest.raises(ModelError, match="static: found 'colour'; allowed: deflection"):
        make_model(2, static={"colour": 1.0})


def test_every_class_with_a_format_is_a_row_of_the_kinds():
    formats = {}
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.AnnAssign) and ast.unparse(node.target) == "FORMAT":
                formats[ast.literal_eval(node.value)] = path
    assert formats.keys() == stored.KINDS.keys()


@pytest.mark.parametrize("kind", stored.KINDS.values(), ids=stored.KINDS)
def test_every_kind_of_file_can_be_loaded_told_and_drawn(kind):
    for function in (kind.load, kind.text, kind.draw, kind.html):
        module, _, name = function.partition(":")
        target = importlib.import_module(module)
        for part in name.split("."):
            target = getattr(target, part)
        assert callable(target)


def test_a_file_of_another_kind_is_refused_with_the_kinds_there_are(tmp_path):
    with h5py.File(tmp_path / "x.h5", "w") as file:
        file.attrs["format"] = "another"
    with pytest.raises(FileError, match="'another'; expected a rom.h5, a response.h5, .* or a "):
        stored.load(tmp_path / "x.h5")


@pytest.mark.parametrize("name", FILES)
def test_repr_is_one_screen(make_model, name):
    for content in (stored.load(DATA / name), make_model(40)):
        lines = repr(content).splitlines()
        assert len(lines) <= SCREEN[0] and max(map(len, lines)) <= SCREEN[1]


def test_a_notebook_shows_tables_and_pictures_of_the_modes(make_model):
    model = stored.load(DATA / "rom-1.h5")
    shown = model._repr_html_()
    numbers, unit = tabulated(model.frequency, "Hz", 10)
    assert unit in shown and all(number in shown for number in numbers)
    assert shown.count("<img") == 1 and "mode shapes f01, f11s, f11c" in shown
    assert "<img" not in attrs.evolve(model, shapes=None)._repr_html_()
    response = stored.load(DATA / "response-1.h5")
    assert "level 2" in response._repr_html_()
    assert "<b>&" not in make_model(2, label=["<b>&", "f02"])._repr_html_()
    assert "pulled in" in stored.load(DATA / "tuning-1.h5")._repr_html_()


def test_no_module_lists_the_names_of_arrays_again():
    entries = schema.entries(ReducedModel).items()
    names = {name for name, entry in entries if not isinstance(entry, schema.Note)}
    found = []
    for room in ("cli", "export", "fem", "files", "measurement", "plots", "results", "rom"):
        for path in (PACKAGE / room).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text("utf-8"))):
                parts = getattr(node, "elts", None) or getattr(node, "keys", None) or []
                words = {getattr(part, "value", None) for part in parts}
                if len(words & names) >= MANY:
                    found.append(f"{path.relative_to(PACKAGE)}:{node.lineno} {words & names}")
    assert not found
