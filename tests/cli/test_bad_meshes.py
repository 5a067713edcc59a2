"""Meshes that are no film: one line that names the cause, status 1, nothing written."""

import numpy as np
import pytest

from nanorom.cli.main import main
from tests.cli.bad import write

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
    "no-surface.geo": ("Point(1) = {0, 0, 0, 1};\n", "no surface"),
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
