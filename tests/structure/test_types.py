"""What README shows is right to a type checker: converters of fields are typed."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
WRONG = """
import nanorom
nanorom.Disc(radius=["2.5 um"])
nanorom.Material(youngs_modulus="410 GPa", poisson_ratio=0.16)
nanorom.Modes(select=3)
nanorom.Sweep(start="0.8 f1", stop=None)
"""


@pytest.fixture(scope="module")
def errors(tmp_path_factory):
    """What mypy finds wrong in README's first example, and in the wrong program.

    One run, with the options of the package's own, whose cache serves: others cost a minute.
    """
    pytest.importorskip("mypy")
    if np.__version__ >= "2":
        pytest.skip("NumPy 2 describes its types otherwise")
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    example = re.search(r"```python\n(.*?)```", text, re.DOTALL)[1]
    assert "nanorom.reduce(" in example
    folder = tmp_path_factory.mktemp("programs")
    programs = {"example": example, "wrong": WRONG}
    for name, program in programs.items():
        (folder / f"{name}.py").write_text(program, encoding="utf-8")
    command = [sys.executable, "-m", "mypy", *(folder / f"{name}.py" for name in programs)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode in (0, 1), done.stderr
    lines = [line for line in done.stdout.splitlines() if ": error:" in line]
    return {name: [line for line in lines if f"{name}.py:" in line] for name in programs}


def test_the_first_example_of_the_readme_has_no_type_errors(errors):
    assert errors["example"] == []


def test_wrong_arguments_are_type_errors(errors):
    assert len(errors["wrong"]) == WRONG.count("\nnanorom.")
