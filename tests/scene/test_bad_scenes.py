"""A corpus of scenes that must not validate: each is the drum with one thing changed."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nanorom.errors import SceneError
from nanorom.scene.scene import Scene

MESH = 'shape = "mesh"\nfile = '

# what is replaced, by what, how the message begins, what it must mention
CORPUS = [
    ('"2.5 um"', '"2.5 kg"', "geometry.radius", "another dimension"),
    ('"2.5 um"', '"-2.5 um"', "geometry.radius", "greater than 0"),
    ('"2.5 um"', "0", "geometry.radius", "greater than 0"),
    ('"2.5 um"', "nan", "geometry.radius", "finite"),
    ('"2.5 um"', "inf", "geometry.radius", "finite"),
    ('"2.5 um"', '"2.5"', "geometry.radius", "without a unit"),
    ('"2.5 um"', '"2.5 parsnips"', "geometry.radius", "unknown unit"),
    ('"2.5 um"', '"2.5 parsnips"', "geometry.radius", "allowed: a length"),
    ('"2.5 um"', "true", "geometry.radius", "a length"),
    ('"2.5 um"', "[1, 2]", "geometry.radius", "a length"),
    ('"2.5 um"', "1979-05-27", "geometry.radius", "a length"),
    ("radius", "raduis", "geometry.raduis", 'did you mean "radius"'),
    ("radius", "length", "geometry.length", "allowed: radius"),
    ('radius = "2.5 um"', "", "geometry.radius", "missing"),
    ('shape = "disc"', 'shape = "disk"', "geometry.shape", 'did you mean "disc"'),
    ('shape = "disc"', "", "geometry.shape", "disc | rectangle | string | mesh"),
    ('shape = "disc"', "shape = 3", "geometry.shape", "disc | rectangle"),
    ('shape = "disc"', 'shape = "rectangle"', "geometry.radius", "allowed: length, width"),
    ('shape = "disc"\nradius = "2.5 um"', MESH + '"none.msh"', "geometry.file", "no such file"),
    ('shape = "disc"\nradius = "2.5 um"', MESH + '"none.stl"', "geometry.file", ".msh or .geo"),
    ('shape = "disc"\nradius = "2.5 um"', MESH + '""', "geometry.file", ".msh or .geo"),
    ('shape = "disc"\nradius = "2.5 um"', MESH + "3", "geometry.file", ".msh or .geo"),
    (
        'shape = "disc"\nradius = "2.5 um"',
        'shape = "string"\nlength = "1 um"\nwidth = "2 um"',
        "geometry.width",
        "at most the length",
    ),
    ('"10 nm"', '"-10 nm"', "plate.thickness", "greater than 0"),
    ('"10 nm"', '"10 nm"\nmodel = "brick"', "plate.model", "auto | membrane | plate"),
    ('"10 nm"', '"10 nm"\nmodel = "Plate"', "plate.model", 'did you mean "plate"'),
    ("[plate]", "[plates]", "plates", 'did you mean "plate"'),
    ('[plate]\nthickness = "10 nm"', "", "plate", "missing section"),
    ('[plate]\nthickness = "10 nm"', "[[plate]]\nthickness = 1e-8", "plate", "a table"),
    ('"410 GPa"', '"410 N/m"', "material.youngs_modulus", "a pressure"),
    ('youngs_modulus = "410 GPa"', "", "material.youngs_modulus", "missing"),
    ("youngs_modulus", "young_modulus", "material.young_modulus", 'did you mean "youngs_modulus"'),
    ("0.16", "0.5", "material.poisson_ratio", "less than 0.5"),
    ("0.16", "-1", "material.poisson_ratio", "greater than -1"),
    ("0.16", '"0.16 m"', "material.poisson_ratio", "plain number"),
    ("0.16", "true", "material.poisson_ratio", "plain number"),
    ("0.16", "0.16\nloss = -1e-4", "material.loss", "0 or more"),
    ("0.16", "0.16\nloss = 1", "material.loss", "less than 1"),
    ("0.16", '0.16\nexpansion = "1e-6 1/K"', "material.conductivity", "missing"),
    ("0.16", '0.16\nexpansion = "1e-6 K"', "material.expansion", "another dimension"),
    ("[modes]", '[gas]\npressure = "-1 Pa"\n[modes]', "gas.pressure", "greater than 0"),
    ("[modes]", '[gas]\ntemperature = "20 degC"\n[modes]', "gas.pressure", "missing"),
    ("quality_factor = 180", "", "damping.quality_factor", "missing"),
    ('"2267 kg/m^3"', '"2267 kg/m^2"', "material.density", "a density"),
    ('"2267 kg/m^3"', "0", "material.density", "greater than 0"),
    ('y = "0.257 N/m"', "", "tension", "x and y"),
    ('y = "0.257 N/m"', 'value = "0.3 N/m"', "tension", "found value and x"),
    ('y = "0.257 N/m"', 'z = "0.3 N/m"', "tension.z", "unknown key"),
    ('"0.257 N/m"', '"0.257 N"', "tension.y", "a tension"),
    ('x = "0.321 N/m"\ny = "0.257 N/m"', "", "tension", "found no key"),
    ('x = "0.321 N/m"\ny = "0.257 N/m"', 'stress = "1 N/m"', "tension.stress", "a pressure"),
    ('edge = "clamped"', 'edge = "clampd"', "support.edge", 'did you mean "clamped"'),
    ('edge = "clamped"', 'edge = "free"', "support.edge", "hold at least one side"),
    ('edge = "clamped"', 'edge = { w = "clamped" }', "support.edge.in_plane", "missing"),
    (
        'edge = "clamped"',
        'edge = { w = "clamped", in_plane = "loose" }',
        "support.in_plane",
        "normal",
    ),
    ('edge = "clamped"', 'edge = { w = "glued", in_plane = "free" }', "support.w", "clamped"),
    (
        'edge = "clamped"',
        'edge = { w = "clamped", in_plane = { normal = "1 N" } }',
        "support.in_plane.normal",
        "stiffness",
    ),
    ('y = "0.257 N/m"', 'y = 0.2\nxy = "1 N"', "tension.xy", "a tension"),
    ('edge = "clamped"', "edge = 1", "support.edge", "clamped | simply_supported | free"),
    ('edge = "clamped"', "edge = {}", "support.edge", "table of sides"),
    ('edge = "clamped"', 'edge = { left = "clamped" }', "support.left", "unknown side of a disc"),
    ('edge = "clamped"', 'edge = { edge = "free" }', "support.edge", "hold at least one side"),
    ('edge = "clamped"', 'edge = { edge = "glued" }', "support.edge", "clamped"),
    ('edge = "clamped"', 'sides = "clamped"', "support.sides", "unknown key"),
    ("count = 3", "count = 0", "modes.count", "1 to 100"),
    ("count = 3", "count = -3", "modes.count", "1 to 100"),
    ("count = 3", "count = 101", "modes.count", "1 to 100"),
    ("count = 3", "count = 3.0", "modes.count", "an integer"),
    ("count = 3", "count = true", "modes.count", "an integer"),
    ("count = 3", 'count = "3"', "modes.count", "an integer"),
    ("count = 3", "", "modes", "either count or select"),
    ("count = 3", "count = 3\nselect = [1]", "modes", "either count or select"),
    ("count = 3", "select = [1, 2, 1]", "modes.select", "twice"),
    ("count = 3", "select = [0]", "modes.select", "1 to 1000"),
    ("count = 3", "select = []", "modes.select", "a list"),
    ("count = 3", "select = 3", "modes.select", "a list"),
    ("count = 3", 'select = "1,2"', "modes.select", "a list"),
    ("count = 3", "select = [1.5]", "modes.select", "an integer"),
    ("[modes]", '[reduction]\nmethod = "stp"\n[modes]', "reduction.method", 'did you mean "step"'),
    ("[modes]", '[reduction]\nin_plane = "no"\n[modes]', "reduction.in_plane", "free | fixed"),
    ("[modes]", "[reduction]\namplitude = 0\n[modes]", "reduction.amplitude", "greater than 0"),
    ("[modes]", "[accuracy]\ntolerance = 0\n[modes]", "accuracy.tolerance", "greater than"),
    ("[modes]", "[accuracy]\ntolerance = 1\n[modes]", "accuracy.tolerance", "less than 1"),
    ("[modes]", "[accuracy]\ndegree = 4\n[modes]", "accuracy.mesh_size", "missing"),
    ("[modes]", "[accuracy]\nmesh_size = 1\n[modes]", "accuracy.degree", "missing"),
    ("[modes]", "[accuracy]\ndegree = 9\nmesh_size = 1\n[modes]", "accuracy.degree", "1 to 8"),
    (
        "[modes]",
        "[accuracy]\ntolerance = 1e-3\ndegree = 4\nmesh_size = 1\n[modes]",
        "accuracy.degree",
        "either tolerance",
    ),
    ("[modes]", '[laod]\npressure = "1 Pa"\n[modes]', "laod", "unknown section"),
    ("= 180", "= 0", "damping.quality_factor", "greater than 0"),
    ("= 180", "= [180, 180]", "damping.quality_factor", "one per mode"),
    ("= 180", "= []", "damping.quality_factor", "at least one"),
    ("= 180", "= [1, 2, -3]", "damping.quality_factor[3]", "greater than 0"),
    ("[damping]\nquality_factor = 180", "", "damping", "missing section"),
    ('"20 Pa"', '"20 N"', "drive.direct[2]", "a pressure"),
    ('"20 Pa"', '"-20 Pa"', "drive.direct[2]", "0 or more"),
    ('"20 Pa"]', '"20 Pa"]\nparametric = [1, 2, 3]', "drive", "lists of one length"),
    ('["5 Pa", "20 Pa"]', "0", "drive", "neither direct nor parametric"),
    ('["5 Pa", "20 Pa"]', "[]", "drive.direct", "at least one"),
    ('"20 Pa"]', '"20 Pa"]\ndirect_pattern = "lamp"', "drive.direct_pattern", "pressure"),
    ('"20 Pa"]', '"20 Pa"]\ndirect_pattern = "laser"', "drive.laser", "missing"),
    ('"20 Pa"]', '"20 Pa"]\nparametric = "1 Pa"', "drive.parametric", "a tension"),
    ('[sweep]\nfrom = "0.9 f1"\nto = "1.2 f1"', "", "sweep", "missing section"),
    ('"1.2 f1"', '"0.8 f1"', "sweep.to", "above sweep.from"),
    ('"1.2 f1"', '"1.2 f2"', "sweep.to", "multiple of the lowest frequency"),
    ('"1.2 f1"', '"-1.2 f1"', "sweep.to", "multiple of the lowest frequency"),
    ('"1.2 f1"', '"1e8 rad/s"', "sweep.to", "angular"),
    ('"0.9 f1"', "0", "sweep.from", "greater than 0"),
    ('to = "1.2 f1"', "", "sweep.to", "missing"),
    ('to = "1.2 f1"', 'to = "1.2 f1"\ndepth = -1', "sweep.depth", "0 to 5"),
    ("[geometry]", "[geometry", "not valid TOML", ""),
    ("[geometry]", "[geometry]\n[geometry]", "not valid TOML", ""),
    ("[geometry]", "geometry = 1\n[x]", "geometry", "a table"),
    ("0.16", "0.16\npoisson_ratio = 0.17", "not valid TOML", ""),
    ("0.16", "9" * 5000, "not valid TOML", ""),
    ("0.16", "[" * 5000, "not valid TOML", ""),
]


def changed(text, old, new):
    assert old in text
    return text.replace(old, new, 1)


@pytest.mark.parametrize(("old", "new", "begins", "mentions"), CORPUS)
def test_bad_scene_gives_one_line_that_names_the_key(drum_toml, old, new, begins, mentions):
    with pytest.raises(SceneError) as caught:
        Scene.from_toml(changed(drum_toml, old, new))
    message = str(caught.value)
    assert message.startswith(begins)
    assert mentions in message
    assert "\n" not in message
    assert len(message) < 400


def test_a_membrane_needs_tension_in_both_directions(drum_toml):
    membrane = drum_toml.replace('"10 nm"', '"10 nm"\nmodel = "membrane"')
    assert Scene.from_toml(membrane).plate.model == "membrane"
    with pytest.raises(SceneError, match=r"^tension: found x = 321 mN/m, y = 0 N/m"):
        Scene.from_toml(membrane.replace('"0.257 N/m"', "0"))


def test_file_errors_name_the_file(tmp_path, drum_toml):
    missing, folder, binary, bad = (tmp_path / n for n in ("no.toml", "dir", "b.toml", "bad.toml"))
    folder.mkdir()
    binary.write_bytes(b"\xff\xfe\x00")
    bad.write_text(drum_toml.replace("410 GPa", "410 kg"))
    reasons = {missing: "no such file", folder: "not a file", binary: "not a text file"}
    for path, reason in {**reasons, bad: "material.youngs_modulus"}.items():
        with pytest.raises(SceneError, match=re.escape(f"{path}: {reason}")):
            Scene.from_file(path)


@given(st.data())
def test_a_scene_with_any_piece_cut_or_replaced_is_sound_or_a_scene_error(drum_toml, data):
    lines = drum_toml.strip().splitlines()
    index = data.draw(st.integers(0, len(lines) - 1))
    lines[index] = data.draw(
        st.one_of(
            st.text(max_size=20),
            st.sampled_from(lines),
            st.just(lines[index].replace("=", "= -")),
            st.builds(lambda v: f"{lines[index].split('=')[0]}= {v}", st.floats() | st.integers()),
        )
    )
    try:
        Scene.from_toml("\n".join(lines))
    except SceneError as error:
        assert "\n" not in str(error)
