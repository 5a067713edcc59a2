"""One command from a scene to its model, response and pictures."""

import base64
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from nanorom.cli.main import main
from nanorom.results.response import Response
from nanorom.rom.model import ReducedModel
from tests.cli.process import LONGEST, names, python

# Clamped plate with T_x != T_y of Keskekler et al. with E = 410 GPa, in Hz: spectral solution that
# is independent of finite elements, all digits converged.
DRUM_FREQUENCIES = [21.15119357e6, 35.43957465e6, 36.72212759e6]
FREQUENCY_TOLERANCE = 1e-6  # the scene's default accuracy


@pytest.fixture(scope="module")
def results(tmp_path_factory, drum_toml):
    """What `nanorom run` leaves of the drum, run as a user would."""
    directory = tmp_path_factory.mktemp("drum")
    (directory / "drum.toml").write_text(drum_toml)
    done = python("-m", "nanorom", "run", "drum.toml", "-o", "out/drum", cwd=directory)
    assert done.returncode == 0, (done.stdout, done.stderr)
    assert done.stderr == ""
    return directory / "out" / "drum"


def test_run_leaves_model_response_pictures_and_summary(results):
    assert names(results) == [
        "amplitudes.png",
        "modes.png",
        "report.html",
        "response.h5",
        "response.png",
        "rom.h5",
        "summary.json",
    ]


def test_page_of_a_run_shows_its_pictures(results):
    page = (results / "report.html").read_text(encoding="utf-8")
    for name in ("amplitudes.png", "modes.png", "response.png"):
        assert base64.b64encode((results / name).read_bytes()).decode() in page


def test_run_names_its_results_after_the_scene(scene, monkeypatch):
    asked = []
    monkeypatch.setattr("nanorom.workflow.run", lambda scene, where, *_, **__: asked.append(where))
    assert main(["run", str(scene)]) == 0
    assert asked == [Path("results/drum")]


def test_run_finds_the_exact_frequencies_of_the_drum(results):
    model = ReducedModel.load(results / "rom.h5")
    assert np.allclose(model.frequency, DRUM_FREQUENCIES, rtol=FREQUENCY_TOLERANCE, atol=0)
    assert model.label == ("f01", "f11s", "f11c")


def test_run_follows_every_level_and_finds_the_duffing_folds(results):
    response = Response.load(results / "response.h5")
    assert len(response.diagrams) == 2
    for diagram in response.diagrams:
        folds = [point for point in diagram.special_points if point.type == "LP"]
        assert len(folds) == 2
        assert all(point.omega > 2 * np.pi * response.frequency[0] for point in folds)


def test_summary_agrees_with_the_files(results):
    summary = json.loads((results / "summary.json").read_text())
    model = ReducedModel.load(results / "rom.h5")
    response = Response.load(results / "response.h5")
    assert [mode["frequency_Hz"] for mode in summary["modes"]] == model.frequency.tolist()
    assert [mode["cubic_N_per_m3"] for mode in summary["modes"]] == [
        model.cubic[r, r, r, r] for r in range(3)
    ]
    found = [
        [point["frequency_Hz"] for point in level["special_points"]]
        for level in summary["response"]
    ]
    assert found == [
        [point.omega / (2 * np.pi) for point in diagram.special_points]
        for diagram in response.diagrams
    ]
    assert summary["response"][1]["direct"] == {"level": 20.0, "unit": "Pa"}


def test_scene_in_the_model_reads_back_as_the_scene(results, drum_toml):
    from nanorom.scene.scene import Scene

    assert Scene.from_toml(ReducedModel.load(results / "rom.h5").scene) == Scene.from_toml(
        drum_toml
    )


def test_overrides_reach_the_reduction(tmp_path, scene):
    output = tmp_path / "rom.h5"
    arguments = ["reduce", str(scene), "-o", str(output), "--modes", "1,3", "--in-plane", "fixed"]
    assert main([*arguments, "--method", "step", "--degree", "4", "--mesh-size", "1 um"]) == 0
    model = ReducedModel.load(output)
    assert model.number.tolist() == [1, 3]
    assert (model.method, model.in_plane) == ("step", "fixed")
    assert model.diagnostics["degree"] == 4


@pytest.mark.mpi
@pytest.mark.skipif(shutil.which("mpirun") is None, reason="needs mpirun")
def test_two_ranks_write_the_model_of_one(tmp_path, scene, results):
    output = tmp_path / "two.h5"
    launch = ["mpirun", "--oversubscribe", "-n", "2"]
    allow = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    done = subprocess.run(
        [*launch, sys.executable, "-m", "nanorom", "reduce", str(scene), "-o", str(output)],
        capture_output=True,
        text=True,
        env={**os.environ, **allow, "OMPI_MCA_btl": "^tcp,ofi"},
        timeout=LONGEST,
    )
    assert done.returncode == 0, (done.stdout, done.stderr)
    one, two = ReducedModel.load(results / "rom.h5"), ReducedModel.load(output)
    assert np.allclose(two.frequency, one.frequency, rtol=1e-10, atol=0)
    assert np.abs(two.cubic - one.cubic).max() <= 1e-10 * np.abs(one.cubic).max()
