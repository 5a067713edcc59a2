"""Scenes with plate.model = "shell": flat, raised, pressurised and from a surface in space."""

import numpy as np
import pytest

from nanorom.errors import MeshError, SceneError, SolverError
from nanorom.fem.mesh import gmsh as gmshs
from nanorom.fem.modes import mirrored
from nanorom.fem.reduce import reduce_scene
from nanorom.rom.model import ReducedModel
from nanorom.scene.excitation import Damping
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Disc, MeshFile, Rectangle
from nanorom.scene.load import Load
from nanorom.scene.material import Material
from nanorom.scene.scene import (
    Accuracy,
    Modes,
    Reduction,
    Scene,
)
from nanorom.scene.support import Support

RADIUS, MODULUS, NU = 2e-6, 200e9, 0.25
POTENTIAL = 1e-6  # asymmetry of the tensors
PLATEAU = 1e-6  # change of the coefficients when the amplitude is halved
FLAT_PLATEAU = 1e-9  # the same of a flat film, extrapolated; without that 5e-8
MIRRORED = 1e-5  # of what the mesh does to entries that symmetry makes zero
SHALLOW = 0.01  # a cap of height R/20 against Marguerre's: squares of its slope, 0.1
SPHERE = 2e-3  # a cap of a sphere against a paraboloid of this height


def scene(thickness=40e-9, model="shell", **changes):
    """A drum of the same T R^2/D whatever its thickness."""
    given = {
        "geometry": Disc(RADIUS),
        "plate": Plate(thickness, model),
        "material": Material(MODULUS, NU, 2500.0),
        "tension": Tension.isotropic(0.5 * (thickness / 40e-9) ** 3),
        "modes": Modes(count=1),
        "accuracy": Accuracy(degree=5, mesh_size=RADIUS / 2),
    }
    return Scene(**{**given, **changes})


def test_flat_shell_tends_to_the_plate_and_tells_the_difference(tmp_path):
    thick, thin = (reduce_scene(scene(h)) for h in (80e-9, 40e-9))
    told = np.array(
        [
            [m.diagnostics[f"plate_{what}_difference"] for what in ("frequency", "cubic")]
            for m in (thick, thin)
        ]
    )
    assert np.all(told[1] < 5e-3)
    assert np.log2(told[0, 0] / told[1, 0]) == pytest.approx(2.0, abs=0.3)  # shear: (h/R)^2
    for model, h in ((thick, 80e-9), (thin, 40e-9)):
        assert model.asymmetry < POTENTIAL
        assert model.diagnostics["plateau"] < FLAT_PLATEAU
        # extrapolated from the thickness down, where a polynomial misses what is told
        assert model.diagnostics["amplitude"] <= h
        assert 1e-5 < model.diagnostics["truncation"] < 1e-2
        assert np.abs(model.quadratic).max() == 0.0
    thin.save(tmp_path / "rom.h5")
    assert ReducedModel.load(tmp_path / "rom.h5").method == "step"


def cap(height, directory):
    """A table of a paraboloid over the drum."""
    axis = np.linspace(-1.01, 1.01, 41) * RADIUS
    x, y = (each.ravel() for each in np.meshgrid(axis, axis))
    file = directory / "cap.csv"
    z = height * (1 - (x**2 + y**2) / RADIUS**2)
    np.savetxt(file, np.column_stack([x, y, z]), delimiter=",")
    return file


def dome(height, directory):
    """A cap of a sphere, as a mesh of triangles of order 4 in space."""
    import gmsh

    geometry = directory / "dome.geo"
    text = (gmshs.MESHES / "dome.geo").read_text()
    geometry.write_text(text.replace("height = {0.2,", f"height = {{{height},"))
    file = directory / "dome.msh"
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.open(str(geometry))
    gmsh.model.mesh.generate(2)
    gmsh.model.mesh.setOrder(4)
    gmsh.write(str(file))
    gmsh.finalize()
    return file


def test_raised_shell_is_marguerres_plate_and_the_surface_of_a_mesh_file(tmp_path):
    """Three descriptions of one shallow cap: two models, and two ways to give the surface."""
    height = 0.05
    free = Tension(0.0, 0.0)
    file = cap(height * RADIUS, tmp_path)
    plate, raised = (
        reduce_scene(scene(plate=Plate(40e-9, model, file), tension=free))
        for model in ("plate", "shell")
    )
    assert raised.frequency == pytest.approx(plate.frequency, rel=SHALLOW)
    assert raised.quadratic == pytest.approx(plate.quadratic, rel=SHALLOW)
    assert raised.cubic == pytest.approx(plate.cubic, rel=SHALLOW)
    meshed = reduce_scene(
        scene(geometry=MeshFile(dome(height, tmp_path), scale=RADIUS), tension=free)
    )
    assert meshed.frequency == pytest.approx(raised.frequency, rel=SPHERE)
    assert meshed.quadratic == pytest.approx(raised.quadratic, rel=2 * SPHERE)
    for model in (raised, meshed):
        assert model.asymmetry < POTENTIAL
    assert np.ptp(meshed.shapes.points[:, 2]) == pytest.approx(height * RADIUS, rel=1e-6)


