"""Files that must not be accepted: one line that names the cause, status 1, nothing written."""

import re

import h5py
import numpy as np
import pytest

from nanorom.cli.main import main

SWEEP = '[drive]\ndirect = "1 mPa"\n[sweep]\nfrom = "0.98 f1"\nto = "1.02 f1"\n'
SQUARE = [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1)]  # two unit squares side by side
FOUR = [(1, 2, 5), (1, 5, 4), (2, 3, 6), (2, 6, 5)]
AROUND = [(1, 2), (2, 3), (3, 6), (6, 5), (5, 4), (4, 1)]


def msh(nodes=SQUARE, cells=FOUR, lines=AROUND, name='"edge"', version="2.2", kind=2):
    """A mesh in gmsh's format 2.2."""
    rows = [f"{n} {' '.join(map(str, [*xy, 0][:3]))}" for n, xy in enumerate(nodes, 1)]
    elements = [f"1 2 1 1 {a} {b}" for a, b in lines]
    elements += [f"{kind} 2 2 2 {' '.join(map(str, c))}" for c in cells]
    names = [f"1 1 {name}", '2 2 "film"'] if name else ['2 2 "film"']
    return "\n".join(
        ["$MeshFormat", f"{version} 0 8", "$EndMeshFormat"]
        + ["$PhysicalNames", str(len(names)), *names, "$EndPhysicalNames"]
        + ["$Nodes", str(len(rows)), *rows, "$EndNodes", "$Elements", str(len(elements))]
        + [f"{n} {element}" for n, element in enumerate(elements, 1)]
        + ["$EndElements", ""]
    )


def geo(before="", after=""):
    return (
        f"{before}\nPoint(1) = {{0, 0, 0, 1}}; Point(2) = {{1, 0, 0, 1}};"
        "Point(3) = {0, 1, 0, 1}; Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 1};\n"
        "Curve Loop(1) = {1, 2, 3}; Plane Surface(1) = {1};\n"
        f'Physical Curve("edge") = {{1, 2, 3}}; Physical Surface("film") = {{1}};\n{after}\n'
    )


RANDOM = np.random.default_rng(1).bytes(3000)
FAR = [(x + 5, y) for x, y in SQUARE]
TWO = [*FOUR, *[tuple(n + 6 for n in cell) for cell in FOUR]]

