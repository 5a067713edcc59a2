"""Modal forces of spots and points, from the shapes in the model."""

import warnings
from pathlib import Path

import attrs
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import minimize_scalar
from scipy.special import j0, j1, jn_zeros, jv

import nanorom
from nanorom.errors import AccuracyWarning, ModelError, SceneError
from nanorom.rom import patterns
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Sweep
from nanorom.scene.patterns import DIRECT, KEYS, PARAMETRIC
from nanorom.scene.patterns.pattern import Areal
from nanorom.scene.patterns.spot import Spot

ANNULUS = Path(nanorom.__file__).parent / "meshes/annulus.geo"
RADIUS = 2.5e-6
FORCE_TOLERANCE = 1e-6  # the scene's own
SHAPES_TOLERANCE = 2e-3  # linear triangles of the drawn shapes, relative to the J of f01
ROUNDING = 1e-12
SLOPE_TOLERANCE = 1e-2  # of linear triangles, relative to the steepest mode


@pytest.fixture(scope="module")
def model():
    scene = nanorom.Scene(
        geometry=nanorom.Disc(radius=RADIUS),
        plate=nanorom.Plate(thickness="10 nm", model="membrane"),
        material=nanorom.Material(410e9, 0.16, 2267),
        tension=nanorom.Tension.isotropic(0.3),
        modes=nanorom.Modes(count=6),
        damping=nanorom.Damping(100),
    )
    return nanorom.reduce(scene)


def test_spot_at_the_centre_is_an_integral_of_bessel_functions(model):
    width = 0.4 * RADIUS
    found = Spot((0.0, 0.0), width).force(patterns.DrawnWork(model.shapes))
    largest = quad(lambda r: j0(jn_zeros(0, 1)[0] * r) * _intensity(r) * r, 0, 1)[0]
    for label, zero in zip(("f01", "f02"), jn_zeros(0, 2)):
        exact = quad(lambda r, z=zero: j0(z * r) * _intensity(r) * r, 0, 1)[0]
        difference = found[model.label.index(label)] / (2 * np.pi * RADIUS**2) - exact
        assert abs(difference) < SHAPES_TOLERANCE * largest
    others = [r for r, label in enumerate(model.label) if label not in ("f01", "f02")]
    assert np.abs(found[others]).max() < SHAPES_TOLERANCE * found[0]


def test_spots_that_miss_the_film_are_refused(model):
    """In the hole of an annulus, and beside a film that is known by its shapes alone."""
    hole = nanorom.Drive(direct=1.0, direct_pattern="spot", position=[0, 0], radius="50 nm")
    ring = nanorom.Scene(
        geometry=nanorom.MeshFile(ANNULUS, scale="1 um"),
        plate=nanorom.Plate(thickness="10 nm", model="membrane"),
        material=nanorom.Material(410e9, 0.16, 2267),
        tension=nanorom.Tension.isotropic(0.3),
        modes=nanorom.Modes(count=1),
        accuracy=nanorom.Accuracy(degree=2, mesh_size="0.3 um"),
        damping=nanorom.Damping(100),
        drive=hole,
        sweep=Sweep("0.9 f1", "1.1 f1"),
    )
    with pytest.raises(
        SceneError, match="drive.position: found .0, 0. .*no film within about 50 nm"
    ):
        nanorom.reduce(ring)
    rim = attrs.evolve(hole, position=[0.75e-6, 0.0])
    assert nanorom.reduce(attrs.evolve(ring, drive=rim)).drive["spot"][0] > 0
    with pytest.raises(SceneError, match="no film within"):
        Spot((2 * RADIUS, 0.0), 0.1 * RADIUS).force(patterns.DrawnWork(model.shapes))


def _intensity(r):
    return np.exp(-2 * r**2 / 0.4**2)


@pytest.mark.parametrize(
    ("x", "y", "radius"), [(0.0, 0.0, 0.4), (0.32, 0.2, 0.4), (-0.5, 0.3, 0.02), (0.9, 0.3, 0.3)]
)
def test_reduction_integrates_its_spot_as_bessel_functions_tell(model, x, y, radius):
    """In the centre, off it, much smaller than a cell, and half over the edge."""
    place = [x * RADIUS, y * RADIUS]
    drive = Drive(1.0, direct_pattern="spot", position=place, radius=radius * RADIUS)
    found = reduced_with(model, drive).drive["spot"] / RADIUS**2
    exact = np.array([bessel_spot(label, x, y, radius) for label in model.label])
    # a vanishing force has the rounding of the largest
    assert found == pytest.approx(exact, abs=FORCE_TOLERANCE * np.abs(exact).max())


