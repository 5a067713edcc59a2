"""What is wished of a device, as text: formulas of quantities and keys, and conditions on them.

    f(f11c) / f1 - 2        onset1 * Q1        f(f11c) / f1 = 2 +- 0.1 %        f1 >= 20 MHz

A formula has + - * / **, brackets, log, sqrt, exp, abs, numbers, names of quantities
(`nanorom.rom.quantities`) and keys of the scene that vary, in SI.
"""

from __future__ import annotations

import ast
import cmath
import operator
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from nanorom.errors import ModelError, SceneError
from nanorom.rom.quantities import NAME, unit_of
from nanorom.scene import units
from nanorom.scene.spread import Spread
from nanorom.types import Array

SMALL = 1e-30  # imaginary steps: derivatives without differences (Squire and Trapp 1998)
LONGEST = 500  # characters
_QUANTITY = re.compile(rf"(?<![\w.]){NAME}(?![\w(])")
_OPERATORS: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
_FUNCTIONS: dict[str, Callable[[complex], complex]] = {
    "log": cmath.log,
    "sqrt": cmath.sqrt,
    "exp": cmath.exp,
    "abs": lambda x: -x if x.real < 0 else x,
}
ALLOWED = "formulas such as f(f11c)/f1 - 2: + - * / **, brackets, " + ", ".join(_FUNCTIONS)
RELATIONS = ("<=", ">=", "=")


@attrs.frozen(eq=False)
class Expression:
    """A formula; names: of quantities in it, keys: of the scene in it; _tree: what it computes."""

    text: str
    names: tuple[str, ...]
    keys: tuple[str, ...]
    _tree: ast.expr
    _leaves: dict[str, str]

    @classmethod
    def read(cls, text: Any, keys: Sequence[str], where: str) -> Expression:
        """A formula of quantities, and of keys of a scene; raises SceneError."""
        if not isinstance(text, str) or not text.strip() or len(text) > LONGEST:
            raise units.wrong(where, text, ALLOWED)
        leaves: dict[str, str] = {}  # by the placeholder in the tree

        def held(name: str) -> str:
            leaves[f"_{len(leaves)}"] = name
            return f"_{len(leaves) - 1}"

        plain = text.strip().replace("^", "**")
        if re.search(r"(?<!\w)_", plain):  # as placeholders begin
            raise units.wrong(where, text, ALLOWED)
        for key in sorted(keys, key=len, reverse=True):
            plain = re.sub(rf"(?<![\w.]){re.escape(key)}(?![\w.])", lambda m: held(m[0]), plain)
        plain = _QUANTITY.sub(lambda match: held(match[0]), plain)
        try:
            tree = ast.parse(plain, mode="eval").body
        except (SyntaxError, ValueError, RecursionError, MemoryError):
            raise units.wrong(where, text, ALLOWED) from None
        for node in ast.walk(tree):
            _check(node, leaves, keys, where, text)
        found = list(dict.fromkeys(leaves.values()))
        names = tuple(name for name in found if name not in keys)
        return cls(text.strip(), names, tuple(x for x in found if x in keys), tree, leaves)

    def value(self, known: Mapping[str, float]) -> float:
        """Of quantities and keys by name, in SI; raises ModelError where it has none."""
        return self._of(known).real

    def slope(self, known: Mapping[str, float], slopes: Mapping[str, Array]) -> Array:
        """Its derivatives (p,) by those of its quantities and keys."""
        sizes = {len(slopes[name]) for name in (*self.names, *self.keys)} or {0}
        found = np.zeros(max(sizes))
        for place in range(len(found)):
            moved = {
                name: complex(known[name], SMALL * float(slopes[name][place]))
                for name in (*self.names, *self.keys)
            }
            found[place] = self._of(moved).imag / SMALL
        return found

    def _of(self, known: Mapping[str, complex]) -> complex:
        try:
            found = complex(self._walk(self._tree, known))
        except (ArithmeticError, ValueError):
            found = complex(np.nan)
        if not cmath.isfinite(found):
            raise ModelError(f"{self.text}: has no value here")
        return found

    def _walk(self, node: ast.expr, known: Mapping[str, complex]) -> complex:
        match node:
            case ast.Constant(value=value):
                return complex(value)  # type: ignore[arg-type]  # checked to be a number
            case ast.Name(id=name):
                return known[self._leaves[name]]
            case ast.UnaryOp(op=op, operand=inner):
                found = self._walk(inner, known)
                return -found if isinstance(op, ast.USub) else found
            case ast.BinOp(left=left, op=op, right=right):
                first, second = self._walk(left, known), self._walk(right, known)
                return complex(_OPERATORS[type(op)](first, second))
            case ast.Call(func=ast.Name(id=name), args=[inner]):
                return _FUNCTIONS[name](self._walk(inner, known))
        raise AssertionError(node)  # `read` lets nothing else pass


