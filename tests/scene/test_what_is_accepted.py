"""A scene takes what people write first, or says what to write instead."""

import pytest

import nanorom
from nanorom.errors import SceneError
from nanorom.scene.excitation import Excitation
from nanorom.scene.scene import Scene


@pytest.fixture
def drum(tmp_path, drum_toml):
    path = tmp_path / "drum.toml"
    path.write_text(drum_toml)
    return path


def test_one_tension_is_the_same_in_every_direction():
    assert nanorom.Tension("0.3 N/m") == nanorom.Tension(x=0.3, y=0.3)
    assert nanorom.Tension("0.3 N/m") == nanorom.Tension.isotropic("0.3 N/m")


def test_a_file_may_stand_for_the_scene_in_it(drum):
    scene = Scene.from_file(drum)
    assert Scene.of(str(drum)) == Scene.of(drum) == Scene.load(drum) == scene
    assert Scene.of(scene) is scene
    with pytest.raises(SceneError, match=r"none.toml: no such file"):
        Scene.of("none.toml")


def test_load_of_a_scene_is_still_its_section(drum):
    assert Scene.load(drum).load is None
    loaded = Scene.load(drum).with_(load=nanorom.Load(pressure="1 Pa"))
    assert loaded.load.pressure == 1.0


def test_a_sweep_has_the_same_keys_in_a_file_and_in_python():
    table = {"drive": {"direct": "1 Pa"}, "sweep": {"start": "0.8 f1", "stop": "1.2 f1"}}
    assert Excitation.from_dict(table).sweep == nanorom.Sweep(start="0.8 f1", stop="1.2 f1")
    table["sweep"] = {"from": "0.8 f1", "to": "1.2 f1"}
    assert Excitation.from_dict(table).sweep == nanorom.Sweep(start="0.8 f1", stop="1.2 f1")
    table["sweep"]["start"] = "0.9 f1"
    with pytest.raises(SceneError, match=r"sweep\.start: found beside from, which is the same"):
        Excitation.from_dict(table)


def test_a_side_beside_edge_is_told_what_to_write(drum, drum_toml):
    drum.write_text(drum_toml.replace('edge = "clamped"', 'rim = "clamped"'))
    with pytest.raises(
        SceneError, match=r"support\.rim: unknown key; write edge = \{ rim = \.\.\. \}; allowed"
    ):
        Scene.load(drum)
    drum.write_text(drum_toml.replace('edge = "clamped"', 'egde = "clamped"'))
    with pytest.raises(SceneError, match=r'support\.egde: unknown key \(did you mean "edge"\?\)'):
        Scene.load(drum)
