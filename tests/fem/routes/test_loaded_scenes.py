"""Scenes with loads, relaxing stress and any shape, from the scene to the file of its model."""

import numpy as np
import pytest

from nanorom.errors import SceneError, SolverError
from nanorom.fem.mesh.gmsh import MESHES
from nanorom.fem.reduce import reduce_scene
from nanorom.fem.tuning import tune
from nanorom.plots.loads import load_curve
from nanorom.results.loadcurve import LoadCurve
from nanorom.rom.model import ReducedModel
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Disc, MeshFile
from nanorom.scene.load import VACUUM_PERMITTIVITY, Load
from nanorom.scene.material import Material
from nanorom.scene.scene import (
    Accuracy,
    Modes,
    Reduction,
    Scene,
)
from nanorom.scene.support import Support
from nanorom.scene.wrinkles import Wrinkles
from tests.fem.radial import Disc as Reference

SPECTRAL = 1e-6
ROUTES = 1e-5  # of STEP at its amplitude
RADIUS, THICKNESS, MODULUS, DENSITY, NU = 2.5e-6, 1e-8, 410e9, 2267.0, 0.16
TENSION = 0.3
UNIT = RADIUS * np.sqrt(TENSION / (MODULUS * THICKNESS))  # of deflection
BENDING = MODULUS * THICKNESS**3 / (12 * (1 - NU**2)) / (TENSION * RADIUS**2)


def drum(load, **changes):
    given = {
        "geometry": Disc(radius=RADIUS),
        "plate": Plate(thickness=THICKNESS, model="plate"),
        "material": Material(youngs_modulus=MODULUS, poisson_ratio=NU, density=DENSITY),
        "tension": Tension.isotropic(TENSION),
        "modes": Modes(count=3),
        "load": load,
    }
    return Scene(**{**given, **changes})


def test_pressurised_scene_matches_the_spectral_reference_in_si_units(tmp_path):
    pressure = 2e5
    model = reduce_scene(drum(Load(pressure=pressure)))
    reference = Reference(1.0, BENDING, NU)
    reference.solve(pressure * RADIUS**2 / (TENSION * UNIT))
    assert model.static["centre_deflection"] == pytest.approx(
        UNIT * reference.centre(), rel=SPECTRAL
    )
    assert UNIT * reference.centre() > 5 * THICKNESS
    omega = np.sqrt(reference.eigenvalues(0, 1)[0] * TENSION / (DENSITY * THICKNESS)) / RADIUS
    assert model.frequency[0] == pytest.approx(omega / (2 * np.pi), rel=SPECTRAL)
    assert model.label == ("f01", "f11c", "f11s")
    assert np.diag(model.stiffness) == pytest.approx(
        model.mass * (2 * np.pi * model.frequency) ** 2, rel=1e-7
    )
    model.save(tmp_path / "rom.h5")
    read = ReducedModel.load(tmp_path / "rom.h5")
    assert read.static["deflection"] == pytest.approx(model.static["deflection"])
    assert len(read.static["deflection"]) == len(read.shapes.points)


@pytest.mark.parametrize(
    "load",
    [
        Load(pressure=3e4),
        Load(force=2e-8, position=(5e-7, 3e-7), radius=2e-7),
        Load(pressure=-1e3, voltage=1.0, gap=1e-7),
    ],
)
def test_direct_and_step_give_one_model_of_a_loaded_scene(load):
    accuracy = Accuracy(degree=5, mesh_size=RADIUS / 2)
    direct = reduce_scene(drum(load, accuracy=accuracy))
    stepped = reduce_scene(
        drum(load, accuracy=accuracy, reduction=Reduction(method="step", amplitude="0.1 nm"))
    )
    assert stepped.frequency == pytest.approx(direct.frequency, rel=1e-9)
    for name in ("quadratic", "cubic"):
        exact = getattr(direct, name)
        assert getattr(stepped, name) == pytest.approx(exact, abs=ROUTES * np.abs(exact).max())
    assert stepped.diagnostics["asymmetry"] < ROUTES


def test_voltage_beyond_pull_in_says_where_pull_in_is():
    gap = 5e-9  # far below the unit of deflection: stretching is small
    # V^2 eps0 R^2/(2 T g^3) = 0.7892 without bending and stretching, which both raise it
    pull_in = np.sqrt(0.7892 * 2 * TENSION * gap**3 / (VACUUM_PERMITTIVITY * RADIUS**2))
    with pytest.raises(SolverError, match="pulled in at") as told:
        by_hand = Accuracy(degree=5, mesh_size=RADIUS / 2)
        reduce_scene(drum(Load(voltage=3 * pull_in, gap=gap), accuracy=by_hand))
    found = float(str(told.value).split("pulled in at ")[1].split()[0])
    assert pull_in < found < 1.6 * pull_in