MESHES = {
    "empty.msh": ("", "must begin with \\$MeshFormat"),
    "text.msh": ("not a mesh\n", "must begin with \\$MeshFormat"),
    "binary.msh": (RANDOM, "must begin with \\$MeshFormat"),
    "script.msh": (geo('SystemCall "touch pwned";'), "must begin with \\$MeshFormat"),
    "version.msh": (msh(version="9.9"), "gmsh cannot mesh it"),
    "garbage.msh": (msh().encode()[:120] + RANDOM, "gmsh cannot mesh it|damaged|no surface"),
    "cut.msh": (msh()[:260], "gmsh cannot mesh it|no surface|damaged"),
    "unknown-node.msh": (msh(cells=[(1, 2, 99), *FOUR]), "gmsh cannot mesh it|damaged"),
    "negative-node.msh": (msh(cells=[(1, 2, -1), *FOUR]), "gmsh cannot mesh it|damaged"),
    "many-nodes.msh": (msh().replace("$Nodes\n6", "$Nodes\n99999999999"), "gmsh|damaged"),
    "nan.msh": (msh(nodes=[("nan", 0), *SQUARE[1:]]), "not finite|gmsh cannot"),
    "quads.msh": (msh(cells=[(1, 2, 5, 4), (2, 3, 6, 5)], kind=3), "Quadrilateral 4; give triang"),
    "mixed.msh": (msh() .replace('$Elements\n10', '$Elements\n11').replace(
        "$EndElements", "11 3 2 2 2 1 2 5 4\n$EndElements"), "several kinds"),
    "lines.msh": (msh(cells=[]), "no triangles|no surface"),
    "solid.msh": (msh(nodes=[(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], lines=[(1, 2)],
                      cells=[(1, 2, 3, 4)], kind=4), "no triangles|no surface"),
    "bent.msh": (msh(nodes=[*SQUARE[:5], (2, 1, 1)]), "not flat"),
    "inverted.msh": (msh(cells=[(1, 5, 2), *FOUR[1:]]), "1 of 4 triangles are inverted"),
    "flat.msh": (msh(cells=[*FOUR, (1, 2, 3)]), "1 of 5 triangles have no area"),
    "parts.msh": (msh(nodes=SQUARE + FAR, cells=TWO), "2 separate parts"),
    "twice.msh": (msh(cells=[*FOUR, FOUR[0]]), "more than two triangles"),
    "overlap.msh": (msh(nodes=[*SQUARE, (0.5, 0.9)], cells=[*FOUR, (1, 2, 7)]), "open|physical"),
    "untagged.msh": (msh(lines=[], name=None), "no boundary of the mesh is held|physical"),
    "open.msh": (msh(lines=AROUND[:4]), "2 of 6 .*no physical curve"),
    "inside.msh": (msh(lines=[*AROUND, (2, 5)]), "inside the film"),
    "no-surface.geo": ("Point(1) = {0, 0, 0, 1};", "no surface"),
    "syntax.geo": (geo("Point(1 = {0};"), "syntax error"),
    "binary.geo": (RANDOM, "not text"),
    "command.geo": (geo('SystemCall "touch pwned";'), "line 1: found SystemCall"),
    "later.geo": (geo("", "/* a\n b */ NonBlockingSystemCall 'touch pwned';"),
                  "line 6: found NonBlockingSystemCall"),
    "hidden.geo": (geo('s = "//"; SystemCall "touch pwned";'), "line 1: found SystemCall"),
    "hidden-too.geo": (geo('s = "/*"; SystemCall "touch pwned"; t = "*/";'), "found SystemCall"),
    "write.geo": (geo('Printf("x") > "pwned";'), "Printf to a file"),
    "save.geo": (geo("", 'Save "pwned.msh";'), "found Save"),
    "include.geo": (geo('Include "other.geo";'), "found Include"),
    "field.geo": (geo("", 'Field[1] = ExternalProcess; Field[1].CommandLine = "touch pwned";'
                      " Background Field = 1;"), "line 5: found ExternalProcess"),
    "field-file.geo": (geo("", 'Field[1] = Structured; Field[1].FileName = "/dev/zero";'),
                       "line 5: found FileName"),
    "exit.geo": (geo("", "Exit;"), "found Exit"),
}  # fmt: skip

MESH_SCENE = """
[geometry]
shape = "mesh"
file = "FILE"
scale = "1 um"
[plate]
thickness = "10 nm"
[material]
youngs_modulus = "410 GPa"
poisson_ratio = 0.16
density = 2267
[tension]
value = 0.3
[modes]
count = 1
[accuracy]
degree = 4
mesh_size = "1 um"
"""


@pytest.fixture
def refused(tmp_path, monkeypatch, capfd):
    """A function (command, message): one line, status 1, nothing new, nothing changed."""
    monkeypatch.chdir(tmp_path)

    def check(command, message):
        before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
        status = main(command.split())
        output, error = capfd.readouterr()
        assert status == 1, output
        assert re.fullmatch(r"nanorom: error: [^\n]+\n", error), error
        assert re.search(message, error), error
        assert "unexpected" not in error
        assert len(error) < 500
        after = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
        assert after == before

    return check


def write(path, content):
    path.write_bytes(content if isinstance(content, bytes) else content.encode())


@pytest.mark.parametrize("name", MESHES)
def test_mesh_that_is_no_film_is_refused(tmp_path, refused, name):
    content, message = MESHES[name]
    write(tmp_path / name, content)
    (tmp_path / "scene.toml").write_text(MESH_SCENE.replace("FILE", name))
    (tmp_path / "rom.h5").write_bytes(b"an earlier result")
    refused("reduce scene.toml -o rom.h5", message)


def test_the_mesh_that_the_others_are_made_from_is_accepted(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "good.msh").write_text(msh())
    (tmp_path / "good.geo").write_text(geo("// SystemCall", 'Mesh.SaveAll = 1; Printf("x");'))
    for name in ("good.msh", "good.geo"):
        (tmp_path / "scene.toml").write_text(MESH_SCENE.replace("FILE", name))
        assert main(["reduce", "scene.toml", "-o", "rom.h5"]) == 0, capfd.readouterr().err


@pytest.mark.parametrize(
    ("support", "message"),
    [
        ('{ rim = "clamped" }', "support.rim: the mesh has no boundary of that name; allowed"),
        ('{ edge = "free", rim = "clamped" }', "support.rim: the mesh has no boundary"),
        ('{ default = "free", edge = "free" }', "hold at least one side"),
        ('{ film = "clamped" }', "support.film: the mesh has no boundary of that name"),
    ],
)
def test_names_that_the_mesh_does_not_have_are_refused(tmp_path, refused, support, message):
    (tmp_path / "film.msh").write_text(msh())
    scene = MESH_SCENE.replace("FILE", "film.msh") + f"[support]\nedge = {support}\n"
    (tmp_path / "scene.toml").write_text(scene)
    refused("reduce scene.toml -o rom.h5", message)


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


@pytest.fixture(scope="module")
def response(tmp_path_factory, make_model):
    """A response of one level."""
    folder = tmp_path_factory.mktemp("response")
    cubic = np.zeros((2, 2, 2, 2))
    make_model(2, quadratic=np.zeros((2, 2, 2)), cubic=cubic).save(folder / "rom.h5")
    (folder / "sweep.toml").write_text(SWEEP)
    command = f"respond {folder}/rom.h5 {folder}/sweep.toml -o {folder}/response.h5"
    assert main(command.split()) == 0
    return (folder / "response.h5").read_bytes()


@pytest.mark.parametrize("name", RESPONSES)
def test_unsound_response_is_refused(tmp_path, refused, response, name):
    damage, message = RESPONSES[name]
    (tmp_path / "response.h5").write_bytes(response)
    with h5py.File(tmp_path / "response.h5", "r+") as file:
        damage(file)
    refused("plot response.h5", message)


TABLES = {
    "": "found no data",
    "frequency\n": "found no data",
    "g\n1 MHz\n": "found no column 'frequency'",
    "frequency\nfast\n": "line 2, frequency: found 'fast'",
    "frequency\n1 kg\n": "of another dimension",
    "frequency\n1 MHz\n-1 MHz\n2 MHz\n": "not greater than 0",
    "frequency\n1 MHz\nnan\n2 MHz\n": "need at least as many frequencies; found 2",
    "frequency\n1e400 Hz\n": "finite",
    "frequency\n1 MHz\n\n": "need at least as many",
    "frequency\n,\n": "frequency: found no number",
    "frequency (parsnips)\n1\n": "unknown unit",
    "frequency,label\n1 MHz,f01\n2 MHz,f01\n": "label: found 'f01' more than once",
    "frequency,uncertainty\n1 MHz,0\n": "line 2, uncertainty: found 0; allowed: greater than 0",
    "frequency,uncertainty\n1 MHz,\n": "line 2, uncertainty",
    'frequency\n"1 MHz\n': "need at least as many",
    "frequency\n" + "9" * 200_000 + "\n": "line 2|not a table",
    "frequency,label\n1 MHz,f01\n2 MHz,f02\n3 MHz,f99\n": "f99",
    b"\xff\xfe\x00": "found no data",
    b"\x00" * 100: "not a table of text",
}


@pytest.mark.parametrize("content", TABLES, ids=lambda content: repr(content)[:30])
def test_unsound_table_of_resonances_is_refused(tmp_path, refused, drum_toml, content):
    write(tmp_path / "measured.csv", content)
    (tmp_path / "scene.toml").write_text(drum_toml)
    refused("identify scene.toml measured.csv -o results", TABLES[content])


MEASURED = {
    "": "found no data",
    "frequency (MHz)\n20\n": "found no column 'amplitude'",
    "frequency (MHz),amplitude\n20,1\n": "amplitude: found no unit",
    "frequency (MHz),amplitude (nm)\n20,much\n": "line 2, amplitude: found 'much'",
    "frequency (MHz),amplitude (mV)\n20,nan\n": "no row has both",
    "frequency (MHz),amplitude (nm)\n0,1\n": "not greater than 0",
    "frequency (MHz),amplitude (nm),sweep\n20,1,left\n": "sweep: found 'left'; allowed: up, down",
    "frequency (Hz),amplitude (nm)\n20,1\n": "none of the frequencies",
}


@pytest.mark.parametrize("content", MEASURED, ids=lambda content: repr(content)[-30:])
def test_unsound_measured_response_is_refused(tmp_path, refused, response, content):
    write(tmp_path / "response.h5", response)
    write(tmp_path / "measured.csv", content)
    refused("plot response.h5 --data measured.csv -o pictures", MEASURED[content])


PROFILES = {
    "": "not three columns|not a table",
    "1 2 3\n": "not three columns",
    "0 0\n1 0\n0 1\n": "not three columns",
    "0 0 nan\n1 0 0\n0 1 0\n": "not three columns of finite",
    "a b c\n": "not a table of numbers",
    "0 0 0\n1 0\n": "not a table of numbers",
    "0 0 0\n1e-6 0 0\n2e-6 0 0\n": "on a line",
    "0 0 0\n1e-6 0 0\n0 1e-6 0\n": "do not cover the film",
    b"\x00\xff" * 50: "not a table of numbers",
}


@pytest.mark.parametrize("content", PROFILES, ids=lambda content: repr(content)[:30])
def test_unsound_initial_shape_is_refused(tmp_path, refused, drum_toml, content):
    write(tmp_path / "shape.txt", content)
    scene = drum_toml.replace('"10 nm"', '"10 nm"\ninitial_shape = "shape.txt"')
    rough = '[accuracy]\ndegree = 2\nmesh_size = "2 um"\n'
    (tmp_path / "scene.toml").write_text(scene + rough)
    refused("reduce scene.toml -o rom.h5", PROFILES[content])


SWEEPS = {
    "": "drive: missing section",
    "[drive]\ndirect = 1\n": "sweep: missing section",
    SWEEP + "[geometry]\n": "geometry: unknown section",
    SWEEP.replace("direct", "driect"): 'did you mean "direct"',
    SWEEP.replace('"1 mPa"', "[]"): "at least one",
    SWEEP.replace('"1 mPa"', f"{[1] * 101}"): "at most 100",
    SWEEP.replace('"1 mPa"', '["1 mPa", "1 mN"]'): r"drive.direct\[2\]: found '1 mN'",
    SWEEP.replace('"1 mPa"', '"1 mPa"\nparametric = [1, 2]\ndirect_pattern = "spot"'): "position",
    SWEEP.replace("0.98 f1", "__import__('os').system('touch pwned') f1"): "sweep.from: found",
    SWEEP.replace("0.98 f1", "f1"): "sweep.from: found 'f1'",
    SWEEP.replace("0.98 f1", "9" * 50_000 + " f1"): "sweep.from: found",
    SWEEP.replace("0.98 f1", "1e9 f1"): "sweep.from",
    SWEEP.replace("1.02 f1", "inf"): "sweep.to: found",
    b"\xff\xfe\x00": "not a text file",
    "a = " + "[" * 100_000: "not valid TOML: nested too deeply",
    "a = " + "9" * 5000: "not valid TOML: an integer of thousands of digits",
    SWEEP.replace("direct", '"\\u001b[31m"'): r"drive.\?\[31m: unknown key",
}


@pytest.mark.parametrize("content", SWEEPS, ids=lambda content: repr(content)[:40])
def test_unsound_drive_is_refused(tmp_path, refused, make_model, content):
    write(tmp_path / "sweep.toml", content)
    make_model(2).save(tmp_path / "rom.h5")
    refused("respond rom.h5 sweep.toml -o response.h5", SWEEPS[content])
