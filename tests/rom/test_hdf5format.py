"""HDF5 without its library: what h5py writes is read alike, and what is damaged is refused."""

import tracemalloc

import h5py
import numpy as np
import pytest

from nanorom import hdf5
from nanorom.errors import FileError, NanoromError
from nanorom.hdf5format import LEAST_READ, PER_BYTE, fletcher32
from nanorom.rom import ReducedModel

KIND = "nanorom-rom"
MUTANTS = 150  # files with changed bytes
RNG = np.random.default_rng(5)
ARRAYS = {
    "contiguous": (RNG.standard_normal((3, 4)), {}),
    "scalar": (np.float64(3.5), {}),
    "nothing": (np.empty((0, 3)), {}),
    "big end first": (np.arange(5, dtype=">f8"), {}),
    "single": (np.arange(5, dtype="f4"), {}),
    "integers": (np.arange(-3, 3, dtype="i2"), {"fletcher32": True, "chunks": (6,)}),
    "odd bytes": (np.arange(7, dtype="u1"), {"fletcher32": True, "chunks": (7,)}),
    "complex": (RNG.standard_normal(6).view(complex), {"fletcher32": True, "chunks": (3,)}),
    "pieces": (RNG.standard_normal((70, 50)), {"chunks": (3, 7)}),  # a tree of more than one node
    "packed": (np.arange(5000).reshape(50, 100),
               {"compression": "gzip", "shuffle": True, "fletcher32": True, "chunks": (20, 30)}),
    "many words": (RNG.standard_normal(600_000), {"fletcher32": True, "chunks": (600_000,)}),
    "bool": (np.array([True, False]), {}),
    "text": (np.array(["f01", "é"], dtype=object), {"dtype": h5py.string_dtype()}),
    "text of a length": (np.array([b"f01", b"f11c"]), {}),
}  # fmt: skip


def written(path, fill):
    with h5py.File(path, "w") as file:
        file.attrs.update(format=KIND, format_version=1)
        fill(file)
    return path


@pytest.mark.parametrize("name", ARRAYS)
def test_arrays_are_read_as_h5py_wrote_them(tmp_path, name):
    values, options = ARRAYS[name]
    path = written(tmp_path / "a.h5", lambda f: f.create_dataset("g/a", data=values, **options))
    with hdf5.opened(path, KIND, 1) as file, h5py.File(path) as same:
        found = hdf5.read(file, "g/a", np.shape(values), kinds="fiucbS")
        expected = same["g/a"][()]
    assert found.dtype.kind == np.asarray(expected).dtype.kind
    assert np.array_equal(found, expected)


def test_attributes_are_read_as_h5py_wrote_them(tmp_path):
    values = {f"number {n}": n / 3 for n in range(50)}
    values |= {"text": "é" * 3000, "flag": True, "array": np.arange(4.0), "none": ""}
    path = written(tmp_path / "a.h5", lambda f: f.create_group("g").attrs.update(values))
    with hdf5.opened(path, KIND, 1) as file:
        found = hdf5.read_attributes(hdf5.group(file, "g"))
    assert found.keys() == values.keys()
    assert all(np.array_equal(found[name], value) for name, value in values.items())


def test_checksum_of_nothing_and_of_a_multiple_of_its_modulus():
    assert fletcher32(b"") == fletcher32(b"\0\0") == 0
    assert fletcher32(b"\xff\xff") == 0xFFFFFFFF  # 65535 stays, it does not become 0


def test_changed_number_is_found_by_its_checksum(tmp_path, make_model):
    path = tmp_path / "rom.h5"
    model = make_model(2)
    model.save(path)
    content = bytearray(path.read_bytes())
    content[content.index(model.cubic.tobytes()) + 5] ^= 1
    path.write_bytes(content)
    with pytest.raises(FileError, match="cubic: its checksum is wrong: the file was damaged"):
        ReducedModel.load(path)
    with pytest.raises(OSError), h5py.File(path) as file:  # so does any other reader
        file["cubic"][()]


def test_changed_bytes_are_an_error_or_harmless_and_need_no_memory(tmp_path, make_model):
    path = tmp_path / "rom.h5"
    make_model(2).save(path)
    good = path.read_bytes()
    rng = np.random.default_rng(7)
    ReducedModel.load(path)
    tracemalloc.start()
    for _ in range(MUTANTS):
        content = np.frombuffer(good, np.uint8).copy()
        at = rng.integers(len(good), size=rng.integers(1, 9))
        content[at] = rng.choice([0, 1, 64, 128, 255], size=len(at))
        path.write_bytes(content.tobytes())
        try:
            ReducedModel.load(path)
        except NanoromError as error:
            assert "\n" not in str(error)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < LEAST_READ


def test_cut_file_is_an_error_at_any_length(tmp_path, make_model):
    path = tmp_path / "rom.h5"
    make_model(2).save(path)
    good = path.read_bytes()
    for length in range(0, len(good), 997):
        path.write_bytes(good[:length])
        with pytest.raises(FileError, match="not an HDF5 file, or cut short"):
            ReducedModel.load(path)


def test_bytes_that_are_read_again_and_again_are_counted(tmp_path):
    def many_names_of_one_array(file):
        file["level/0"] = np.zeros(10_000)
        for n in range(1, 2000):
            file[f"level/{n}"] = file["level/0"]

    path = written(tmp_path / "a.h5", many_names_of_one_array)
    with pytest.raises(FileError, match="holds more than a file of"):
        with hdf5.opened(path, KIND, 1) as file:
            for n in range(2000):
                hdf5.read(file, f"level/{n}", (10_000,))


def test_array_that_unpacks_to_more_than_its_file_can_hold_is_refused(tmp_path):
    count = LEAST_READ // 4  # twice what is read of a small file
    path = written(
        tmp_path / "a.h5",
        lambda f: f.create_dataset("a", data=np.zeros(count), compression="gzip", chunks=(count,)),
    )
    assert PER_BYTE * path.stat().st_size < 8 * count
    with pytest.raises(FileError, match="a: holds more than a file of"):
        with hdf5.opened(path, KIND, 1) as file:
            hdf5.read(file, "a", (None,))


def test_other_forms_of_hdf5_are_named(tmp_path):
    path = tmp_path / "new.h5"
    with h5py.File(path, "w", libver="latest") as file:
        file.attrs.update(format=KIND, format_version=1)
    with pytest.raises(FileError, match="a form of HDF5 that nanorom does not read; save it again"):
        ReducedModel.load(path)


def test_group_that_leads_back_to_itself_is_read_once(tmp_path):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file.attrs.update(format=KIND, format_version=1)
        file["g/again"] = file["/"]
    with hdf5.opened(path, KIND, 1) as file:
        assert hdf5.group(file, "g/again/g/again") is file
