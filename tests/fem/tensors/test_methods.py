"""Three routes to one tensor: direct, static load cases, tangent stiffness."""

from pathlib import Path

import attrs
import numpy as np
import pytest

import nanorom
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import (
    Disc,
    MeshFile,
    Rectangle,
    String,
)
from nanorom.scene.material import Material
from nanorom.scene.scene import (
    Accuracy,
    Modes,
    Reduction,
    Scene,
)
from nanorom.scene.support import Support

MESHES = Path(__file__).parents[3] / "meshes"
ROUTES = 1e-9  # of the largest entry
PLATEAU = 1e-8  # spread over amplitudes, of the largest entry
THICKNESS = 10e-9
TENSION = Tension(0.321, 0.257)


def film(geometry, tension=TENSION, **rest):
    parts = {
        "plate": Plate(THICKNESS),
        "material": Material("410 GPa", 0.16, 2267),
        "modes": Modes(3),
        "accuracy": Accuracy(1e-3),  # routes agree on any mesh
    }
    return Scene(geometry=geometry, tension=tension, **(parts | rest))


DISC, SQUARE = Disc("2.5 um"), Rectangle("5 um", "5 um")
NITRIDE = {
    "plate": Plate("100 nm"),
    "material": Material("250 GPa", 0.23, 3100),
    "tension": Tension(10.0, 0.0),  # lateral bending is far above the modes
}
FLAT = {
    "drum": film(DISC),
    "drum with degenerate pairs": film(DISC, Tension.isotropic(0.3)),
    "drum without tension": film(DISC, Tension.isotropic(0.0)),
    "drum without bending": film(DISC, plate=Plate(THICKNESS, model="membrane")),
    "drum with fixed in-plane displacements": film(DISC, reduction=Reduction(in_plane="fixed")),
    "rectangle": film(Rectangle("5 um", "3 um")),
    "supported square": film(SQUARE, support=Support("simply_supported")),
    "clamped string": film(String("20 um", "1 um"), **NITRIDE),
    "supported string": film(
        String("20 um", "1 um"), support=Support("simply_supported"), **NITRIDE
    ),
    "cantilever": film(
        MeshFile(MESHES / "cantilever.geo", scale="2.5 um"),
        Tension(0.0, 0.0),
    ),
}


@pytest.mark.parametrize("name", FLAT)
def test_the_three_routes_agree(name):
    scene = FLAT[name]
    cubic = {
        route: nanorom.reduce(
            attrs.evolve(scene, reduction=attrs.evolve(scene.reduction, method=route))
        ).cubic
        for route in ("direct", "step", "tangent")
    }
    largest = np.abs(cubic["direct"]).max()
    for route in ("step", "tangent"):
        assert np.abs(cubic[route] - cubic["direct"]).max() < ROUTES * largest


@pytest.mark.parametrize("name", ["drum", "clamped string"])
def test_load_cases_of_any_amplitude_up_to_the_thickness_give_one_tensor(name):
    scene = FLAT[name]
    amplitudes = scene.plate.thickness * np.array([1e-3, 1e-2, 0.1, 1.0])
    cubic = np.array(
        [
            nanorom.reduce(
                attrs.evolve(scene, reduction=Reduction(method="step", amplitude=amplitude))
            ).cubic
            for amplitude in amplitudes
        ]
    )
    default = nanorom.reduce(attrs.evolve(scene, reduction=Reduction(method="step"))).cubic
    largest = np.abs(default).max()
    assert np.ptp(cubic, axis=0).max() < PLATEAU * largest
    assert np.abs(cubic - default).max() < PLATEAU * largest
