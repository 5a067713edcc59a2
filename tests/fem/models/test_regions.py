"""Films of several parts against piecewise Bessel functions, collocation and each other."""

from functools import partial

import attrs
import numpy as np
import pytest

from nanorom.errors import AccuracyWarning, SceneError
from nanorom.fem.mesh import discretisation
from nanorom.fem.reduce import reduce_scene
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Disc, MeshFile, Rectangle
from nanorom.scene.layers import Layer
from nanorom.scene.mass import AddedMass
from nanorom.scene.material import Material
from nanorom.scene.outlines import (
    DiscRegion,
    PolygonRegion,
    RectangleRegion,
    RingRegion,
    SurfaceRegion,
)
from nanorom.scene.scene import Accuracy, Modes, Scene
from tests.fem import twofold

TOLERANCE = 1e-6  # that scenes ask for
EXACT = 1e-9  # what frequencies meet then
CUT = 1e-4  # of coarse meshes, one of which does not follow the edge
RADIUS, SHARE, H, PULL = 10e-6, 0.35, 50e-9, 10.0
E, NU, RHO = 250e9, 0.23, 3100.0
UNIT = np.sqrt(PULL / (RHO * H * RADIUS**2)) / (2 * np.pi)  # Hz of a membrane's frequency 1


def drum(*regions, model="membrane", count=4, **changes):
    parts = {
        "geometry": Disc(radius=RADIUS),
        "plate": Plate(thickness=H, model=model),
        "material": Material(youngs_modulus=E, poisson_ratio=NU, density=RHO),
        "tension": Tension.isotropic(PULL),
        "modes": Modes(count=count),
        "regions": regions,
        "accuracy": Accuracy(tolerance=TOLERANCE),
    }
    return Scene(**parts | changes)


def pad(**film):
    return DiscRegion(radius=SHARE * RADIUS, **film)


def found(model, label):
    return model.label.index(label)


@pytest.mark.filterwarnings("error::nanorom.errors.AccuracyWarning")  # the tolerance is met
def test_a_membrane_of_two_densities_has_the_frequencies_of_piecewise_bessel_functions():
    model = reduce_scene(drum(pad(density=4 * RHO)))
    for n, label in enumerate(("f01", "f11c")):
        exact = UNIT * twofold.membrane(SHARE, 4.0, 1.0, n, 0.3, 6.0)[0]
        assert model.frequency[found(model, label)] == pytest.approx(exact, rel=EXACT)


def test_a_ring_is_what_two_discs_leave():
    heavy = twofold.membrane(SHARE, 1.0, 4.0, 0, 0.3, 6.0)[0]
    ring = RingRegion(inner_radius=SHARE * RADIUS, radius=RADIUS, density=4 * RHO)
    model = reduce_scene(drum(ring, count=1))
    assert model.frequency[0] == pytest.approx(UNIT * heavy, rel=EXACT)


def test_a_clamped_plate_with_a_thicker_centre_has_those_of_bessel_functions_in_both_parts():
    region = pad(thickness=1.5 * H, tension=PULL)
    model = reduce_scene(drum(region, model="plate"))
    bending = E * H**3 / (12 * (1 - NU**2)) / (PULL * RADIUS**2)
    inner, outer = (bending * 1.5**3, 1.5), (bending, 1.0)
    for n, label in enumerate(("f01", "f11c", "f21c")):
        exact = UNIT * twofold.plate(SHARE, inner, outer, 1.0, NU, n, 0.5, 6.5)[0]
        assert model.frequency[found(model, label)] == pytest.approx(exact, rel=EXACT)


def test_the_duffing_coefficient_of_two_stiffnesses_is_that_of_collocation_in_both_parts():
    model = reduce_scene(drum(pad(thickness=2 * H, tension=PULL)))
    roots = twofold.membrane(SHARE, 2.0, 1.0, 0, 0.3, 9.0)
    for omega, label in zip(roots, ("f01", "f02")):
        if label not in model.label:
            continue
        i = found(model, label)
        slope = twofold.membrane_shape(SHARE, 2.0, 1.0, omega)
        exact = E * H / RADIUS**2 * twofold.stretched(SHARE, (2.0, 1.0), NU, slope)
        assert model.cubic[i, i, i, i] == pytest.approx(exact, rel=TOLERANCE)


