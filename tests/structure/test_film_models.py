"""Film models are values: nobody changes one from outside, their forms are made for a state."""

import ast
import importlib
import inspect
import re
from pathlib import Path

import attrs
import pytest

TOP = Path(__file__).parents[2] / "nanorom"
MODELS = [path.stem for path in (TOP / "fem" / "models").glob("*.py") if path.stem != "__init__"]
NOT_MODELS = {"operators"}  # what assembles their forms: it holds matrices and work space
FILMS = re.compile(r"(^|_)(film|plate|shell|about)$")  # names by which the package calls a model


def classes(module: str) -> list[type]:
    """Those that a module of `fem/models` defines."""
    loaded = importlib.import_module(f"nanorom.fem.models.{module}")
    every = inspect.getmembers(loaded, inspect.isclass)
    return [kind for _, kind in every if kind.__module__ == loaded.__name__]


@pytest.mark.parametrize("module", sorted(set(MODELS) - NOT_MODELS))
def test_film_models_are_frozen(module):
    for kind in classes(module):
        assert attrs.has(kind), kind
        blank = object.__new__(kind)
        with pytest.raises(attrs.exceptions.FrozenInstanceError):
            setattr(blank, attrs.fields(kind)[0].name, None)


def test_there_are_models_to_look_at():
    assert {"Plate", "Shell", "Beam", "State"} <= {k.__name__ for m in MODELS for k in classes(m)}


def names(node: ast.expr) -> list[str]:
    """Names along a chain of attributes and subscripts, outermost last: a.b[0].c -> [a, b, c]."""
    if isinstance(node, ast.Subscript):
        return names(node.value)
    if isinstance(node, ast.Attribute):
        return [*names(node.value), node.attr]
    return [node.id] if isinstance(node, ast.Name) else []


def targets(tree: ast.AST) -> list[ast.expr]:
    """What a module assigns to, tuples taken apart."""
    found: list[ast.expr] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign):
            found += node.targets
        elif isinstance(node, ast.AugAssign | ast.AnnAssign):
            found.append(node.target)
    return [part for one in found for part in (one.elts if isinstance(one, ast.Tuple) else [one])]


def written(text: str) -> list[str]:
    """Assignments that change something of a film model."""
    chains = [names(target) for target in targets(ast.parse(text))]
    return [".".join(chain) for chain in chains if any(FILMS.search(n) for n in chain[:-1])]


@pytest.mark.parametrize(
    "text",
    [
        "plate.shape = w",
        "self.plate.tension.value = 1.0",
        "about.x, other = 1, 2",
        "film.state.x.array[:] = 0.0",
        "model.shell.degree += 1",
    ],
)
def test_the_search_finds_what_changes_a_model(text):
    assert written(text)


def test_nothing_changes_a_film_model_from_outside():
    for path in TOP.rglob("*.py"):
        text = path.read_text("utf-8")
        assert not written(text), path
        assert not re.search(r"(?<!self)\._constants\b", text), path
