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


def leads_to_raise(tree: ast.AST) -> set[int]:
    """Lines of handlers that break off a loop after which an error is raised."""
    found: set[int] = set()
    for node in ast.walk(tree):
        for block in (getattr(node, name, None) or [] for name in ("body", "orelse")):
            for loop, after in zip(block, block[1:]) if isinstance(block, list) else ():
                if isinstance(loop, ast.For | ast.While) and isinstance(after, ast.Raise):
                    inside = (n for n in ast.walk(loop) if isinstance(n, ast.ExceptHandler))
                    found |= {n.lineno for n in inside if isinstance(n.body[0], ast.Break)}
    return found


def unexplained(text: str) -> tuple[list[int], int]:
    """Lines of silent handlers without a comment, and how many have one."""
    tree, lines, bare, explained = ast.parse(text), text.splitlines(), [], 0
    raising = leads_to_raise(tree)
    for node in ast.walk(tree):
        if isinstance(node, ast.With):
            silent = any("suppress(" in ast.unparse(item) for item in node.items)
            last = node.lineno
        elif isinstance(node, ast.ExceptHandler):
            silent = is_silent(node) and node.lineno not in raising
            last = node.end_lineno or node.lineno
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


def test_breaking_off_before_an_error_is_no_loss():
    text = "def g():\n  for x in y:\n    try:\n      f()\n    except E:\n      break\n"
    assert unexplained(text) == ([5], 0)
    assert unexplained(text + "  raise F\n") == ([], 0)


def test_no_error_is_swallowed_without_a_reason():
    found = {path: unexplained(path.read_text("utf-8")) for path in TOP.rglob("*.py")}
    assert sum(explained for _, explained in found.values()) >= LEAST
    assert {path: lines for path, (lines, _) in found.items() if lines} == {}
