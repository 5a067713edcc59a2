"""The true cause of what cannot be computed is told, by `plan` before anything runs."""

import attrs
import pytest

import nanorom
from nanorom import workflow
from nanorom.errors import SceneError
from nanorom.fem.mesh.gmsh import MESHES
from nanorom.scene.scene import Disc, Load, Material, MeshFile, Modes, Plate, Scene, Tension
from nanorom.scene.support import Spring, Support

DRUM = Scene(
    geometry=Disc(radius="2.5 um"),
    plate=Plate(thickness="10 nm"),
    material=Material(youngs_modulus="410 GPa", poisson_ratio=0.16, density=2267),
    tension=Tension("0.3 N/m"),
    modes=Modes(count=2),
)


def test_a_mesh_without_its_scale_is_told_by_its_size_and_its_cells():
    drum = MeshFile(MESHES / "drum.geo", scale="2.5 um")
    told = workflow.plan(attrs.evolve(DRUM, geometry=drum))
    assert "drum.geo, 5 µm by 5 µm: " in told and "cells of degree 8, about" in told
    assert "note" not in told
    metres = workflow.plan(attrs.evolve(DRUM, geometry=MeshFile(MESHES / "drum.geo", scale=45)))
    assert "note    geometry: the film is 90 m long" in metres


@pytest.mark.parametrize("run", [workflow.plan, workflow.reduce])
@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"plate": Plate(thickness="10 um")}, "plate.thickness: found 10 µm on a film of 5 µm"),
        ({"load": Load(pressure="10 GPa")}, "load.pressure: found 10 GPa"),
        ({"support": Support(Spring(spring=1e-12))}, "support.spring: .* from a free edge"),
        ({"support": Support(Spring(spring=1e18))}, "support.spring: .* from a rigid one"),
        ({"support": Support(Spring(rotational=1e6))}, "support.rotational: .* a rigid one"),
        (
            {
                "geometry": MeshFile(MESHES / "perforated.geo", scale="2.5 um"),
                "support": Support({"rim": "clamped"}),
            },
            "support.rim: the mesh has no boundary of that name; allowed: edge, holes",
        ),
    ],
)
def test_what_cannot_be_computed_is_refused_before_anything_runs(run, changes, told):
    with pytest.raises(SceneError, match=told):
        run(attrs.evolve(DRUM, **changes))


def test_a_mesh_file_that_is_thinner_than_its_film_names_the_thickness_when_reduced():
    drum = MeshFile(MESHES / "drum.geo", scale="1 nm")
    with pytest.raises(SceneError, match="plate.thickness: found 10 nm .*geometry.scale"):
        nanorom.reduce(attrs.evolve(DRUM, geometry=drum))


@pytest.mark.parametrize("stiffness", [2e2, 1e14])  # by the film's own, of 1.2e5 N/m^2
def test_the_softest_and_the_stiffest_springs_that_are_allowed_can_be_computed(stiffness):
    # on a soft edge the film moves as one: omega^2 = 2 k / (R rho h)
    model = nanorom.reduce(attrs.evolve(DRUM, support=Support(Spring(spring=stiffness))))
    if stiffness < 1e5:
        radius, areal_mass = 2.5e-6, 2267 * 10e-9
        rigid = (2 * stiffness / radius / areal_mass) ** 0.5 / 6.283185307179586
        assert model.frequency[0] == pytest.approx(rigid, rel=1e-3)
    else:
        held = nanorom.reduce(attrs.evolve(DRUM, support=Support("simply_supported")))
        assert model.frequency == pytest.approx(held.frequency, rel=1e-6)