def _check(
    node: ast.AST, leaves: Mapping[str, str], keys: Sequence[str], where: str, text: str
) -> None:
    """Raise SceneError for a part of a formula that none may have."""
    if isinstance(node, ast.Constant):
        fine = type(node.value) in (int, float)
    elif isinstance(node, ast.Name):
        fine = node.id in leaves or node.id in _FUNCTIONS
    elif isinstance(node, ast.Call):
        named = isinstance(node.func, ast.Name) and node.func.id in _FUNCTIONS
        fine = named and len(node.args) == 1 and not node.keywords
    elif isinstance(node, ast.UnaryOp):
        fine = isinstance(node.op, (ast.USub, ast.UAdd))
    elif isinstance(node, ast.BinOp):
        fine = type(node.op) in _OPERATORS
    else:
        fine = isinstance(node, (ast.operator, ast.unaryop, ast.expr_context))
    if not fine:
        told = ast.unparse(node) if isinstance(node, ast.expr) else text
        beside = f", quantities, and {', '.join(keys)}" if keys else " and quantities"
        raise SceneError(f"{where}: found {told!r} in {text!r}; allowed: {ALLOWED}{beside}")


@attrs.frozen(eq=False)
class Condition:
    """left relation right; width: how far an equality may be off, or None."""

    text: str
    left: Expression
    relation: str
    right: Expression
    width: float | None

    @classmethod
    def read(cls, text: Any, keys: Mapping[str, str], where: str) -> Condition:
        """Two formulas, or a formula and a quantity with its unit; raises SceneError.

        keys: of the scene that vary, with their units, "" where none is known.
        """
        relation = next((r for r in RELATIONS if isinstance(text, str) and r in text), None)
        if relation is None or text.count("=") != 1:
            raise units.wrong(where, text, "conditions such as f(f11c)/f1 = 2, f1 >= 20 MHz")
        first, second = (part.strip() for part in text.split(relation))
        spread, width = Spread.taken(second, where), None
        if spread is not None:
            if relation != "=":
                raise units.wrong(where, text, "+- behind an equality alone")
            second, width = repr(spread.mean), spread.deviation
        told = {unit for side in (first, text.split(relation)[1]) if (unit := _unit(side, keys))}
        if len(told) > 1:
            raise units.wrong(
                where, text, f"both sides of one unit; these are {' and '.join(told)}"
            )
        sides = [
            Expression.read(_plain(side, where), list(keys), where) for side in (first, second)
        ]
        return cls(" ".join(text.split()), sides[0], relation, sides[1], width)

    @property
    def expressions(self) -> tuple[Expression, Expression]:
        """Both sides."""
        return self.left, self.right

    def gap(self, known: Mapping[str, float]) -> float:
        """What an equality is off by; how far an inequality is met."""
        gap = self.left.value(known) - self.right.value(known)
        return -gap if self.relation == "<=" else gap

    def slope(self, known: Mapping[str, float], slopes: Mapping[str, Array]) -> Array:
        """Derivatives (p,) of the gap."""
        gap = _padded(self.left.slope(known, slopes), self.right.slope(known, slopes))
        return -gap if self.relation == "<=" else gap

    def violation(self, known: Mapping[str, float]) -> float:
        """How far it is from being met, by the size of its sides."""
        size = max(abs(self.left.value(known)), abs(self.right.value(known))) or 1.0
        gap = self.gap(known)
        return abs(gap) / size if self.relation == "=" else max(-gap, 0.0) / size


def _padded(first: Array, second: Array) -> Array:
    """The difference; a formula of numbers alone has no derivatives."""
    if not len(first) or not len(second):
        return first if len(first) else -second
    return first - second


def _unit(side: str, keys: Mapping[str, str]) -> str:
    """Of a side that is a single quantity, a key, or a number with its unit; "" of others."""
    side = re.split(r"\+-|\+/-|±", side)[0].strip()
    try:
        return keys.get(side) or unit_of(side) or units.of_any_dimension(side, "")[1]
    except SceneError:  # a formula, whose unit is not known
        return ""


def _plain(side: str, where: str) -> str:
    """A side that is a quantity with its unit, as a number in SI."""
    try:
        number, unit = units.of_any_dimension(side, where)
    except SceneError:  # a formula, which is read as one
        return side
    return repr(number) if unit else side