def test_loads_beyond_all_measure_are_cut_back_and_told():
    by_hand = Accuracy(degree=4, mesh_size=RADIUS / 2)
    near, far = Load(voltage=20.0, gap=1e-8), Load(voltage=1e6, gap=1e-8)
    told = []
    for load in (near, far):
        with pytest.raises(SolverError, match="pulled in at") as error:
            reduce_scene(drum(load, accuracy=by_hand))
        told.append(float(str(error.value).split("pulled in at ")[1].split()[0]))
    assert told[1] == pytest.approx(told[0], rel=1e-3)
    with pytest.raises(SolverError, match="before the gate pulls the film in"):
        reduce_scene(drum(Load(pressure=1e7, voltage=1e-3, gap=1e-8), accuracy=by_hand))
    with pytest.raises(SceneError, match=r"load\.position"):
        reduce_scene(drum(Load(force=1e-9, position=(2 * RADIUS, 0.0)), accuracy=by_hand))


@pytest.mark.parametrize("name, held", [("trampoline", "ends"), ("perforated", "edge")])
def test_relaxing_films_of_any_shape_run_to_their_file(name, held, tmp_path):
    scene = drum(
        None,
        geometry=MeshFile(file=MESHES / f"{name}.geo", scale=1e-4),
        plate=Plate(thickness=1e-7),
        tension=Tension.isotropic(50.0),
        support=Support({held: "clamped"}),
        accuracy=Accuracy(degree=4, mesh_size=1e-5),
    )
    model = reduce_scene(scene)
    model.save(tmp_path / "rom.h5")
    read = ReducedModel.load(tmp_path / "rom.h5")
    assert np.all(read.frequency > 0)
    assert 0 < read.static["mean_tension"] < 50.0
    assert read.asymmetry < 1e-6


def test_fixed_in_plane_displacement_needs_a_flat_film():
    with pytest.raises(SceneError, match=r"reduction\.in_plane"):
        drum(Load(pressure=1.0), reduction=Reduction(in_plane="fixed"))


def test_tangent_stiffnesses_need_a_flat_film():
    with pytest.raises(SceneError, match=r"reduction\.method"):
        drum(Load(pressure=1.0), reduction=Reduction(method="tangent"))


@pytest.mark.parametrize(
    "table, key",
    [
        ({}, "load"),
        ({"voltage": "1 V"}, "load.gap"),
        ({"gap": "1 um"}, "load"),
        ({"pressure": "1 N"}, "load.pressure"),
        ({"pressure": 1.0, "radius": "1 nm"}, "load.force"),
        ({"force": "1 nN", "position": ["1 um"]}, "load.position"),
    ],
)
def test_bad_loads_name_the_key(table, key):
    with pytest.raises(SceneError, match=key):
        Load(**table)


def test_gate_first_softens_then_stiffens_the_drum(tmp_path):
    """A curve by continuation from state to state; each state is that of its own scene."""
    gap = 3 * UNIT
    scale = np.sqrt(TENSION * UNIT**3 / (VACUUM_PERMITTIVITY * RADIUS**2))
    by_hand = Accuracy(degree=6, mesh_size=RADIUS / 2)
    scene = drum(Load(voltage=9 * scale, gap=gap), accuracy=by_hand, modes=Modes(count=1))
    curve = tune(scene, "voltage", scale * np.array([1e-3, 2.0, 6.0, 9.0]))
    flat, soft, stiff, _ = curve.frequency[:, 0]
    assert soft < flat < stiff
    assert reduce_scene(scene).frequency[0] == pytest.approx(curve.frequency[-1, 0], rel=1e-6)
    curve.save_csv(tmp_path / "curve.csv")
    table = np.loadtxt(tmp_path / "curve.csv", delimiter=",", skiprows=1)
    assert table[:, 3] == pytest.approx(curve.frequency[:, 0])
    curve.save(tmp_path / "curve.h5")
    read = LoadCurve.load_file(tmp_path / "curve.h5")
    assert read.centre == pytest.approx(curve.centre)
    load_curve(read, tmp_path / "curve.png")
    assert (tmp_path / "curve.png").stat().st_size > 10_000


