"""Derivatives of any film by any number of its scene, by reductions beside it."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

import nanorom
from nanorom.cli.main import main
from nanorom.errors import ModelError, SceneError
from nanorom.exact import cases
from nanorom.fem.sensitivity.model import model_slopes, scene_keys
from nanorom.fem.sensitivity.near import slopes_of
from nanorom.fem.sensitivity.neighbours import neighbours
from nanorom.results.near import Tangent

DRUM = cases.paper_drum().scene
# of devices beside one another, whose mesh has one error, which their differences have, too
COARSE = {"degree": 5, "mesh_size": 1e-6}
HOMOGENEOUS = 1e-6  # of an exponent: units of mass, length and time have no number
INTERPOLATED = 1e-6  # of an exponent of a flat film, beside exact derivatives
ROUGH = 1e-4  # of an error that is told: that of one order less
# exponents of kg, m and s in what a film's scene says and in what is found
DIMENSIONS = {
    "geometry.radius": (0, 1, 0),
    "plate.thickness": (0, 1, 0),
    "material.youngs_modulus": (1, -1, -2),
    "material.density": (1, -3, 0),
    "tension": (1, 0, -2),
    "load.pressure": (1, -1, -2),
    "support.edge.spring": (1, -1, -2),
    "support.edge.rotational": (1, 1, -2),
    "region.1.radius": (0, 1, 0),
    "region.1.thickness": (0, 1, 0),
    "region.1.density": (1, -3, 0),
    "f1": (0, 0, -1),
    "b111": (1, -2, -2),
    "beta1": (1, -2, -2),
    "deflection": (0, 1, 0),
    "mean_tension": (1, 0, -2),
}
FILM = """
[geometry]
shape = "disc"
radius = "3 um"
[plate]
thickness = "60 nm"
model = "plate"
[material]
youngs_modulus = "250 GPa"
poisson_ratio = 0.23
density = "3100 kg/m^3"
[tension]
value = "0.5 N/m"
[support]
edge = { spring = "30 MN/m^2", rotational = "1 uN" }
[[region]]
shape = "disc"
radius = "0.9 um"
thickness = "90 nm"
density = "4000 kg/m^3"
[modes]
count = 1
[accuracy]
tolerance = 1e-3
"""
# what is moved is all that has a dimension
FILM_KEYS = ["geometry.radius", "plate.thickness", "material.youngs_modulus", "tension"]
FILM_KEYS += ["material.density", "support.edge.spring", "support.edge.rotational"]
FILM_KEYS += ["region.1.radius", "region.1.thickness", "region.1.density"]


def check_homogeneous(table):
    """The product of all numbers by their exponents has the dimension of what is found (Euler)."""
    scales = np.array([DIMENSIONS[key] for key in table.by])
    for name, exponents in zip(table.of, table.relative):
        missed = exponents @ scales - DIMENSIONS[name]
        assert np.abs(missed).max() < HOMOGENEOUS, (name, missed)


def test_pressurised_drum_changes_as_its_units_do():
    drum = DRUM.with_(modes=1, load=nanorom.Load(pressure="5 kPa")).with_(**COARSE)
    keys = ["geometry.radius", "plate.thickness", "material.youngs_modulus", "material.density"]
    of = ["f1", "b111", "beta1", "deflection", "mean_tension"]
    table = nanorom.sensitivity(drum, of=of, by=[*keys, "tension", "load.pressure"])
    check_homogeneous(table)
    assert table["deflection", "load.pressure"] < 1 - 1e-3  # it stiffens
    assert 0 < table.worst < HOMOGENEOUS


def test_springs_and_regions_change_a_film_as_its_units_do():
    tables = tomllib.loads(FILM)
    table = nanorom.sensitivity(tables, of=["f1", "b111"], by=FILM_KEYS)
    check_homogeneous(table)
    assert table["f1", "support.edge.spring"] > 0 > table["f1", "region.1.density"]


def test_neighbours_of_a_flat_film_have_the_exact_derivatives():
    scene = DRUM.with_(modes=3)
    found = model_slopes(scene, ["plate.thickness", "tension.x"])
    exact = Tangent(scene, found.value, found.slope, found.label, found.number)
    tables = tomllib.loads(scene.to_toml())
    near = neighbours(scene, tables, Path(), ["plate.thickness", "tension.x"])
    for name in ("f1", "f2", "b111", "b112@2", "beta1", "P11.tension"):
        wanted, got = exact.quantity(name), near.quantity(name)
        assert got.value == pytest.approx(wanted.value, rel=1e-9)
        fine, rough = np.array(got.slope).reshape(2, -1) / got.value
        true = np.abs(fine - np.array(wanted.slope) / wanted.value)
        assert true.max() < INTERPOLATED
        assert np.abs(fine - rough).max() < ROUGH


def test_modes_keep_their_names_where_a_number_parts_a_pair():
    """Along tension.x of an equal one, f11c rises and f11s does not."""
    drum = DRUM.with_(modes=3, **COARSE, tension=nanorom.Tension(0.3, 0.3))
    drum = drum.with_(load=nanorom.Load(pressure="1 kPa"))
    table = nanorom.sensitivity(drum, of=["f(f11c)", "f(f11s)"], by=["tension.x", "tension.y"])
    assert table["f(f11c)", "tension.x"] == pytest.approx(table["f(f11s)", "tension.y"], abs=1e-6)
    assert table["f(f11c)", "tension.x"] > 1.5 * table["f(f11c)", "tension.y"] > 0


def test_layers_have_keys_of_their_own(tmp_path, capsys):
    layers = """