def test_tension_that_differs_relaxes_before_the_film_moves():
    model = reduce_scene(drum(pad(thickness=1.6 * H, tension=2.5 * PULL)))
    stretch = E * H / PULL
    forces = twofold.relaxed(SHARE, (1.6 * stretch, stretch), (2.5, 1.0), NU)
    for n, label in enumerate(("f01", "f11c", "f21c")):
        exact = UNIT * twofold.membrane_under(SHARE, (1.6, 1.0), forces, n, 1)[0]
        assert model.frequency[found(model, label)] == pytest.approx(exact, rel=EXACT)
    assert model.static["mean_tension"] > PULL


def test_a_region_of_the_same_film_changes_nothing():
    plain = reduce_scene(drum(count=1, model="plate"))
    model = reduce_scene(drum(pad(density=RHO), count=1, model="plate"))
    assert model.frequency == pytest.approx(plain.frequency, rel=EXACT)
    assert model.cubic == pytest.approx(plain.cubic, abs=TOLERANCE * np.abs(plain.cubic).max())


def test_a_strip_across_a_membrane_meets_the_products_of_sines():
    a, b, half = 20e-6, 12e-6, 3e-6
    strip = RectangleRegion(length=2 * half, width=b, density=3 * RHO)
    model = reduce_scene(drum(strip, geometry=Rectangle(length=a, width=b)))

    def condition(omega, n, odd):
        within, beyond = (
            np.sqrt(complex(m * RHO * H * omega**2 / PULL - (n * np.pi / b) ** 2)) for m in (3, 1)
        )
        rest = (a / 2 - half) * beyond
        x, slope = np.cos(within * half), -within * np.sin(within * half)
        if odd:
            x, slope = np.sin(within * half) / within, np.cos(within * half)
        return (x * np.cos(rest) + slope * np.sin(rest) / beyond).real

    high = 2 * np.pi * 1.2 * model.frequency[-1]
    every = [
        twofold.roots(partial(condition, n=n, odd=odd), high / 50, high)
        for n in (1, 2, 3)
        for odd in (False, True)
    ]
    exact = np.sort(np.concatenate(every))[:4] / (2 * np.pi)
    assert model.frequency == pytest.approx(exact, rel=EXACT)


def test_a_mesh_that_gmsh_cuts_gives_what_rings_give(monkeypatch):
    scene = drum(pad(thickness=2 * H), count=3)
    rings = reduce_scene(scene)
    monkeypatch.setattr(discretisation, "is_cut", lambda scene: True)
    cut = reduce_scene(scene)
    assert cut.frequency == pytest.approx(rings.frequency, rel=EXACT)
    assert cut.cubic == pytest.approx(rings.cubic, abs=TOLERANCE * np.abs(rings.cubic).max())


def test_a_heavy_patch_off_the_centre_is_a_mass_spread_over_it():
    place, radius = (3e-6, 2e-6), 2e-6
    patch = DiscRegion(position=place, radius=radius, density=1.5 * RHO)
    coarse = {"count": 2, "accuracy": Accuracy(degree=6, mesh_size=3e-6)}
    mass = AddedMass(0.5 * RHO * H * np.pi * radius**2, place, radius)
    model, other = reduce_scene(drum(patch, **coarse)), reduce_scene(drum(masses=mass, **coarse))
    assert model.frequency == pytest.approx(other.frequency, rel=CUT)


def test_a_polygon_with_the_corners_of_a_rectangle_is_one():
    geometry = Rectangle(length=20e-6, width=12e-6)
    corners = [(-3e-6, -2e-6), (3e-6, -2e-6), (3e-6, 2e-6), (-3e-6, 2e-6)]
    film = {"thickness": 2 * H}
    rectangle = RectangleRegion(length=6e-6, width=4e-6, **film)
    some = {"geometry": geometry, "count": 2, "accuracy": Accuracy(tolerance=CUT)}
    one, other = (
        reduce_scene(drum(r, **some)) for r in (rectangle, PolygonRegion(points=corners, **film))
    )
    assert other.frequency == pytest.approx(one.frequency, rel=CUT)
    assert other.cubic == pytest.approx(one.cubic, abs=CUT * one.cubic.max())


GEO = """SetFactory("OpenCASCADE");
Disk(1) = {0, 0, 0, 1};
Disk(2) = {0, 0, 0, 0.35};
BooleanFragments{ Surface{1}; Delete; }{ Surface{2}; Delete; }
Mesh.MeshSizeMax = 0.5;
Physical Surface("pad") = {2};
Physical Surface("rest") = {3};
Physical Curve("edge") = {1};
"""