def test_measured_shape_from_a_file_gives_marguerres_film(tmp_path):
    """A film made in the shape that pressure gives a flat one stiffens, and tells its sides."""
    axis = np.linspace(-1.01, 1.01, 81) * RADIUS
    x, y = (each.ravel() for each in np.meshgrid(axis, axis))
    height = 5 * THICKNESS * np.maximum(1 - (x**2 + y**2) / RADIUS**2, -0.1)
    np.savetxt(tmp_path / "bulge.csv", np.column_stack([x, y, height]), delimiter=",")
    text = drum(None, accuracy=Accuracy(degree=5, mesh_size=RADIUS / 2)).to_toml()
    text = text.replace("[plate]\n", '[plate]\ninitial_shape = "bulge.csv"\n')
    scene = Scene.from_toml(text, tmp_path)
    model = reduce_scene(scene)
    flat = reduce_scene(drum(None, accuracy=Accuracy(degree=5, mesh_size=RADIUS / 2)))
    assert model.frequency[0] > flat.frequency[0]
    assert model.asymmetry < 1e-6
    # the tension pulls the bulge flatter
    assert model.static["centre_deflection"] < 0
    stepped = reduce_scene(
        Scene.from_toml(text, tmp_path).with_(
            reduction=Reduction(method="step", amplitude="0.1 nm")
        )
    )
    largest = np.abs(model.quadratic).max()
    assert stepped.quadratic == pytest.approx(model.quadratic, abs=ROUTES * largest)


def test_change_of_stress_is_a_change_of_tension():
    by_hand = Accuracy(degree=5, mesh_size=RADIUS / 2)
    changed = reduce_scene(drum(Load(stress="10 MPa"), accuracy=by_hand))
    tension = Tension.isotropic(TENSION + 10e6 * THICKNESS)
    same = reduce_scene(drum(None, tension=tension, accuracy=by_hand))
    assert changed.frequency == pytest.approx(same.frequency, rel=1e-9)
    assert changed.cubic == pytest.approx(same.cubic, rel=1e-6, abs=1e-9 * same.cubic.max())
    both = reduce_scene(drum(Load(stress="10 MPa", pressure=1e4), accuracy=by_hand))
    again = reduce_scene(drum(Load(pressure=1e4), tension=tension, accuracy=by_hand))
    assert both.frequency == pytest.approx(again.frequency, rel=1e-8)


# A cap w0 = 0.8 (1 - r^2) under tension 1, D = 0.01, nu = 0.3, in the spectral reference's units,
# by Chebyshev collocation of the deflection and Airy's stress function, no displacements and no
# energy: 41 and 61 points agree to these digits. Modes f01, f11, f21.
CAP = {"height": 0.8, "bending": 0.01, "nu": 0.3}
CAP_CENTRE = -0.58085697
CAP_FREQUENCIES = (2.25500754, 3.77107404, 5.51500734)
CAP_QUADRATIC = (1.30329639, 1.51385881, 1.90416970)  # A_0jj
CAP_CUBIC = (2.79299811, 3.04731460, 3.90921407)  # B_00jj
MARGUERRE = 1e-6


def test_quadratic_coefficients_of_an_initial_shape_are_those_of_a_stress_function(tmp_path):
    bending, nu = CAP["bending"], CAP["nu"]
    h = np.cbrt(12 * (1 - nu**2) * bending * TENSION * RADIUS**2 / MODULUS)
    unit = RADIUS * np.sqrt(TENSION / (MODULUS * h))
    axis = np.linspace(-1.01, 1.01, 21) * RADIUS
    x, y = (each.ravel() for each in np.meshgrid(axis, axis))
    file = tmp_path / "cap.csv"
    z = CAP["height"] * unit * (1 - (x**2 + y**2) / RADIUS**2)
    np.savetxt(file, np.column_stack([x, y, z]), "%.15g", delimiter=",")
    material = Material(youngs_modulus=MODULUS, poisson_ratio=nu, density=DENSITY)
    by_hand = Accuracy(degree=6, mesh_size=RADIUS / 4)
    plate = Plate(h, "plate", file)
    scene = drum(None, plate=plate, material=material, modes=Modes(count=4), accuracy=by_hand)
    model = reduce_scene(scene)
    assert model.label == ("f01", "f11c", "f11s", "f21c")
    assert model.static["centre_deflection"] / unit == pytest.approx(CAP_CENTRE, rel=MARGUERRE)
    own = [0, 1, 3]
    omega = 2 * np.pi * RADIUS * np.sqrt(DENSITY * h / TENSION) * model.frequency[own]
    assert omega == pytest.approx(CAP_FREQUENCIES, rel=MARGUERRE)
    quadratic = [model.quadratic[0, j, j] * unit / TENSION for j in own]
    assert quadratic == pytest.approx(CAP_QUADRATIC, rel=MARGUERRE)
    cubic = [model.cubic[0, 0, j, j] * RADIUS**2 / (MODULUS * h) for j in own]
    assert cubic == pytest.approx(CAP_CUBIC, rel=MARGUERRE)


