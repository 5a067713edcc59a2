"""What CONTRIBUTING.md and tests/README.md name is there, and no folder is left out."""

import ast
import re
import tomllib
from pathlib import Path

import attrs
import pytest

from nanorom.scene.fields import TABLES
from nanorom.scene.scene import Scene
from tests.scene import keys

ROOT = Path(__file__).parents[2]
TESTS = ROOT / "tests"
PLACES = {"CONTRIBUTING.md": (ROOT, ROOT / "nanorom"), "tests/README.md": (TESTS,)}
LEAST = 20  # names in a page: fewer, and the pattern has stopped to find them


def named(page: str) -> set[str]:
    """Paths in a page: in backquotes, with a slash or a suffix."""
    quoted = re.findall(r"`([\w./-]+)`", (ROOT / page).read_text(encoding="utf-8"))
    return {name for name in quoted if "/" in name[:-1] or re.search(r"\.(py|md)$", name)}


@pytest.mark.parametrize("page", PLACES)
def test_what_a_page_names_is_there(page):
    found = named(page)
    assert len(found) >= LEAST
    for name in found:
        places = [place / name for place in PLACES[page]]
        places += [place.with_suffix(".py") for place in places if not place.suffix]
        assert any(place.exists() for place in places), name


def test_every_test_file_begins_with_what_it_shows():
    for file in TESTS.rglob("test_*.py"):
        assert ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))), file


def test_every_folder_of_tests_has_a_row_in_the_page():
    page = (TESTS / "README.md").read_text(encoding="utf-8")
    for folder in {file.relative_to(TESTS).parent for file in TESTS.rglob("test_*.py")}:
        assert f"`{folder}/" in page, folder


def test_citation_names_the_version_of_the_package():
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text()


@pytest.mark.parametrize("section", keys.SECTIONS)
def test_every_key_of_a_scene_says_what_it_means_and_allows(section):
    for field in keys.fields(keys.SECTIONS[section]):
        assert field.metadata["about"] and field.metadata["allowed"], field.metadata["key"]


def test_reference_of_scenes_is_what_the_classes_declare():
    text = keys.DOCUMENT.read_text("utf-8")
    assert keys.with_tables(text) == text, "run: ./run python -m tests.scene.keys"
    tables = {field.name: field.metadata.get(TABLES) for field in attrs.fields(Scene)}
    sections = {f"[{several}]" if several else name for name, several in tables.items()}
    assert {name for name in sections if f"## [{name}]" not in text} == set()