def test_reduction_evaluates_its_shapes_at_a_point(model):
    x, y = 0.37, -0.21
    drive = Drive(1.0, direct_pattern="point", position=[x * RADIUS, y * RADIUS])
    found = reduced_with(model, drive).drive["point"]
    r, theta = np.hypot(x, y), np.arctan2(y, x)
    exact = [bessel_shape(label, r, theta) for label in model.label]
    assert found == pytest.approx(np.array(exact), abs=FORCE_TOLERANCE)


def test_forces_of_another_aim_come_with_a_warning(model):
    drive = Drive(1.0, direct_pattern="spot", position=[5e-7, 3e-7], radius=1e-6)
    own = reduced_with(model, drive)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert patterns.aimed(own, drive) is own
    moved = Drive(1.0, direct_pattern="spot", position=[5e-7, 4e-7], radius=1e-6)
    with pytest.warns(AccuracyWarning, match="drawn shapes"):
        other = patterns.aimed(own, moved)
    difference = other.drive["spot"] - own.drive["spot"]
    assert np.abs(difference).max() > SHAPES_TOLERANCE * own.drive["spot"][0]


def test_reduction_refuses_a_point_beside_the_film(model):
    with pytest.raises(SceneError, match=r"drive.position: found \(3, 0\) µm; allowed: on"):
        reduced_with(model, Drive(1.0, direct_pattern="point", position=[3e-6, 0]))


def reduced_with(model, drive):
    scene = nanorom.Scene.from_toml(model.scene)
    return nanorom.reduce(scene.with_(drive=drive, sweep=Sweep("0.9 f1", "1.1 f1")))


def bessel_shape(label, r, theta):
    """Mode of a membrane, its largest value 1."""
    p, m = int(label[1]), int(label[2])
    grid = np.linspace(0, 1, 4001)
    zero = jn_zeros(p, m)[-1]
    top = grid[np.abs(jv(p, zero * grid)).argmax()]
    top = minimize_scalar(lambda s: -abs(jv(p, zero * s)), bounds=(top - 1e-3, top + 1e-3))
    peak = abs(jv(p, zero * top.x)) if p else 1.0
    turn = np.sin(p * theta) if label.endswith("s") else np.cos(p * theta)
    return jv(p, zero * r) / peak * turn


def bessel_spot(label, x, y, radius):
    """Over the disc: Gauss in r, the trapezium rule in theta, on a grid fine near the spot."""
    centre, at = np.hypot(x, y), np.arctan2(y, x)
    nodes, weights = np.polynomial.legendre.leggauss(24)
    near = np.linspace(max(centre - 4 * radius, 0), min(centre + 4 * radius, 1), 13)
    edges = np.unique(np.concatenate([[0.0], near, [1.0]]))
    half = np.diff(edges)[:, None] / 2
    r = (edges[:-1, None] + half + half * nodes).ravel()[:, None]
    theta = np.linspace(0, 2 * np.pi, 2000, endpoint=False)
    away = r**2 + centre**2 - 2 * r * centre * np.cos(theta - at)
    values = bessel_shape(label, r, theta) * np.exp(-2 * away / radius**2)
    return float((half * weights).ravel() @ (values.mean(axis=1) * 2 * np.pi * r[:, 0]))


@attrs.frozen
class Tilt(Areal):
    """A pressure that grows along x from a position on: all that a new pattern takes."""

    name = "tilt"
    unit = "Pa"

    position: tuple[float, float]
    size = reach = 2 * RADIUS

    @property
    def centre(self):
        return self.position

    def density(self, points):
        return (points[:, 0] - self.position[0]) / RADIUS


