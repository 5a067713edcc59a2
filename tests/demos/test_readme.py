"""What the README tells is true: its code runs, its scene is the demo's, its errors are bounds."""

import re
import shlex
from pathlib import Path

import pytest

import nanorom
from nanorom.cli.main import main
from tests.demos.accuracy import ROWS

REPOSITORY = Path(__file__).parents[2]
README = (REPOSITORY / "README.md").read_text(encoding="utf-8")

FREQUENCY_TOLERANCE = 1e-6  # the default of scenes
PAPER_F01 = 21.15119357e6  # Hz; spectral solution of the paper's drum, no finite elements


def block(language: str, number: int = 0) -> str:
    return re.findall(rf"^```{language}\n(.*?)^```", README, re.DOTALL | re.MULTILINE)[number]


def test_ten_lines_of_python_do_the_whole_job(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    exec(compile(block("python"), "README.md", "exec"), names)
    assert {path.name for path in tmp_path.iterdir()} == {"rom.h5", "modes.png", "response.png"}
    assert names["model"].frequency[0] == pytest.approx(PAPER_F01, rel=FREQUENCY_TOLERANCE)
    assert len(names["response"].diagrams[-1].points("LP")) == 2
    assert len([line for line in block("python").splitlines() if line.strip()]) == 10


def test_continuation_needs_no_film(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    exec(compile(block("python", 1), "README.md", "exec"), {})
    assert [path.name for path in tmp_path.iterdir()] == ["diagram.png"]
    told = capsys.readouterr().out
    assert told.startswith("3 branches") and "LP" in told and "PD" in told


def test_scene_is_that_of_the_drum_demo():
    scene = nanorom.Scene.from_file(REPOSITORY / "demos/drum.toml")
    assert nanorom.Scene.from_toml(block("toml")) == scene


COMMANDS = [
    "plan", "run", "reduce", "info", "respond", "verify",
    "tune", "plot", "plot", "plot", "view", "identify", "export", "export"
]  # fmt: skip


def test_commands_work_one_after_the_other(tmp_path, monkeypatch, capsys):
    (tmp_path / "demos").symlink_to(REPOSITORY / "demos")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("webbrowser.open", lambda page: None)
    lines = re.findall(r"^ +\./run nanorom (.*?)(?: +#.*)?$", README, re.MULTILINE)
    assert [line.split()[0] for line in lines] == COMMANDS
    for line in lines:
        assert main(shlex.split(line)) == 0, capsys.readouterr().err
    assert (tmp_path / "results/amplitudes.png").is_file()


def test_files_and_modules_that_are_named_exist():
    package = REPOSITORY / "nanorom"
    for name in re.findall(r"`((?:fem/|continuation/|plots/)\w*)`", README):
        assert (package / f"{name}.py").is_file() or (package / name).is_dir(), name
    for name in re.findall(r"demos/[\w-]+\.\w+|docker/[\w-]+(?:\.\w+)?", README):
        assert (REPOSITORY / name).is_file(), name


def test_table_of_the_model_file_is_complete(tmp_path, make_model):
    import h5py

    make_model().save(tmp_path / "rom.h5")
    with h5py.File(tmp_path / "rom.h5") as file:
        missing = [name for name in file if f"`{name}`" not in README and f"`{name}/" not in README]
    assert not missing


PRINTED = re.findall(r"^\| ([^|]*) \| ([^|]*) \| \d+e-\d+ \| (\d+e-\d+) \|$", README, re.MULTILINE)


def test_accuracy_table_has_every_row():
    assert [(quantity, exact) for quantity, exact, _ in PRINTED] == [
        (quantity, exact) for quantity, (exact, _) in ROWS.items()
    ]


@pytest.mark.parametrize(("quantity", "exact", "bound"), PRINTED)
def test_error_is_within_the_printed_one(quantity, exact, bound):
    assert ROWS[quantity][1]() < float(bound)
