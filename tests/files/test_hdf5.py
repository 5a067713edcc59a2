"""HDF5 files from strangers: what is damaged is refused, and takes no more than a file can hold."""

import h5py
import numpy as np
import pytest

from nanorom.errors import FileError, NanoromError
from nanorom.files import hdf5, untrusted
from nanorom.rom.model import ReducedModel

KIND = "nanorom-rom"
MUTANTS = 20  # files with changed bytes; each takes a process of its own
CUTS = 7  # files that end too early


def written(path, fill, **options):
    with h5py.File(path, "w", **options) as file:
        file.attrs.update(format=KIND, format_version=1)
        fill(file)
    return path


def test_attributes_are_read_as_they_were_written(tmp_path):
    values = {f"number {n}": n / 3 for n in range(50)}
    values |= {"text": "é" * 3000, "flag": True, "array": np.arange(4.0), "none": ""}
    path = written(tmp_path / "a.h5", lambda f: f.create_group("g").attrs.update(values))
    with hdf5.opened(path, KIND, 1) as file:
        found = hdf5.read_attributes(hdf5.group(file, "g"))
    assert found.keys() == values.keys()
    assert all(np.array_equal(found[name], value) for name, value in values.items())


def test_model_saved_again_by_others_is_read(tmp_path, make_model):
    """In the newest form of HDF5, packed, and names of any length."""
    path, again = tmp_path / "rom.h5", tmp_path / "again.h5"
    model = make_model(3)
    model.save(path)
    with h5py.File(path) as file, h5py.File(again, "w", libver="latest") as new:
        new.attrs.update(file.attrs)
        for name in file:
            file.copy(name, new)
        del new["cubic"], new["label"]
        new.create_dataset("cubic", data=model.cubic, compression="gzip", shuffle=True)
        new["label"] = list(model.label)
    found = ReducedModel.load(again)
    assert np.array_equal(found.cubic, model.cubic) and found.label == model.label


def test_changed_number_is_found_by_its_checksum(tmp_path, make_model):
    path = tmp_path / "rom.h5"
    model = make_model(2)
    model.save(path)
    content = bytearray(path.read_bytes())
    content[content.index(model.cubic.tobytes()) + 5] ^= 1
    path.write_bytes(content)
    with pytest.raises(FileError, match="damaged"):
        ReducedModel.load(path)


def test_what_the_hdf5_library_may_not_survive_is_an_error(tmp_path):
    """A string's place in the heap of all strings, far beyond that heap: HDF5 1.10 crashes."""
    path = written(tmp_path / "rom.h5", lambda file: None)
    whole = path.read_bytes()
    # a string's length, the address of the heap and the number that it has there
    known = len(KIND).to_bytes(4, "little") + whole.index(b"GCOL").to_bytes(8, "little")
    place = whole.index(known) + len(known)
    path.write_bytes(whole[:place] + b"\xff\xff\xff\x7f" + whole[place + 4 :])
    with pytest.raises(FileError, match=r"rom.h5: (damaged|an HDF5 file of format)"):
        ReducedModel.load(path)


def test_changed_bytes_are_an_error_or_harmless(tmp_path, make_model):
    path = tmp_path / "rom.h5"
    make_model(2).save(path)
    good = path.read_bytes()
    rng = np.random.default_rng(7)
    for _ in range(MUTANTS):
        content = np.frombuffer(good, np.uint8).copy()
        at = rng.integers(len(good), size=rng.integers(1, 9))
        content[at] = rng.choice([0, 1, 64, 128, 255], size=len(at))
        path.write_bytes(content.tobytes())
        try:
            ReducedModel.load(path)
        except NanoromError as error:
            assert "\n" not in str(error)


def test_cut_file_is_an_error_at_any_length(tmp_path, make_model):
    path = tmp_path / "rom.h5"
    make_model(2).save(path)
    good = path.read_bytes()
    for length in np.linspace(0, len(good) - 1, CUTS, dtype=int):
        path.write_bytes(good[:length])
        with pytest.raises(FileError, match="not an HDF5 file, or cut short"):
            ReducedModel.load(path)


def test_scene_in_place_of_a_result_is_told_what_makes_results(tmp_path):
    path = tmp_path / "drum.toml"
    path.write_text("[geometry]\n")
    with pytest.raises(FileError, match="nanorom run SCENE -o DIR"):
        ReducedModel.load(path)


def test_many_names_of_one_array_are_counted(tmp_path):
    def fill(file):
        file["level/0"] = np.zeros(10_000)
        for n in range(1, 2000):
            file[f"level/{n}"] = file["level/0"]

    path = written(tmp_path / "a.h5", fill)
    with pytest.raises(FileError, match=r"level/\d+: with it, more is read than a file of"):
        with hdf5.opened(path, KIND, 1) as file:
            for n in range(2000):
                hdf5.read(file, f"level/{n}", (10_000,))


def test_array_that_unpacks_to_more_than_its_file_can_hold_is_refused(tmp_path):
    count = untrusted.SMALL // 4  # twice what is read of a small file
    path = written(
        tmp_path / "a.h5",
        lambda f: f.create_dataset("a", data=np.zeros(count), compression="gzip", chunks=(count,)),
    )
    assert untrusted.PER_BYTE * path.stat().st_size < 8 * count
    with pytest.raises(FileError, match="a: declares"):
        with hdf5.opened(path, KIND, 1) as file:
            hdf5.read(file, "a", (None,))


def test_only_the_process_that_tries_a_file_is_lost(tmp_path, monkeypatch):
    monkeypatch.setattr(untrusted, "PROGRAM", "import os; os.abort()")
    path = written(tmp_path / "a.h5", lambda file: None)
    with pytest.raises(FileError, match="a.h5: damaged: the HDF5 library crashes on it"):
        ReducedModel.load(path)


def test_group_that_leads_back_to_itself_is_read_once(tmp_path):
    path = written(tmp_path / "a.h5", lambda file: file.__setitem__("g/again", file["/"]))
    with hdf5.opened(path, KIND, 1) as file:
        assert hdf5.group(file, "g/again/g/again") == file


def test_array_in_a_chunk_larger_than_itself_is_refused(tmp_path):
    """HDF5 unpacks whole chunks."""
    count = untrusted.SMALL // 4

    def fill(file):
        options = {"chunks": (count,), "maxshape": (None,), "compression": "gzip"}
        file.create_dataset("a", data=np.zeros(count), **options).resize((10,))

    path = written(tmp_path / "a.h5", fill)
    assert untrusted.PER_BYTE * path.stat().st_size < 8 * count
    with pytest.raises(FileError, match="a: declares"):
        with hdf5.opened(path, KIND, 1) as file:
            hdf5.read(file, "a", (10,))


def test_no_program_beside_the_file_is_run(tmp_path, monkeypatch):
    (tmp_path / "h5py.py").write_text("open('run', 'w')")
    monkeypatch.chdir(tmp_path)
    untrusted.survive(written(tmp_path / "a.h5", lambda file: None))
    assert not (tmp_path / "run").exists()