def test_new_pattern_of_a_known_kind_is_one_class_and_one_row(model, monkeypatch):
    monkeypatch.setitem(DIRECT, "tilt", Tilt)
    drive = Drive("1 Pa", direct_pattern="tilt", position=[0, 0])
    top = j1(1.8411837813)  # the maximum of J1
    integral = quad(lambda r: j1(jn_zeros(1, 1)[0] * r) * r**2, 0, 1)[0]
    exact = np.where(np.array(model.label) == "f11c", np.pi * RADIUS**2 / top * integral, 0.0)
    found = drive.pattern.force(patterns.DrawnWork(model.shapes))
    assert found == pytest.approx(exact, abs=SHAPES_TOLERANCE * exact.max())
    found = reduced_with(model, drive).drive["tilt"]
    assert found == pytest.approx(exact, abs=FORCE_TOLERANCE * exact.max())


def test_keys_of_every_pattern_are_keys_of_the_drive():
    fields = attrs.fields_dict(Drive)
    own = {"position", "radius", "field", "wire", "gate", "power", "absorption", "cavity"}
    assert set(KEYS) == own <= set(fields)
    for name, kind in (DIRECT | PARAMETRIC).items():
        assert kind.name == name and kind.unit and set(kind.keys()) <= set(fields)


def test_drawn_slopes_are_those_of_the_reduction(model):
    drawn = patterns.DrawnWork(model.shapes).stretch()
    exact = model.parametric["tension"]
    assert drawn == pytest.approx(exact, abs=SLOPE_TOLERANCE * np.abs(exact).max())


def test_wide_spot_is_a_uniform_pressure(model):
    pressure = model.drive["pressure"]
    found = Spot((0.3 * RADIUS, 0.0), 1e3 * RADIUS).force(patterns.DrawnWork(model.shapes))
    assert found == pytest.approx(pressure, abs=SHAPES_TOLERANCE * pressure[0])


def test_point_gives_the_shapes_there(model):
    x = 0.37 * RADIUS
    place = np.array([[x, 0.0]])
    found = patterns.DrawnWork(model.shapes).points(place, np.ones(1), "drive.position")
    zero = jn_zeros(1, 1)[0]
    peak = j1(1.8411837813)  # the maximum of J1
    expected = {"f01": j0(jn_zeros(0, 1)[0] * 0.37), "f11c": j1(zero * 0.37) / peak, "f11s": 0.0}
    for label, value in expected.items():
        assert found[model.label.index(label)] == pytest.approx(value, abs=2e-3)


def test_off_centre_spot_drives_modes_that_pressure_does_not(model):
    """The response to small drive is J/(c omega) at resonance, in every mode."""
    drive = Drive("1 mPa", direct_pattern="spot", position=["0.8 um", "0.5 um"], radius="1 um")
    force = drive.pattern.force(patterns.DrawnWork(model.shapes))
    mode = model.label.index("f11s")
    assert abs(model.drive["pressure"][mode]) < 1e-6 * model.drive["pressure"][0]
    f = model.frequency[mode]
    response = nanorom.respond(model, drive, Sweep(0.95 * f, 1.05 * f), processes=1)
    peak = max(branch.amplitude[:, mode].max() for branch in response.diagrams[0].branches)
    expected = 1e-3 * abs(force[mode]) / (model.damping[mode, mode] * 2 * np.pi * f)
    assert peak == pytest.approx(expected, rel=1e-2)


def test_shaken_frame_pushes_every_mass_on_the_film(model):
    """A bare film as the pressure rho h a the other way; a particle as a force at its place."""
    bare = -2267 * model_thickness(model) * model.drive["pressure"]
    assert model.drive["acceleration"] == pytest.approx(bare, abs=ROUNDING * np.abs(bare).max())
    place, value = ("0.8 um", "0.5 um"), 3e-18
    scene = nanorom.Scene.from_toml(model.scene).with_(
        plate=nanorom.Plate(thickness="10 nm", model="plate"),
        masses=[nanorom.AddedMass(value, place)],
        drive=Drive(1.0, direct_pattern="point", position=place),
        sweep=Sweep("0.9 f1", "1.1 f1"),
        accuracy=nanorom.Accuracy(tolerance=1e-4),
    )
    loaded = nanorom.reduce(scene)
    film = -2267 * 10e-9 * loaded.drive["pressure"]
    expected = film - value * loaded.drive["point"]
    assert np.abs(expected - film).max() > 0.01 * np.abs(film).max()
    found = loaded.drive["acceleration"]
    assert found == pytest.approx(expected, abs=ROUNDING * np.abs(expected).max())


