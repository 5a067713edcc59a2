"""Forms written once are on every mesh, with every parameter, what they would be written anew."""

import attrs
import numpy as np
import pytest
from mpi4py import MPI

from nanorom.fem.models.build import build_plate
from nanorom.fem.models.operators import switch
from nanorom.fem.plan import Plan
from nanorom.fem.solvers import algebra, compat, forms
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Rectangle
from nanorom.scene.scene import Accuracy
from nanorom.scene.support import Support
from tests.fem.exact import RADIUS, paper_drum

SAME = 1e-14  # of the largest entry

SCENES = {
    "coarse": attrs.evolve(paper_drum(3), accuracy=Accuracy(degree=4, mesh_size=RADIUS / 2)),
    "fine": attrs.evolve(paper_drum(3), accuracy=Accuracy(degree=4, mesh_size=RADIUS / 4)),
    "other tension": attrs.evolve(
        paper_drum(3),
        accuracy=Accuracy(degree=4, mesh_size=RADIUS / 3),
        tension=Tension("0.1 N/m", "0.2 N/m"),
    ),
    "membrane": attrs.evolve(
        paper_drum(3),
        accuracy=Accuracy(degree=4, mesh_size=RADIUS / 3),
        plate=Plate("10 nm", "membrane"),
    ),
    "other degree": attrs.evolve(paper_drum(3), accuracy=Accuracy(degree=3, mesh_size=RADIUS / 3)),
    "springs": attrs.evolve(
        paper_drum(3),
        accuracy=Accuracy(degree=4, mesh_size=RADIUS / 3),
        support=Support({"edge": {"spring": "1 MN/m^2", "rotational": "2 nN"}}),
    ),
    "one mirror": attrs.evolve(
        paper_drum(3),
        geometry=Rectangle("5 um", "4 um"),
        accuracy=Accuracy(degree=4, mesh_size=RADIUS / 3),
        support=Support({"left": "simply_supported", "default": "clamped"}),
    ),
}


def plate_of(scene):
    plan = Plan.of(scene)
    return build_plate(MPI.COMM_SELF, scene, plan.scales, plan.discretisation(None))


@pytest.mark.parametrize("name", ["mass_form", "stiffness_form", "mirror_form", "in_plane_form"])
def test_known_form_is_that_written_anew(name):
    for scene in SCENES.values():
        plate = plate_of(scene)
        if name == "mirror_form" and not plate.bending:
            continue
        write = getattr(plate, name)
        even = plate.switches() if name == "mirror_form" else []
        switch(even, (0, 1))
        found = algebra.assemble(plate.compiled(write, even))
        expected = algebra.assemble(compat.form(write(*even)))
        size = expected.norm()
        assert size > 0
        expected.axpy(-1.0, found)
        assert expected.norm() <= SAME * size


def test_known_force_follows_its_deflection():
    for scene in SCENES.values():
        plate = plate_of(scene)
        plate.w.x.array[:] = np.cos(np.arange(len(plate.w.x.array)))
        even = plate.switches()
        switch(even, (0, 1))
        found = algebra.assemble_vector(plate.compiled(plate.linear_force_form, even))
        expected = algebra.assemble_vector(compat.form(plate.linear_force_form(*even)))
        np.testing.assert_allclose(found, expected, rtol=0, atol=SAME * np.abs(expected).max())


def test_form_of_a_kind_is_written_once(monkeypatch):
    monkeypatch.setattr(forms, "_known", {})
    written = []

    def write(plate):
        written.append(plate)
        return plate.mass_form()

    for scene in ("coarse", "fine"):
        plate = plate_of(SCENES[scene])
        mass = algebra.assemble(
            forms.compiled("mass", lambda plate=plate: write(plate), plate.operands())
        )
        assert mass.getSize()[0] == plate.deflections.dofmap.index_map.size_global
    assert len(written) == 1
