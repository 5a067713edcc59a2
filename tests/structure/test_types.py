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


def errors(program: str, folder: Path) -> list[str]:
    """What mypy finds wrong in a program of a user."""
    (folder / "program.py").write_text(program, encoding="utf-8")
    command = [sys.executable, "-m", "mypy", "--follow-imports=silent", folder / "program.py"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode in (0, 1), done.stderr
    return [line for line in done.stdout.splitlines() if ": error:" in line]


@pytest.fixture(autouse=True)
def checker():
    pytest.importorskip("mypy")
    if np.__version__ >= "2":
        pytest.skip("NumPy 2 describes its types otherwise")


def test_the_first_example_of_the_readme_has_no_type_errors(tmp_path):
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    example = re.search(r"```python\n(.*?)```", text, re.DOTALL)[1]
    assert "nanorom.reduce(" in example
    assert errors(example, tmp_path) == []


def test_wrong_arguments_are_type_errors(tmp_path):
    assert len(errors(WRONG, tmp_path)) == WRONG.count("\nnanorom.")