def model_thickness(model):
    return nanorom.Scene.from_toml(model.scene).plate.thickness


def test_wire_on_a_rectangular_membrane_is_an_integral_of_sines():
    """Bent at (x, y): from there to two corners of a kite; sin(m pi x/l) sin(n pi y/w)."""
    length, width, field = 3e-6, 2e-6, 0.5
    wire = [[-1.2e-6, -0.7e-6], [0.4e-6, 0.1e-6], [1.3e-6, 0.9e-6]]
    scene = nanorom.Scene(
        geometry=nanorom.Rectangle(length, width),
        plate=nanorom.Plate(thickness="10 nm", model="membrane"),
        material=nanorom.Material(410e9, 0.16, 2267),
        tension=nanorom.Tension.isotropic(0.3),
        modes=nanorom.Modes(count=5),
        damping=nanorom.Damping(100),
        drive=Drive("1 uA", direct_pattern="magnetomotive", field=field, wire=wire),
        sweep=Sweep("0.9 f1", "1.1 f1"),
    )
    model = nanorom.reduce(scene)
    exact = []
    for label in model.label:
        m, n = (int(part) for part in label.strip("()").split(","))

        def shape(x, y, m=m, n=n):
            return np.sin(m * np.pi * (x / length + 0.5)) * np.sin(n * np.pi * (y / width + 0.5))

        total = 0.0
        for a, b in zip(np.array(wire), np.array(wire[1:])):
            along = quad(lambda s, a=a, b=b, w=shape: w(*(a + s * (b - a))), 0, 1, epsabs=1e-12)[0]
            total += np.linalg.norm(b - a) * along
        exact.append(field * total)
    sign = np.sign(model.drive["magnetomotive"] * exact)
    assert sign * model.drive["magnetomotive"] == pytest.approx(
        np.array(exact), abs=FORCE_TOLERANCE * np.abs(exact).max()
    )


def test_wires_that_are_none_are_refused(model):
    given = {"direct_pattern": "magnetomotive", "field": "1 T"}
    with pytest.raises(SceneError, match="drive.wire: .* two places or more"):
        Drive(1.0, **given, wire=[[0, 0]])
    with pytest.raises(SceneError, match="drive.wire: found one place twice in a row"):
        Drive(1.0, **given, wire=[[0, 0], [0, 0]])
    with pytest.raises(SceneError, match="drive.field: missing"):
        Drive(1.0, direct_pattern="magnetomotive", wire=[[0, 0], [1e-6, 0]])
    with pytest.raises(SceneError, match="drive.wire: it is not on the film"):
        reduced_with(model, Drive(1.0, **given, wire=[[0, 0], [4e-6, 0]]))


def test_drive_that_is_not_aimed_well_is_refused(model, make_model):
    with pytest.raises(SceneError, match='position: missing with direct_pattern = "spot"'):
        Drive(1.0, direct_pattern="spot", radius=1e-6)
    with pytest.raises(SceneError, match='radius: not used with direct_pattern = "point"'):
        Drive(1.0, direct_pattern="point", position=[0, 0], radius=1e-6)
    with pytest.raises(SceneError, match="x and y"):
        Drive(1.0, direct_pattern="point", position=[0])
    with pytest.raises(SceneError, match="not on the film"):
        patterns.aimed(model, Drive(1.0, direct_pattern="point", position=[3e-6, 0]))
    with pytest.raises(ModelError, match="no mode shapes"):
        patterns.aimed(
            make_model(2, shapes=None), Drive(1.0, direct_pattern="point", position=[0, 0])
        )


def test_aimed_drive_survives_the_scene_file(model):
    scene = nanorom.Scene.from_toml(model.scene)
    drive = Drive("2 Pa", direct_pattern="spot", position=["1 um", "-1 um"], radius="0.5 um")
    scene = scene.with_(drive=drive, sweep=Sweep("0.9 f1", "1.1 f1"))
    assert nanorom.Scene.from_toml(scene.to_toml()) == scene
