"""Models and responses that are damaged or forged: one line, status 1, nothing written."""

import h5py
import numpy as np
import pytest

from tests.cli.bad import SWEEP


def drop(name):
    return lambda file: file.__delitem__(name)


def put(name, value, **options):
    def change(file):
        del file[name]
        file.create_dataset(name, data=value, **options)

    return change


def attribute(name, value, group="/"):
    return lambda file: file[group].attrs.__setitem__(name, value)


def declared(name, shape, dtype=float, **options):
    def change(file):
        del file[name]
        file.create_dataset(name, shape=shape, dtype=dtype, **options)

    return change


def linked(name, target):
    def change(file):
        del file[name]
        file[name] = target

    return change


def virtual(file):
    layout = h5py.VirtualLayout(shape=(2,), dtype=float)
    layout[:] = h5py.VirtualSource("/etc/hostname", "mass", shape=(2,))
    del file["mass"]
    file.create_virtual_dataset("mass", layout)


def pickled(file):
    del file["mass"]
    file.create_dataset("mass", data=np.void(b"\x80\x04cos\nsystem\n(S'touch pwned'\ntR."))


ROMS = {
    "no frequency": (drop("frequency"), "frequency: missing"),
    "no shapes values": (drop("shapes/values"), "shapes/values: missing"),
    "scalar cubic": (put("cubic", 1.0), r"cubic: found shape \(\)"),
    "text cubic": (put("cubic", "1"), "cubic: found shape"),
    "complex mass": (put("mass", [1j, 1.0]), "mass: found type complex128"),
    "references": (declared("mass", (2,), dtype=h5py.ref_dtype), "mass: found type"),
    "not written": (declared("mass", (2,)), "mass, frequency: found a value"),
    "vlen": (put("mass", np.array([np.ones(2), np.ones(3)], object),
                 dtype=h5py.vlen_dtype(float)), "mass: found type object"),
    "compound": (put("mass", np.zeros(2, [("a", float)])), "mass: found type"),
    "opaque": (pickled, "mass: found shape|mass: found type"),
    "infinite stiffness": (put("stiffness", np.full((2, 2), np.inf)), "stiffness: contains NaN"),
    "negative frequency": (put("frequency", [-1.0, 1.0]), "not greater than 0"),
    "not sorted": (put("frequency", [2.0, 1.0]), "frequency: not sorted"),
    "number twice": (put("number", [1, 1]), "number: found a mode number"),
    "fractional number": (put("number", [1.5, 2.5]), "whole numbers"),
    "not symmetric": (put("stiffness", [[1.0, 2.0], [0.0, 1.0]]), "stiffness: the matrix is not"),
    "drive is data": (linked("drive", h5py.SoftLink("/mass")), "drive: missing, or not a group"),
    "external link": (linked("mass", h5py.ExternalLink("/etc/passwd", "/")), "mass: missing"),
    "soft link": (linked("mass", h5py.SoftLink("/frequency")), "mass: missing, or not"),
    "circle": (linked("mass", h5py.SoftLink("/mass")), "mass: missing, or not"),
    "group": (linked("shapes", h5py.SoftLink("/")), "shapes.*missing"),
    "outside": (declared("mass", (2,), external=[("/dev/zero", 0, 16)]), "outside the file"),
    "virtual": (virtual, "mass: its numbers are outside the file"),
    "sparse bomb": (declared("shapes/points", (10**8, 3), chunks=(10**4, 3)), "points: declares"),
    "zip bomb": (declared("shapes/points", (10**7, 3), chunks=(10**5, 3), compression="gzip",
                          fillvalue=1.0), "points: declares"),
    "huge": (declared("shapes/points", (10**15, 3), chunks=(10**5, 3)), "points: declares"),
    "many labels": (put("label", ["f"] * 3), "label: found shape"),
    "binary label": (put("label", [b"\xff\xfe", b"f"]), "damaged|label"),
    "label of references": (declared("label", (2,), dtype=h5py.ref_dtype), "label: found type"),
    "label of arrays": (put("label", np.array([np.ones(2), np.ones(3)], object),
                            dtype=h5py.vlen_dtype(float)), "label: found type"),
    "reference attribute": (lambda f: f["diagnostics"].attrs.__setitem__("x", f["mass"].ref),
                            "x: found type Reference"),
    "empty attribute": (attribute("asymmetry", h5py.Empty("f"), "diagnostics"), "asymmetry: found"),
    "NaN asymmetry": (attribute("asymmetry", np.nan, "diagnostics"), "deviate from a potential"),
    "deep JSON": (attribute("x", "{" + '"a":{' * 5000, "diagnostics"), "damaged"),
    "long JSON number": (attribute("x", '{"a":' + "9" * 5000 + "}", "diagnostics"), "damaged"),
    "no version": (lambda f: f.attrs.__delitem__("format_version"), "format_version: found None"),
    "version 0": (attribute("format_version", 0), "format_version: found 0"),
    "versions": (attribute("format_version", [1, 1]), "format_version: found"),
    "format is a number": (attribute("format", 3), "not an HDF5|format '3'"),
    "other normalisation": (attribute("normalization", "mass"), "normalization: found 'mass'"),
}  # fmt: skip