def test_following_pressure_bulges_the_shell_as_a_dead_one_the_plate():
    """They differ by squares of the slope; quadratic coefficients appear in both."""
    pressure = Load(pressure=2e4)
    shell, plate = (reduce_scene(scene(model=model, load=pressure)) for model in ("shell", "plate"))
    bulge = plate.static["centre_deflection"]
    assert shell.static["largest_deflection"] == pytest.approx(bulge, rel=5e-3)
    assert shell.frequency == pytest.approx(plate.frequency, rel=5e-3)
    assert shell.quadratic[0, 0, 0] == pytest.approx(plate.quadratic[0, 0, 0], rel=5e-3)
    assert shell.asymmetry < POTENTIAL


@pytest.mark.parametrize(
    "changes, key",
    [
        ({"reduction": Reduction(method="tangent")}, "reduction.method"),
        ({"reduction": Reduction(in_plane="fixed")}, "reduction.in_plane"),
        ({"accuracy": Accuracy(degree=3, mesh_size=1e-6)}, "accuracy.degree"),
        ({"load": Load(voltage=1.0, gap=1e-7)}, "load.voltage"),
        ({"load": Load(force=1e-9)}, "load.force"),
        ({"damping": Damping(100, material_time=1e-9)}, "damping.material_time"),
        (
            {
                "geometry": Rectangle(4e-6, 2e-6),
                "support": Support({"left": "clamped"}),
                "load": Load(pressure=1.0),
            },
            "load.pressure",
        ),
    ],
)
def test_what_a_shell_cannot_be_asked_is_refused_by_its_key(changes, key):
    with pytest.raises(SceneError, match=key):
        reduce_scene(scene(**changes))


def test_surface_in_space_needs_a_shell_and_one_upper_side(tmp_path):
    file = dome(0.05, tmp_path)
    with pytest.raises(MeshError, match=r"plate\.model = shell"):
        reduce_scene(scene(model="plate", geometry=MeshFile(file, scale=RADIUS)))
    triangles = np.array([[0, 1, 2], [1, 2, 3]])
    with pytest.raises(MeshError, match="reverse some of its surfaces"):
        gmshs._check_sides(triangles, file)


@pytest.mark.parametrize("thicknesses", [5, 12])
def test_an_amplitude_at_which_the_force_is_no_polynomial_is_an_error(thicknesses):
    h = 80e-9
    reduction = Reduction(method="step", amplitude=thicknesses * h)
    with pytest.raises(SolverError, match=r"differ by \d\.\de-02 .* lower it, or leave it out"):
        reduce_scene(scene(h, reduction=reduction))


def test_load_cases_that_mirror_each_other_are_solved_once(monkeypatch):
    """Under pressure the drum tells its sides: its mirrors are x and y alone.

    f01 in both signs, f11c and f11s in one; of f01 with each of these two, of them together one.
    """
    pressed = scene(
        load=Load(pressure="20 kPa"),
        modes=Modes(count=3),
        reduction=Reduction(method="step", amplitude=2e-9),
    )
    fewer = reduce_scene(pressed)
    monkeypatch.setattr(mirrored, "parities", lambda shell, state, shapes: [()] * shapes.shape[1])
    every = reduce_scene(pressed)
    assert every.diagnostics["load_cases"] == 20
    assert fewer.diagnostics["load_cases"] == 4 + 2 + 2 + 1
    for name in ("quadratic", "cubic"):
        found, expected = getattr(fewer, name), getattr(every, name)
        assert np.abs(found - expected).max() < MIRRORED * np.abs(expected).max()
        assert np.count_nonzero(found) < np.count_nonzero(expected)


def test_a_pair_of_a_dome_that_its_mesh_splits_is_told_as_a_pair():
    """A mesh without its symmetry splits it by less than the error, and turned it by rounding."""
    dome = MeshFile(gmshs.MESHES / "dome.geo", scale=RADIUS)
    model = reduce_scene(
        scene(
            10e-9,
            geometry=dome,
            tension=Tension(0.0, 0.0),
            support=Support({"edge": "clamped"}),
            modes=Modes(count=3),
            accuracy=Accuracy(tolerance=1e-2),
        )
    )
    gaps = np.diff(model.frequency) / model.frequency[1:]
    assert sum(gap == pytest.approx(0.0, abs=1e-14) for gap in gaps) == 1
    assert model.diagnostics["error_frequency"] > 1e-7
