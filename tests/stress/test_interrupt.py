"""Interrupted STEP campaigns go on; short form of ``python -m tests.stress.interrupt``."""

import os
import random

import numpy as np
import pytest

from nanorom import workflow
from nanorom.fem.reduce import key_of
from nanorom.fem.tensors.flat_cases import FlatCases
from nanorom.fem.tensors.loaded_cases import StaticCases
from nanorom.files import partial
from nanorom.scene.geometry import MeshFile
from nanorom.scene.scene import Scene
from tests.stress import interrupt

FLAT = interrupt.step("flat", 5, 4, "1 um")
LOADED = interrupt.step("loaded", 4, 4, "2 um", interrupt.PRESSURE)
TWO_RANKS = interrupt.step("two ranks", 5, 4, "1 um", ranks=2)
SOON = 120  # seconds within which a run that lost a rank has ended


@pytest.mark.parametrize(
    ("task", "cases"), [(FLAT, FlatCases), (LOADED, StaticCases)], ids=["flat", "loaded"]
)
def test_finished_load_cases_are_not_solved_again(tmp_path, monkeypatch, task, cases):
    for name, value in {"SECONDS": 0.0, "SHARE": np.inf}.items():  # keep every batch at once
        monkeypatch.setattr(partial, name, value)
    scene = Scene.from_toml(task.files["film.toml"])
    solve, calls, most = cases.nonlinear_force, [], 1000

    def counted(self, q):
        calls.append(q.shape[1])
        if len(calls) > most:
            raise KeyboardInterrupt
        return solve(self, q)

    monkeypatch.setattr(cases, "nonlinear_force", counted)
    whole = workflow.reduce(scene, path=tmp_path / "whole.h5")
    batches, most = calls.copy(), 2
    assert len(batches) > 2
    calls.clear()
    with pytest.raises(KeyboardInterrupt):
        workflow.reduce(scene, path=tmp_path / "rom.h5")
    assert sorted(os.listdir(tmp_path)) == ["rom.h5.partial", "whole.h5"]
    calls.clear()
    most = 1000
    again = workflow.reduce(scene, path=tmp_path / "rom.h5")
    assert calls == batches[2:]
    assert sorted(os.listdir(tmp_path)) == ["rom.h5", "whole.h5"]
    for name in ("frequency", "quadratic", "cubic"):
        assert np.array_equal(getattr(again, name), getattr(whole, name)), name


def test_a_changed_scene_is_another_campaign(tmp_path):
    assert key_of(Scene.from_toml(FLAT.files["film.toml"]), 1) != key_of(
        Scene.from_toml(LOADED.files["film.toml"]), 1
    )
    mesh = tmp_path / "film.geo"
    mesh.write_text("// one")
    scene = Scene.from_toml(FLAT.files["film.toml"]).with_(geometry=MeshFile(file=mesh))
    before = key_of(scene, 1)
    assert before == key_of(scene, 1) != key_of(scene, 2)
    mesh.write_text("// another")
    assert before != key_of(scene, 1)


def test_a_campaign_killed_again_and_again_ends_with_the_same_result(tmp_path):
    chance = random.Random(7)
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    whole.mkdir()
    broken.mkdir()
    seconds = FLAT.finish(whole)
    for way in ("killed", "disk full", "killed"):
        # start-up, mesh and modes come before
        interrupt.disturb(FLAT, way, seconds * chance.uniform(0.6, 0.95), broken)
        interrupt.left_by(FLAT, broken)
    FLAT.finish(broken)
    assert interrupt.difference(broken / "rom.h5", whole / "rom.h5") == 0.0
    assert sorted(os.listdir(broken)) == ["film.toml", "rom.h5"]


@pytest.mark.mpi
def test_a_rank_that_dies_ends_the_run_and_the_next_goes_on(tmp_path, monkeypatch):
    monkeypatch.setattr(interrupt, "LONGEST", SOON)
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    whole.mkdir()
    broken.mkdir()
    at, status = 0.6 * TWO_RANKS.finish(whole), 0
    while status == 0:  # it may have been faster the second time, and done
        (broken / "rom.h5").unlink(missing_ok=True)
        status = interrupt.disturb(TWO_RANKS, "rank killed", at, broken)
        at *= 0.7
    interrupt.left_by(TWO_RANKS, broken)
    TWO_RANKS.finish(broken)
    assert interrupt.difference(broken / "rom.h5", whole / "rom.h5") < interrupt.ROUND_OFF
    assert sorted(os.listdir(broken)) == ["film.toml", "rom.h5"]