@pytest.mark.parametrize("name", ROMS)
def test_unsound_model_is_refused(tmp_path, refused, make_model, name):
    damage, message = ROMS[name]
    make_model(2).save(tmp_path / "rom.h5")
    with h5py.File(tmp_path / "rom.h5", "r+") as file:
        damage(file)
    (tmp_path / "sweep.toml").write_text(SWEEP)
    refused("respond rom.h5 sweep.toml -o response.h5", message)


RESPONSES = {
    "no levels": (drop("level"), "level: missing"),
    "level gone": (drop("level/0"), "level/0: missing"),
    "label": (put("label", ["a", "b", "c"]), "label: found shape"),
    "excitation": (attribute("excitation", SWEEP.replace("1 mPa", "1 m")), "drive.direct"),
    "other keys": (attribute("excitation", SWEEP + "[geometry]"), "geometry: unknown section"),
    "excitation is a number": (attribute("excitation", 3), "not valid TOML"),
    "many branches": (attribute("branches", 10**6, "level/0"), "branches: found"),
    "branch gone": (attribute("branches", 7, "level/0"), "branch.*missing"),
    "parent": (attribute("parent", 99, "level/0/branch/0"), "parent: found 99"),
    "period": (attribute("period_multiple", 0, "level/0/branch/0"), "period_multiple: found"),
    "no direct": (lambda f: f["level/0"].attrs.__delitem__("direct"), "damaged"),
    "direct": (attribute("direct", np.nan, "level/0"), "direct: found"),
    "multipliers": (put("level/0/branch/0/multipliers", [1.0]), "multipliers: found"),
    "rows": (lambda f: f["level/0/branch/0/rows"].__setitem__(0, 2**62), "coefficients: found sha"),
    "no rows": (lambda f: f["level/0/branch/0/rows"].__setitem__(0, -3), "rows: an orbit"),
    "omega": (declared("level/0/branch/0/omega", (10**9,), chunks=(10**5,)), "omega: declares"),
    "types": (put("level/0/special_points/type", ["XX"]), "found type 'XX'"),
    "linked level": (linked("level/0", h5py.ExternalLink("other.h5", "/level/0")), "level/0: mis"),
}  # fmt: skip


@pytest.mark.parametrize("name", RESPONSES)
def test_unsound_response_is_refused(tmp_path, refused, response, name):
    damage, message = RESPONSES[name]
    (tmp_path / "response.h5").write_bytes(response)
    with h5py.File(tmp_path / "response.h5", "r+") as file:
        damage(file)
    refused("plot response.h5", message)
