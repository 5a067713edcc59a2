"""Names that a table holds are listed in that table alone: a new row reaches everything."""

import ast
from functools import cache
from pathlib import Path

import attrs
import pytest

import nanorom
from nanorom.continuation.orbits import bifurcations
from nanorom.measurement.unknowns import UNKNOWNS
from nanorom.rom.model import ReducedModel
from nanorom.scene.film import MODELS
from nanorom.scene.patterns import DIRECT, PARAMETRIC

PACKAGE = Path(nanorom.__file__).parent
TABLES = {  # names, and where they may be listed
    "direct patterns": (set(DIRECT), "scene/patterns"),
    "parametric patterns": (set(PARAMETRIC), "scene/patterns"),
    "unknowns of a fit": (set(UNKNOWNS), "measurement/unknowns.py"),
    "arrays of the model": ({field.name for field in attrs.fields(ReducedModel)}, "rom/model.py"),
    "models of a film": (set(MODELS), "scene/film.py"),
    "bifurcations": (set(bifurcations.KINDS), "continuation/orbits/bifurcations.py"),
}
OTHERS = {
    "continuation/tori/torus.py": "a table of its own, of the bifurcations of tori",
    "fem/routes/registry.py": "the route of each model: `test_house` holds it against `MODELS`",
}
SCHEMA = ("rom/", "files/")  # what checks, cuts, writes and reads arrays; a report chooses columns
SEVERAL = 3  # names side by side that make a list of them; two may be a pair with a meaning


@cache
def listed(file: Path) -> list[tuple[int, set[str]]]:
    """Line and words of every tuple, list, set and dictionary of words in a file."""
    found = []
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        parts = getattr(node, "keys", None) if isinstance(node, ast.Dict) else None
        if isinstance(node, (ast.Tuple, ast.List, ast.Set)):
            parts = node.elts
        words = {part.value for part in parts or [] if isinstance(part, ast.Constant)}
        found.append((getattr(node, "lineno", 0), {w for w in words if isinstance(w, str)}))
    return found


@pytest.mark.parametrize("table", TABLES)
def test_names_are_listed_once(table):
    names, home = TABLES[table]
    assert len(names) > 1
    for file in sorted(PACKAGE.rglob("*.py")):
        place = file.relative_to(PACKAGE).as_posix()
        if table.startswith("arrays") and not place.startswith(SCHEMA):
            continue
        if place.startswith(home) or place in OTHERS or "meshes" in place:
            continue
        for line, words in listed(file):
            several = min(SEVERAL, len(names))
            assert len(words & names) < several, f"{place}:{line}: {sorted(words & names)}"


KINDS = {
    kind.__name__
    for pattern in (*DIRECT.values(), *PARAMETRIC.values())
    for kind in pattern.__mro__
    if kind is not object and kind.__name__ != "ABC"
}  # classes of patterns and of their kinds


def kinds_asked(text: str) -> list[int]:
    """Lines that ask of what kind a pattern is, by themselves or by dispatch."""
    found = []
    for node in ast.walk(ast.parse(text)):
        asked: list[ast.AST] = []
        if isinstance(node, ast.Call) and ast.unparse(node.func) in ("isinstance", "issubclass"):
            asked = list(node.args)
        elif isinstance(node, ast.FunctionDef):
            if any("register" in ast.unparse(each) for each in node.decorator_list):
                asked = [each.annotation for each in node.args.args if each.annotation]
        names = {part.id for each in asked for part in ast.walk(each) if isinstance(part, ast.Name)}
        if names & KINDS:
            found.append(node.lineno)
    return found


def test_the_search_finds_a_question_by_the_kind_of_a_pattern():
    dispatched = "@force.register\ndef _(pattern: Areal):\n    pass"
    assert kinds_asked("if issubclass(kind, Proportional):\n    pass") == [1]
    assert len(kinds_asked(dispatched)) == 1
    assert kinds_asked("def force(pattern: Areal):\n    pass") == []


def test_nobody_asks_of_what_kind_a_pattern_is():
    """What a pattern does to a film is its own method, in terms of simple forces."""
    for file in sorted(PACKAGE.rglob("*.py")):
        assert not kinds_asked(file.read_text(encoding="utf-8")), file


SPECIAL = {name for name, kind in vars(bifurcations).items() if isinstance(kind, bifurcations.Kind)}
CODES = set(bifurcations.KINDS)
OWN_TYPES = ("tori/events.py", "tori/torus.py", "curves/rest.py")  # of tori and states at rest


def kinds_compared(text: str) -> list[int]:
    """Lines that compare a kind of special point with one of them, by identity or by its code."""
    return [
        node.lineno
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Compare)
        and any(
            (isinstance(part, ast.Name) and part.id in SPECIAL)
            or (isinstance(part, ast.Attribute) and part.attr in SPECIAL)
            or (isinstance(part, ast.Constant) and part.value in CODES)
            for side in (node.left, *node.comparators)
            for part in ast.walk(side)
        )
    ]


def test_the_search_finds_a_question_by_a_special_point_s_name():
    for question in ("point.kind is FOLD", "kind is not bifurcations.TORUS", 'p.type == "NS"'):
        assert kinds_compared(f"if {question}:\n    pass") == [1]
    assert kinds_compared("if point.kind.turns:\n    pass") == []


def test_nobody_asks_which_special_point_it_is():
    """What follows of a kind stands in its row and in its condition, as attributes."""
    for file in sorted(PACKAGE.rglob("*.py")):
        place = file.relative_to(PACKAGE).as_posix()
        if not place.endswith(("orbits/bifurcations.py", "orbits/conditions.py", *OWN_TYPES)):
            assert not kinds_compared(file.read_text(encoding="utf-8")), file


WORDS = set(MODELS) - {"auto"}  # which is one of other choices, too


def models_compared(text: str) -> list[int]:
    """Lines on which a word for a model of a film is compared with something."""
    return [
        node.lineno
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Compare)
        and any(
            isinstance(part, ast.Constant) and part.value in WORDS
            for side in (node.left, *node.comparators)
            for part in ast.walk(side)
        )
    ]


def test_the_search_finds_a_question_by_the_model_s_word():
    assert models_compared('if scene.plate.model in ("beam", "shell"):\n    pass') == [1]
    assert models_compared("if scene.plate.rules.springs is None:\n    pass") == []


def test_nobody_asks_by_the_model_s_word():
    """What a model needs, allows and makes stands in its rows: `MODELS` and the registry."""
    for file in sorted(PACKAGE.rglob("*.py")):
        text = file.read_text(encoding="utf-8")
        assert not models_compared(text), file
