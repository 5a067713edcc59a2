"""What the film's own orbits do not know is refused before anything is assembled or reduced."""

import pytest

import nanorom
from nanorom.errors import SceneError
from nanorom.verification.assemble import assemble
from tests.verification.conftest import drum
from tests.verification.test_beams import DRIVE, beam

DRUM, BEAM = drum(2, **DRIVE), beam("clamped", **DRIVE)
GATE = nanorom.Load(gap=1e-6, voltage=1.0)


@pytest.mark.parametrize(
    ("scene", "told"),
    [
        (DRUM.with_(load=GATE, drive=nanorom.Drive(voltage=0.1)), "drive.voltage: orbits of"),
    ],
)
def test_verify_refuses_in_one_line_before_a_scene_is_reduced(scene, told, monkeypatch):
    monkeypatch.setattr("nanorom.workflow.reduce", lambda *_: pytest.fail("reduced"))
    with pytest.raises(SceneError, match=told):
        nanorom.verify(scene)


@pytest.mark.parametrize("scene", [DRUM, BEAM])
def test_more_named_modes_than_a_model_may_have_are_refused(scene):
    room = 100 - scene.modes.highest
    with pytest.raises(SceneError, match=f"more: found {room + 1} modes .* allowed: 0 to {room}"):
        assemble(scene, room + 1)