def test_wrinkles_are_the_shape_that_a_table_of_their_heights_is(tmp_path):
    wrinkles = Wrinkles(amplitude=0.3 * THICKNESS, correlation=0.4 * RADIUS, seed=5)
    axis = np.linspace(-1.01, 1.01, 61) * RADIUS
    x, y = (each.ravel() for each in np.meshgrid(axis, axis))
    file = tmp_path / "wrinkles.csv"
    z = wrinkles.values(np.column_stack([x, y]))
    np.savetxt(file, np.column_stack([x, y, z]), "%.15g", delimiter=",")
    by_hand = Accuracy(degree=5, mesh_size=RADIUS / 2)
    drawn, read, flat = (
        reduce_scene(drum(None, plate=Plate(THICKNESS, "plate", shape), accuracy=by_hand))
        for shape in (wrinkles, file, None)
    )
    assert drawn.frequency == pytest.approx(read.frequency, rel=MARGUERRE)
    largest = np.abs(drawn.quadratic).max()
    assert drawn.quadratic == pytest.approx(read.quadratic, abs=1e-4 * largest)
    assert np.abs(drawn.frequency / flat.frequency - 1).max() > 1e-3
    again = Scene.from_toml(drawn.scene)
    assert again.plate.initial_shape == wrinkles


def test_frequencies_do_not_depend_on_the_direction_in_which_a_load_lies():
    """A force beside the centre splits every pair along and across it, wherever the axes are."""
    models = []
    for angle in (0.0, 0.7):
        position = 0.5 * RADIUS * np.cos(angle), 0.5 * RADIUS * np.sin(angle)
        load = Load(force=2e-7, position=position, radius=0.2 * RADIUS)
        by_hand = Accuracy(degree=5, mesh_size=RADIUS / 2)
        models.append(reduce_scene(drum(load, accuracy=by_hand)))
    first, turned = models
    assert first.label == ("f01", "f11s", "f11c")
    assert first.frequency[2] / first.frequency[1] > 1.02
    assert turned.frequency == pytest.approx(first.frequency, rel=1e-3)  # of the mesh
    stiffness = np.diag(turned.mass * (2 * np.pi * turned.frequency) ** 2)
    assert turned.stiffness == pytest.approx(stiffness, abs=1e-9 * stiffness.max())
    assert sorted(turned.label) == sorted(first.label)


@pytest.mark.parametrize("bending, pressure", [(0.0, 3.0), (0.01, 10.0)])
def test_default_tolerance_holds_about_loaded_states(bending, pressure):
    """Three thicknesses deep and, as a membrane, fifty: what is told bounds the true error."""
    h = np.cbrt(12 * (1 - NU**2) * bending * TENSION * RADIUS**2 / MODULUS) or 1e-9
    model = "plate" if bending else "membrane"
    unit = RADIUS * np.sqrt(TENSION / (MODULUS * h))
    load = Load(pressure=pressure * TENSION * unit / RADIUS**2)
    found = reduce_scene(drum(load, plate=Plate(h, model), modes=Modes(count=1)))
    reference = Reference(1.0, bending, NU)
    for share in (0.1, 1.0):
        reference.solve(share * pressure)
    omega = np.sqrt(reference.eigenvalues(0, 1)[0] * TENSION / (DENSITY * h)) / RADIUS
    error = abs(found.frequency[0] / (omega / (2 * np.pi)) - 1)
    # fields are smooth, and the load is integrated on curved cells as exactly as they are
    assert error - 1e-13 < found.diagnostics["error_frequency"] < 1e-6  # but for rounding
    centre = unit * reference.centre()
    assert found.static["centre_deflection"] == pytest.approx(centre, rel=1e-7)
