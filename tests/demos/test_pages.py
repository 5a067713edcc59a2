"""demos/README.md names every demo and shows pictures that are there, small and linked from."""

import re
from pathlib import Path

import pytest

DEMOS = Path(__file__).parents[2] / "demos"
PAGE = (DEMOS / "README.md").read_text(encoding="utf-8")
LARGEST = 150_000  # bytes of a picture in the repository
PICTURES = re.findall(r"!\[[^\]]+\]\(([^)]+)\)", PAGE)


@pytest.mark.parametrize("name", PICTURES)
def test_pictures_are_there_and_small(name):
    assert 5_000 < (DEMOS / name).stat().st_size < LARGEST


def test_every_picture_is_shown():
    assert {f"pictures/{path.name}" for path in (DEMOS / "pictures").iterdir()} == set(PICTURES)


def test_every_demo_is_named_and_every_command_is_a_demo():
    scripts = {path.name for path in DEMOS.glob("*.py")} - {"phenomena.py"}  # shared by others
    assert {name for name in scripts if name not in PAGE} == set()
    for name in re.findall(r"demos/([\w-]+\.\w+)", PAGE):
        assert (DEMOS / name).is_file(), name


def test_page_is_linked_from_the_readme():
    assert "(demos/README.md)" in (DEMOS.parent / "README.md").read_text(encoding="utf-8")
