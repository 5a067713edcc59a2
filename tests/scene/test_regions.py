"""Regions that make no sense are refused in one line."""

import pytest

from nanorom.errors import SceneError
from nanorom.scene.scene import Scene

FILM = """
[geometry]
shape = "disc"
radius = "10 um"
[plate]
thickness = "100 nm"
model = "plate"
[material]
youngs_modulus = "250 GPa"
poisson_ratio = 0.23
density = 3100
[tension]
value = "10 N/m"
[modes]
count = 1
"""
PAD = """
[[region]]
shape = "disc"
radius = "3 um"
[[region.layer]]
thickness = "50 nm"
youngs_modulus = "79 GPa"
poisson_ratio = 0.42
density = 19300
"""
PLAIN = '[[region]]\nshape = "disc"\nradius = "3 um"\nthickness = "50 nm"\n'
RING = '[[region]]\nshape = "ring"\ninner_radius = "2.9 um"\nradius = "5 um"\ndensity = 1000\n'
CROSS = """
[[region]]
shape = "rectangle"
length = "8 um"
width = "1 um"
density = 1000
[[region]]
shape = "rectangle"
length = "1 um"
width = "8 um"
density = 1000
"""
BOW_TIE = '[[region]]\nshape = "polygon"\npoints = [[0, 0], [1e-6, 1e-6], [1e-6, 0], [0, 1e-6]]\n'

BAD = {
    "reaches past the film": (
        PAD.replace("3 um", "10.1 um"),
        "region: found number 1, a disc that",
    ),
    "twice the same": (PAD + PAD, r"region: found 1 \(disc\) and 2 \(disc\) on one another"),
    "overlaps a ring": (PAD + RING, r"region: found 1 \(disc\) and 2 \(ring\) on one another"),
    "crosses": (CROSS, "on one another"),
    "nothing left": (
        PLAIN.replace('thickness = "50 nm"', 'etched = "100 nm"'),
        "region.etched: found 100 nm; allowed: less than the film's thickness",
    ),
    "negative thickness": (PLAIN.replace("50 nm", "-5 nm"), "region.thickness: found '-5 nm'"),
    "said twice": (
        PAD.replace("[[region.l", "density = 1\n[[region.l"),
        "region.density: found be",
    ),
    "nothing said": (PLAIN.replace('thickness = "50 nm"', ""), "a disc that says nothing of its"),
    "no shape": ('[[region]]\nradius = "1 um"\n', "region.shape: missing; allowed: disc | ring"),
    "unknown shape": (PLAIN.replace("disc", "disk"), "did you mean"),
    "unknown key": (PLAIN.replace("thickness", "hight"), "region.hight: unknown key"),
    "side of a layer": (PAD + 'side = "left"\n', "region.layer.side: found 'left'; allowed: top"),
    "sides that meet": (BOW_TIE, "region.points: found sides that meet"),
    "two corners": (BOW_TIE.replace(", [1e-6, 0], [0, 1e-6]", ""), "a list of 3 to 200 corners"),
    "inner circle outside": (RING.replace("2.9", "6"), "region.inner_radius: found 6 µm"),
    "no mesh file": (
        '[[region]]\nshape = "surface"\nsurface = "pad"\ndensity = 1\n',
        "region.surface: found on a",
    ),
    "a table": (PLAIN.replace("[[region]]", "[region]"), r"region: found .* tables \[\[region"),
    "stress": (PLAIN + '[load]\nstress = "1 MPa"\n', "load.stress: found beside"),
    "lossy and bent": (
        PLAIN + "loss = 1e-3\n" + '[load]\npressure = "1 Pa"\n',
        "region.loss: found for a film that is not flat",
    ),
}


@pytest.mark.parametrize("what", BAD)
def test_a_region_that_makes_no_sense_is_refused_in_one_line(what):
    text, message = BAD[what]
    with pytest.raises(SceneError, match=message) as error:
        Scene.from_toml(FILM + text)
    assert "\n" not in str(error.value)


def test_regions_may_touch():
    scene = Scene.from_toml(FILM + PAD + RING.replace("2.9", "3"))
    assert [region.shape for region in scene.regions] == ["disc", "ring"]


def test_a_slack_membrane_is_refused_where_its_region_is():
    text = FILM.replace('"plate"', '"membrane"') + PLAIN + 'tension = "-1 N/m"\n'
    with pytest.raises(SceneError, match="region.tension: found -1 N/m, -1 N/m, 0 N/m"):
        Scene.from_toml(text)


def test_regions_survive_being_written():
    for text in (PAD, PLAIN + RING.replace("2.9", "3"), CROSS[: CROSS.index("[[region]]", 5)]):
        scene = Scene.from_toml(FILM + text)
        assert Scene.from_toml(scene.to_toml()) == scene
