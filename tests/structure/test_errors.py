"""No error is swallowed: who catches one raises, records it, or says why nothing is lost."""

import ast
from pathlib import Path

import pytest

TOP = Path(__file__).parents[2] / "nanorom"
LEAST = 20  # silent handlers with a reason: fewer, and the search has stopped to find them
NOTHING = (ast.Pass, ast.Continue, ast.Break, ast.Return)


def is_silent(handler: ast.ExceptHandler) -> bool:
    """Whether nothing of the error is kept: no statement but a way out, and no word about it."""
    if not all(isinstance(statement, NOTHING) for statement in handler.body):
        return False
    for node in (node for statement in handler.body for node in ast.walk(statement)):
        if isinstance(node, ast.Name) and node.id == handler.name:
            return False
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value:
            return False  # an ending, a message
    return True


def unexplained(text: str) -> tuple[list[int], int]:
    """Lines of silent handlers without a comment, and how many have one."""
    lines, bare, explained = text.splitlines(), [], 0
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.With):
            silent = any("suppress(" in ast.unparse(item) for item in node.items)
            last = node.lineno
        elif isinstance(node, ast.ExceptHandler):
            silent, last = is_silent(node), node.end_lineno or node.lineno
        else:
            continue
        if silent and "#" in "".join(lines[node.lineno - 1 : last]):
            explained += 1
        elif silent:
            bare.append(node.lineno)
    return bare, explained


@pytest.mark.parametrize("way", ["return", "return None", "pass", "continue", "return [], {}"])
def test_the_search_finds_what_swallows_an_error(way):
    text = f"def g():\n  for x in y:\n    try:\n      f()\n    except E:\n      {way}\n"
    assert unexplained(text) == ([5], 0)


@pytest.mark.parametrize("way", ["return str(e)", "a.append(e)", "raise F from e", 'return "why"'])
def test_the_search_lets_pass_what_keeps_an_error(way):
    text = f"def g():\n    try:\n        f()\n    except E as e:\n        {way}\n"
    assert unexplained(text) == ([], 0)


def test_no_error_is_swallowed_without_a_reason():
    found = {path: unexplained(path.read_text("utf-8")) for path in TOP.rglob("*.py")}
    assert sum(explained for _, explained in found.values()) >= LEAST
    assert {path: lines for path, (lines, _) in found.items() if lines} == {}