def test_a_physical_surface_of_a_mesh_file_is_a_region(tmp_path):
    file = tmp_path / "pad.geo"
    file.write_text(GEO)
    geometry = MeshFile(file=file, scale=RADIUS)
    region = SurfaceRegion(surface="pad", density=4 * RHO)
    model = reduce_scene(drum(region, geometry=geometry, count=1))
    exact = UNIT * twofold.membrane(SHARE, 4.0, 1.0, 0, 0.3, 6.0)[0]
    assert model.frequency[0] == pytest.approx(exact, rel=TOLERANCE)
    with pytest.raises(SceneError, match="number 1, but the mesh has no physical surface 'ped'"):
        reduce_scene(drum(SurfaceRegion(surface="ped", density=RHO), geometry=geometry, count=1))
    with pytest.raises(SceneError, match=r"region: found number 1, a disc of .* its edge along"):
        reduce_scene(drum(DiscRegion(radius=5e-6, density=RHO), geometry=geometry, count=1))


def test_the_frame_shakes_every_part_by_its_mass():
    model = reduce_scene(drum(pad(density=4 * RHO), count=1))
    roots = twofold.membrane(SHARE, 4.0, 1.0, 0, 0.3, 6.0)
    slope = twofold.membrane_shape(SHARE, 4.0, 1.0, roots[0])
    r, weights = np.polynomial.legendre.leggauss(60)
    total = 0.0
    for low, high, density in ((0.0, SHARE, 4.0), (SHARE, 1.0, 1.0)):
        x = low + (high - low) * (r + 1) / 2
        # int m phi r dr by parts, phi = 0 at the rim: -int M(r) phi' dr with M' = m r
        inner = density * x**2 / 2 + (0.0 if low == 0 else 1.5 * SHARE**2)
        total -= (high - low) / 2 * weights @ (inner * slope(x))
    momentum = 2 * np.pi * RHO * H * RADIUS**2 * total
    assert -model.drive["acceleration"][0] == pytest.approx(momentum, rel=1e-8)


def test_a_lossy_pad_loses_its_share_of_the_bending_energy():
    loss = 1e-3
    everywhere = drum(model="plate", count=2)
    material = attrs.evolve(everywhere.material, loss=loss)
    whole = reduce_scene(everywhere.with_(material=material)).losses["material"]
    inside = reduce_scene(drum(pad(loss=loss), model="plate", count=2)).losses["material"]
    ring = RingRegion(inner_radius=SHARE * RADIUS, radius=RADIUS, loss=loss)
    outside = reduce_scene(drum(ring, model="plate", count=2)).losses["material"]
    assert (inside > 0).all() and (inside < outside).all()  # it bends at its clamped edge
    # each has the penalty of slopes that jump at the edge between: of the mesh's error
    assert inside + outside == pytest.approx(whole, rel=TOLERANCE)


def test_layers_on_a_region_are_the_stack_there():
    gold = {"thickness": 30e-9, "youngs_modulus": 79e9, "poisson_ratio": 0.42, "density": 19300.0}
    text = drum(model="plate").to_toml() + '[[region]]\nshape = "disc"\nradius = "3 um"\n'
    text += "[[region.layer]]\n" + "\n".join(f"{key} = {value}" for key, value in gold.items())
    (region,) = Scene.from_toml(text).regions
    layer, film = Layer(**gold), Layer(H, E, NU, RHO)
    a, b = film.stiffness * H, layer.stiffness * layer.thickness
    neutral = (a * H / 2 + b * (H + layer.thickness / 2)) / (a + b)
    assert region.offset == pytest.approx(neutral - H / 2, rel=EXACT)
    assert region.density * region.thickness == pytest.approx(RHO * H + 19300 * 30e-9, rel=EXACT)
    bending = a * (H**2 / 12 + (neutral - H / 2) ** 2)
    bending += b * (30e-9**2 / 12 + (H + 15e-9 - neutral) ** 2)
    assert region.bending == pytest.approx(bending, rel=EXACT)
    assert Scene.from_toml(Scene.from_toml(text).to_toml()) == Scene.from_toml(text)
    with pytest.warns(AccuracyWarning, match="its neutral plane lies"):
        reduce_scene(Scene.from_toml(text).with_(modes=1, tolerance=1e-3))
