"""Films cut along random regions and masses are meshed, whatever way round their corners go."""

import numpy as np
import pytest
from mpi4py import MPI

from nanorom.errors import SceneError
from nanorom.fem.mesh import discretisation, mesh
from nanorom.fem.mesh.gmsh import GmshFile
from nanorom.fem.plan import Plan
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Disc, Rectangle
from nanorom.scene.mass import AddedMass
from nanorom.scene.material import Material
from nanorom.scene.outlines import DiscRegion, PolygonRegion, RectangleRegion
from nanorom.scene.scene import Accuracy, Modes, Scene

SIZE = 1e-5  # m
MOST_CELLS = 6000


def random_region(rng):
    x, y = rng.uniform(-0.4, 0.4, 2) * SIZE
    kind, thick = rng.integers(3), {"thickness": 6e-8}
    if kind == 0:
        return DiscRegion(position=(x, y), radius=rng.uniform(0.03, 0.3) * SIZE, **thick)
    if kind == 1:
        sides = rng.uniform(0.03, 0.5, 2) * SIZE
        return RectangleRegion(position=(x, y), length=sides[0], width=sides[1], **thick)
    count = rng.integers(3, 7)
    angle, radius = np.sort(rng.uniform(0, 2 * np.pi, count)), rng.uniform(0.05, 0.3, count) * SIZE
    around = np.column_stack([x + radius * np.cos(angle), y + radius * np.sin(angle)])
    return PolygonRegion(points=around[:: rng.choice([1, -1])], **thick)


def random_scene(seed):
    """Regions and masses that may touch, cross and contain each other; None if they overlap."""
    rng = np.random.default_rng([5, seed])
    disc = rng.random() < 0.5
    masses = [
        AddedMass(
            1e-16, tuple(rng.uniform(-0.5, 0.5, 2) * SIZE), 10 ** rng.uniform(-2, -0.6) * SIZE
        )
        for _ in range(rng.integers(3))
    ]
    try:
        return Scene(
            geometry=Disc(SIZE) if disc else Rectangle(2 * SIZE, 1.6 * SIZE),
            plate=Plate(5e-8, model="plate"),
            material=Material(2e11, 0.2, 3000.0),
            tension=Tension(1.0, 1.0),
            regions=tuple(random_region(rng) for _ in range(rng.integers(1, 3))),
            masses=tuple(masses),
            modes=Modes(count=3),
            accuracy=Accuracy(tolerance=10.0 ** -rng.integers(2, 6)),
        )
    except SceneError:
        return None


def area(data):
    x = data.points[data.cells[:, :3]]
    (a, b), (c, d) = (x[:, i].T - x[:, 0].T for i in (1, 2))
    return 0.5 * (a * d - b * c)


@pytest.mark.parametrize("seed", range(14))
def test_random_regions_and_masses_are_meshed(seed):
    scene = random_scene(seed)
    if scene is None:
        pytest.skip("regions on one another")
    plan = Plan.of(scene)
    chosen = discretisation.meshed(plan.discretisation(scene.accuracy.tolerance))
    assert (area(chosen) > 0).all()
    assert len(chosen.cells) < MOST_CELLS


@pytest.mark.parametrize("way", [1, -1])
def test_polygon_is_the_same_either_way_round(way):
    corners = np.array([[-1.88, 0.167], [-3.45, 1.51], [0.14, -0.0859]]) * 1e-6
    scene = Scene(
        geometry=Disc(SIZE),
        plate=Plate(5e-8, model="plate"),
        material=Material(2e11, 0.2, 3000.0),
        tension=Tension(1.0, 1.0),
        regions=(PolygonRegion(points=corners[::way], thickness=6e-8),),
        modes=Modes(count=1),
        accuracy=Accuracy(tolerance=1e-2),
    )
    chosen = discretisation.meshed(Plan.of(scene).discretisation(1e-2))
    assert (area(chosen) > 0).all()


def test_mass_whose_rim_all_but_touches_a_regions_side_is_meshed():
    """The cells in the gap folded over: 0.2 nm beside a radius of 72 nm."""
    scene = Scene(
        geometry=Disc(1.446e-6),
        plate=Plate(1.876e-9, model="plate"),
        material=Material(1.073e11, 0.328, 2156.0),
        tension=Tension(1.07e-3, 1.07e-3),
        regions=(RectangleRegion(length=2.89e-7, width=1.45e-7, thickness=1.05e-9),),
        masses=(AddedMass(4.23e-19, (-2.06e-8, 0.0), 7.23e-8),),
        modes=Modes(count=3),
        accuracy=Accuracy(tolerance=1e-2),
    )
    chosen = discretisation.meshed(Plan.of(scene).discretisation(1e-2))
    assert (area(chosen) > 0).all()


def test_surfaces_of_a_file_that_are_drawn_either_way_round_are_one_film(tmp_path):
    file = tmp_path / "two.geo"
    file.write_text(
        """
Point(1) = {0, 0, 0, 1}; Point(2) = {1, 0, 0, 1}; Point(3) = {1, 1, 0, 1};
Point(4) = {0, 1, 0, 1}; Point(5) = {2, 0, 0, 1}; Point(6) = {2, 1, 0, 1};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1};
Line(5) = {2, 5}; Line(6) = {5, 6}; Line(7) = {6, 3};
Curve Loop(1) = {1, 2, 3, 4}; Plane Surface(1) = {1};
Curve Loop(2) = {2, -7, -6, -5}; Plane Surface(2) = {2};
"""
    )
    domain = mesh.build(MPI.COMM_SELF, GmshFile(file))
    assert domain.mesh.topology.index_map(2).size_global > 2
