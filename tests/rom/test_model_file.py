"""`rom.h5` gives back the model to the last bit, and what is unsound is refused in one line."""

import json
import re

import attrs
import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from nanorom.errors import FileError
from nanorom.files import schema
from nanorom.rom.model import ReducedModel

ARRAYS = ("frequency", "mass", "number", "stiffness", "damping", "quadratic", "cubic")


def same(a, b):
    first, second = ({leaf.path: leaf.value for leaf in schema.leaves(model)} for model in (a, b))
    assert first.keys() == second.keys()
    assert all(np.array_equal(first[path], second[path]) for path in first)
    for name in ("label", "scene", "method", "in_plane", "versions"):
        assert getattr(a, name) == getattr(b, name)
    return True


@settings(
    max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.integers(1, 6), st.integers(0, 2**32 - 1), st.booleans())
def test_round_trip_is_exact_to_the_last_bit(tmp_path, make_model, size, seed, drawn):
    model = make_model(size, seed)
    if not drawn:
        model = attrs.evolve(model, shapes=None, drive={}, parametric={}, diagnostics={})
    else:
        model = attrs.evolve(model, bending=model.stiffness, stretching=model.cubic)
    model.save(tmp_path / "rom.h5")
    assert same(model, ReducedModel.load(tmp_path / "rom.h5"))


def test_diagnostics_survive_the_round_trip(tmp_path, make_model):
    diagnostics = {
        "asymmetry": 1e-12,
        "dofs": 845,
        "wall_time": {"mesh": 0.5},
        "note": "text",
        "frequency_error": np.array([1e-9, 2e-9]),
    }
    make_model(2, diagnostics=diagnostics).save(tmp_path / "rom.h5")
    loaded = ReducedModel.load(tmp_path / "rom.h5").diagnostics
    assert loaded.pop("frequency_error").tolist() == [1e-9, 2e-9]
    diagnostics.pop("frequency_error")
    assert loaded == diagnostics


def test_file_has_the_documented_layout(tmp_path, make_model):
    make_model(3).save(tmp_path / "rom.h5")
    with h5py.File(tmp_path / "rom.h5") as file:
        assert file.attrs["format"] == "nanorom-rom"
        assert file.attrs["format_version"] == 1
        assert file.attrs["normalization"] == "max"
        assert json.loads(file.attrs["versions"]) == {"dolfinx": "0.5.2"}
        assert {"nanorom_version", "scene", "method", "in_plane"} < set(file.attrs)
        shapes = {name: file[name].shape for name in (*ARRAYS, "label")}
        assert shapes["frequency"] == shapes["label"] == (3,)
        assert shapes["cubic"] == (3, 3, 3, 3)
        assert file["cubic"].attrs["unit"] == "N/m^3"
        assert file["drive/pressure"].shape == (3,)
        assert file["parametric/tension"].shape == (3, 3)
        n_points = file["shapes/points"].shape[0]
        assert file["shapes/values"].shape == (3, n_points)
        assert file["shapes/cells"].shape[1] == 3
        assert file["diagnostics"].attrs["dofs"] == 845


def replace(name, value):
    def change(file):
        del file[name]
        file[name] = value

    return change


def attribute(name, value):
    return lambda file: file.attrs.__setitem__(name, value)


def external_link(file):
    del file["cubic"]
    file["cubic"] = h5py.ExternalLink("/etc/hostname", "/cubic")


def outside(file):
    del file["mass"]
    file.create_dataset("mass", shape=(2,), dtype=float, external=[("/dev/zero", 0, 16)])


def huge(file):
    del file["shapes/points"]
    file["shapes"].create_dataset("points", shape=(10**12, 3), dtype=float, chunks=(1000, 3))


def many_modes(file):
    del file["frequency"]
    file.create_dataset("frequency", shape=(10**6,), dtype=float, chunks=(1000,))


def not_a_potential(file):
    file["cubic"][0, 1, 1, 1] *= 1.001


BROKEN = [
    (lambda file: file.__delitem__("cubic"), "cubic: missing"),
    (lambda file: file.__delitem__("drive"), "drive: missing"),
    (lambda file: file.__delitem__("diagnostics"), "diagnostics: missing"),
    (replace("cubic", np.zeros((2, 2, 2))), r"cubic: found shape \(2, 2, 2\); expected"),
    (replace("cubic", np.full((2,) * 4, np.nan)), "cubic: contains NaN"),
    (replace("cubic", np.zeros((2,) * 4, dtype="S3")), "cubic: found type"),
    (replace("mass", [0.0, 1.0]), "not greater than 0"),
    (replace("frequency", [[1.0, 2.0]]), "frequency: found shape"),
    (replace("frequency", []), "found shape|no modes"),
    (replace("label", [1.0, 2.0]), "label: found type"),
    (replace("shapes/cells", [[0, 1, 99]]), "shapes/cells: point numbers outside"),
    (replace("shapes/cells", [[0.0, 1.0, 2.0]]), "shapes/cells: found type"),
    (replace("drive", [1.0]), "drive: missing, or not a group"),
    (attribute("format", "something"), "format 'something'; expected 'nanorom-rom'"),
    (attribute("format_version", 2), "use a newer nanorom"),
    (attribute("format_version", "one"), "format_version: found 'one'"),
    (attribute("normalization", "mass"), "normalization: found 'mass'"),
    (attribute("versions", "[1]"), "expected a JSON object"),
    (attribute("versions", "{"), "damaged"),
    (external_link, "cubic: missing, or not a dataset of this file"),
    (outside, "mass: its numbers are outside the file"),
    (huge, "points: declares"),
    (many_modes, "found 1000000 modes; at most 100"),
    (not_a_potential, "deviate from a potential"),
]


@pytest.mark.parametrize(("damage", "message"), BROKEN)
def test_unsound_file_gives_one_line_that_names_the_cause(tmp_path, make_model, damage, message):
    path = tmp_path / "rom.h5"
    make_model(2).save(path)
    with h5py.File(path, "r+") as file:
        damage(file)
    with pytest.raises(FileError, match=message) as caught:
        ReducedModel.load(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


def test_files_of_another_kind_are_refused(tmp_path):
    text, folder = tmp_path / "text.h5", tmp_path / "folder"
    text.write_text("not HDF5")
    folder.mkdir()
    for path, reason in [
        (text, "not an HDF5 file"),
        (folder, "is a directory"),
        (tmp_path / "none.h5", "no such file"),
    ]:
        with pytest.raises(FileError, match=re.escape(f"{path}: {reason}")):
            ReducedModel.load(path)


def test_a_file_cut_short_anywhere_is_refused(tmp_path, make_model):
    path = tmp_path / "rom.h5"
    make_model(3).save(path)
    whole = path.read_bytes()
    for length in np.linspace(0, len(whole) - 1, 40, dtype=int):
        path.write_bytes(whole[:length])
        with pytest.raises(FileError):
            ReducedModel.load(path)


def test_a_reported_asymmetry_is_accepted(tmp_path, make_model):
    cubic = np.array(make_model(2).cubic)
    cubic[0, 1, 1, 1] *= 1 + 1e-5
    model = make_model(2, cubic=cubic, diagnostics={"asymmetry": 1e-5})
    model.save(tmp_path / "rom.h5")
    assert same(model, ReducedModel.load(tmp_path / "rom.h5"))