[[layer]]
thickness = "60 nm"
youngs_modulus = "250 GPa"
poisson_ratio = 0.23
density = "3100 kg/m^3"
stress = "10 MPa"
[[layer]]
thickness = "20 nm"
youngs_modulus = "80 GPa"
poisson_ratio = 0.23
density = "19300 kg/m^3"
[geometry]
shape = "disc"
radius = "3 um"
[modes]
count = 1
[accuracy]
degree = 5
mesh_size = "1 um"
"""
    path = tmp_path / "gold.toml"
    path.write_text(layers)
    keys = "layer.2.thickness,layer.2.density,layer.1.density"
    table = tmp_path / "table.csv"
    command = ["sensitivity", str(path), "--of", "f1,m1", "--by", keys, "-o", str(table)]
    assert main(command) == 0
    assert "by differences of reductions, right to" in capsys.readouterr().out
    rows = [row.split(",") for row in table.read_text().splitlines()]
    gold = 19300 * 20 / (19300 * 20 + 3100 * 60)  # its share of the mass
    assert rows[0][3:] == keys.split(",")
    by = dict(zip(rows[0][3:], map(float, rows[2][3:])))
    assert by["layer.2.density"] == pytest.approx(gold, rel=1e-6)
    assert by["layer.2.thickness"] == pytest.approx(gold, rel=0.1)  # shapes change, too
    assert [float(each) for each in rows[1][4:]] == pytest.approx([-gold / 2, (gold - 1) / 2])


def test_special_points_of_a_loaded_film_move_as_those_of_neighbours_do():
    scene = DRUM.with_(
        modes=1,
        **COARSE,
        load=nanorom.Load(pressure="2 kPa"),
        damping=nanorom.Damping(200.0),
        drive=nanorom.Drive([100.0]),
        sweep=nanorom.Sweep("0.8 f1", "1.2 f1"),
    )
    table = nanorom.sensitivity(scene, of=["LP1", "LP1.f01"], by=["load.pressure"])
    step, ends = 2e-3, []
    for sign in (1, -1):
        beside = scene.with_(load=nanorom.Load(pressure=2e3 * np.exp(sign * step)))
        model = nanorom.reduce(beside)
        response = nanorom.respond(model, scene.drive, scene.sweep, scene.damping)
        points = sorted(response.diagrams[0].points("LP"), key=lambda point: point.omega)
        ends.append([points[0].omega / (2 * np.pi), points[0].amplitude[0]])
    slope = (np.array(ends[0]) - np.array(ends[1])) / (2 * step)
    assert table.slope[:, 0] == pytest.approx(slope, rel=1e-4)


def test_what_cannot_be_moved_is_told_before_anything_is_reduced():
    loaded = DRUM.with_(load=nanorom.Load(pressure="1 kPa"))
    with pytest.raises(SceneError, match=r"found 'load.presure' \(did you mean \"load.pressure\""):
        nanorom.sensitivity(loaded, by=["load.presure"])
    with pytest.raises(ModelError, match="of: found 'q1'; allowed: f1, m1"):
        nanorom.sensitivity(loaded, of=["q1"])
    with pytest.raises(SceneError, match="derivatives are those of a flat film"):
        nanorom.sensitivity(loaded, exact=True)


def test_tension_that_relaxes_has_no_exact_derivatives():
    """A strip that slides along one side: tension across it hardly acts, whatever it is."""
    scene = nanorom.Scene(
        geometry=nanorom.Rectangle("10 um", "6 um"),
        plate=nanorom.Plate("60 nm", model="plate"),
        material=nanorom.Material("250 GPa", 0.23, 3100),
        tension=nanorom.Tension(0.5, 0.3),
        support=nanorom.Support({"left": "clamped", "right": "clamped"}),
        modes=nanorom.Modes(1),
        accuracy=nanorom.Accuracy(degree=6, mesh_size=2e-6),
    )
    with pytest.raises(SceneError, match="tension: found where it relaxes"):
        nanorom.sensitivity(scene, of=["f1"], by=["tension.y"], exact=True)
    table = nanorom.sensitivity(scene, of=["f1"], by=["tension.x", "tension.y"])
    assert abs(table["f1", "tension.y"]) < 0.2 * table["f1", "tension.x"]
    step, ends = 2e-3, []
    for sign in (1, -1):
        beside = scene.with_(tension=nanorom.Tension(0.5, 0.3 * np.exp(sign * step)))
        ends.append(np.log(nanorom.reduce(beside).frequency[0]))
    assert table["f1", "tension.y"] == pytest.approx((ends[0] - ends[1]) / (2 * step), abs=1e-7)


@pytest.mark.parametrize("of_crystals", [False, True])
def test_exact_derivatives_know_what_a_material_says_by_itself(of_crystals):
    """A bending stiffness that is stated is none of Young's modulus; moduli of a crystal stay."""
    own = {"bending": 8e-15} if not of_crystals else {"shear_modulus": 8e10, "orientation": 0.3}
    scene = nanorom.Scene(
        geometry=nanorom.Disc("3 um"),
        plate=nanorom.Plate("60 nm", model="plate"),
        material=nanorom.Material("250 GPa", 0.23, 3100, **own),
        tension=nanorom.Tension(0.2, 0.25),
        modes=nanorom.Modes(1),
        accuracy=nanorom.Accuracy(tolerance=1e-7),
    )
    keys = list(scene_keys(scene))
    assert ("material.youngs_modulus" in keys) is not of_crystals
    exact = nanorom.sensitivity(scene, of=["f1", "b111"], by=keys, exact=True)
    tables = tomllib.loads(scene.to_toml())
    near = neighbours(scene, tables, Path(), keys)
    for row, name in zip(exact.relative, exact.of):
        found = near.quantity(name)
        beside = np.array(found.slope)[: len(keys)] / found.value
        assert row == pytest.approx(beside, abs=INTERPOLATED)
    if of_crystals:
        assert "material.youngs_modulus" in nanorom.sensitivity(scene, of=["f1"]).by


def test_fits_have_derivatives_of_films_that_have_no_exact_ones():
    """A membrane on springs, and one without, whose exact derivatives are the same."""
    scene = DRUM.with_(modes=1, plate=nanorom.Plate("10 nm", model="membrane"))
    exact = slopes_of(scene, ["tension.x", "material.density"])
    rigid = nanorom.Support(nanorom.Spring("1e14 N/m^2"))  # by T/R = 1e5 all but rigid
    near = slopes_of(scene.with_(support=rigid), ["tension.x", "material.density"])
    assert near.label == exact.label
    for key in ("tension.x", "material.density"):
        wanted, found = exact.slope[key], near.slope[key]
        assert found.frequency == pytest.approx(wanted.frequency, rel=1e-6)
        assert found.cubic == pytest.approx(
            wanted.cubic, rel=1e-5, abs=1e-7 * np.abs(exact.value.cubic).max()
        )
