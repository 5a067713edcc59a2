"""Ranks share the orbits of a response, and find those that one rank finds."""

import attrs
import numpy as np
import pytest
from mpi4py import MPI

import nanorom
from nanorom.errors import SceneError
from nanorom.fem.reduce import reduce_scene
from nanorom.results.verified import Verified
from nanorom.verification import campaign
from tests.fem.exact import RADIUS, drum

SAME = 1e-9  # of the largest entry of a column
POINTS = 4  # with three ranks, one of them has two


@pytest.fixture(scope="module")
def device():
    """A membrane drum of few cells, two of its modes under a pressure to a fold."""
    few = nanorom.Accuracy(degree=6, mesh_size=RADIUS / 2)
    scene = drum(100.0, count=1, model="membrane", accuracy=few)
    scene = scene.with_(
        modes=nanorom.Modes(select=[1, 6]),
        damping=nanorom.Damping(100.0),
        drive=nanorom.Drive([60.0]),
        sweep=nanorom.Sweep("0.95 f1", "1.2 f1"),
    )
    model = reduce_scene(scene, comm=MPI.COMM_SELF)
    return scene, nanorom.respond(model, scene.drive, scene.sweep, processes=1)


def test_ranks_find_the_same_orbits(device, monkeypatch):
    shared = campaign.verify(*device, points=POINTS, more=2)
    monkeypatch.setattr(campaign, "together", lambda: MPI.COMM_SELF)
    world = MPI.COMM_WORLD
    alone = campaign.verify(*device, points=POINTS, more=2) if world.rank == 0 else None
    alone = world.bcast(alone)
    assert alone.solved.all()
    assert "LP" in alone.type
    for field in attrs.fields(Verified):
        found, expected = getattr(shared, field.name), getattr(alone, field.name)
        if np.asarray(found).dtype.kind == "f" and field.name not in ("residual", "modal_residual"):
            np.testing.assert_allclose(
                found, expected, rtol=0, atol=SAME * np.abs(expected).max(), err_msg=field.name
            )
        elif np.asarray(found).dtype.kind != "f":
            assert np.array_equal(found, expected), field.name


def test_ranks_are_refused_together(device):
    with pytest.raises(SceneError, match="level: found 2"):
        campaign.verify(*device, level=2)
