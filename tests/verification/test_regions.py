"""A film of parts that together are another film has that film's orbits and manifolds."""

import numpy as np
import pytest

import nanorom
from nanorom.continuation import explore
from tests.verification.conftest import RADIUS, THICKNESS, drum

TWO_MESHES = 2e-5  # of an amplitude: each film is meshed for 1e-5
THICK = 1.3 * THICKNESS
MATERIAL = {"youngs_modulus": 300e9, "poisson_ratio": 0.3, "density": 3000.0}
PULL = (0.3, 0.25)
INSIDE = {"thickness": THICK, "tension": PULL, **MATERIAL}
DRIVE = {"drive": nanorom.Drive(4000.0), "sweep": nanorom.Sweep("0.9 f1", "1.1 f1")}


def whole(model, **sections):
    scene = drum(1, model=model, tension=PULL, quality=40.0, **DRIVE, **sections)
    return scene.with_(
        material=nanorom.Material(**MATERIAL), plate=nanorom.Plate(thickness=THICK, model=model)
    )


def parts(model, **sections):
    """The same, as two regions that leave nothing of another film."""
    regions = [
        nanorom.DiscRegion(radius=0.4 * RADIUS, **INSIDE),
        nanorom.RingRegion(inner_radius=0.4 * RADIUS, radius=RADIUS, **INSIDE),
    ]
    return drum(1, model=model, quality=40.0, regions=regions, **DRIVE, **sections)


@pytest.mark.parametrize(
    ("model", "sections"),
    [("plate", {}), ("membrane", {"load": nanorom.Load(pressure=4000.0)})],
    ids=["flat", "loaded"],
)
def test_orbits_of_parts_are_those_of_the_whole(model, sections):
    reduced = nanorom.reduce(whole(model, **sections))
    first, level = 2 * np.pi * reduced.frequency[0], DRIVE["drive"].direct[0]
    diagram = explore(reduced.system(), omega=(0.8 * first, 0.9 * first), direct=level)
    start = diagram.branches[0].orbit(-1)
    one, other = (nanorom.full_orbit(made(model, **sections), start) for made in (whole, parts))
    assert other.residual < 1e-8 and one.amplitude[0] > 0.5 * THICKNESS
    assert other.amplitude == pytest.approx(one.amplitude, rel=TWO_MESHES)
    assert other.deflection == pytest.approx(one.deflection, rel=1e-3)


def test_manifold_of_parts_is_that_of_the_whole():
    one, other = (nanorom.manifold(made("plate"), [1], 5) for made in (whole, parts))
    amplitude = 0.5 * THICKNESS
    backbones = [each.backbone([amplitude])[0][0] for each in (one, other)]
    assert backbones[1] == pytest.approx(backbones[0], rel=TWO_MESHES)
    assert backbones[0] > 1.005 * one.equations.frequency
