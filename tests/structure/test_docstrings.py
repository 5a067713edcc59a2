"""Public docstrings state shape and unit of what they take and give, and what they raise."""

import ast
import importlib
import inspect
import re
import textwrap

import attrs
import pytest

import nanorom.errors

PACKAGES = ("nanorom", "nanorom.continuation", "nanorom.plots")  # what they offer by name
MODULES = (  # beside these, what README, demos and the command line take
    "nanorom.export.export",
    "nanorom.measurement.calibration",
    "nanorom.measurement.data",
    "nanorom.measurement.identify",
    "nanorom.measurement.device.identify",
    "nanorom.measurement.unknowns",
    "nanorom.rom.linear",
    "nanorom.rom.motion",
    "nanorom.rom.patterns",
    "nanorom.rom.tables",
)
ERRORS = {
    name
    for name, kind in vars(nanorom.errors).items()
    if inspect.isclass(kind) and issubclass(kind, Exception) and not issubclass(kind, Warning)
}
ARRAYS = re.compile(r"\b(Array|ArrayLike|NDArray|Numbers)\b")
NUMBERS = re.compile(r"\b(Array|ArrayLike|NDArray|Numbers|float|complex)\b")
AXIS = r"(?:\.\.\.|\d*[A-Za-z]{0,2}\d*(?: [-+*] \d*[A-Za-z]{0,2})?)"
SHAPE = re.compile(rf"\({AXIS}(?:, ?{AXIS})*,?\)")
UNIT = re.compile(
    r"\b(m|Hz|N|kg|s|Pa|rad|W|V|J|dBm|nm)\b"
    r"|\b(SI|(?i:units?|multiples?|relative|dimensionless|ratio|factor|fraction|share|radians?))\b"
)
LEAST = 100  # objects: fewer, and the search has stopped to find them


def public():
    """Name and object of all that is public, once each."""
    found = {}
    for module in map(importlib.import_module, PACKAGES):
        found |= {f"{module.__name__}.{name}": getattr(module, name) for name in module.__all__}
    for module in map(importlib.import_module, MODULES):
        for name, value in vars(module).items():
            own = getattr(value, "__module__", None) == module.__name__
            kind = inspect.isroutine(value) or inspect.isclass(value)
            if own and kind and not name.startswith("_"):
                found[f"{module.__name__}.{name}"] = value
    for name, value in found.items():
        yield name, value
        if inspect.isclass(value):
            for member, thing in vars(value).items():
                thing = getattr(thing, "fget", thing) or getattr(thing, "__func__", thing)
                thing = getattr(thing, "__func__", thing)
                if not member.startswith("_") and inspect.isfunction(thing):
                    yield f"{name}.{member}", thing


EVERYTHING = dict(public())
FUNCTIONS = {name: value for name, value in EVERYTHING.items() if inspect.isfunction(value)}
CLASSES = {name: value for name, value in EVERYTHING.items() if attrs.has(value)}


def annotations(function) -> str:
    """Of arguments and result; truth values and whole numbers have no unit."""
    kinds = " ".join(str(kind) for kind in function.__annotations__.values())
    return re.sub(r"NDArray\[np\.(bool_|int\w*)\]", "", kinds)


def text(function) -> str:
    """Its docstring, or that of the method of a base that it fills in."""
    return inspect.getdoc(function) or ""


def raised(function, module, seen=()) -> set[str]:
    """Errors that a function and the private ones of its module that it calls raise."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
            names.add(getattr(node.exc.func, "id", ""))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            helper = vars(module).get(node.func.id)
            own = getattr(helper, "__module__", None) == module.__name__
            if inspect.isfunction(helper) and own and helper not in seen:
                names |= raised(helper, module, (*seen, helper))
    return names & ERRORS


def test_public_api_is_found():
    assert len(EVERYTHING) > LEAST


@pytest.mark.parametrize("name", EVERYTHING)
def test_everything_public_has_a_docstring(name):
    assert inspect.getdoc(EVERYTHING[name]), name


@pytest.mark.parametrize("name", FUNCTIONS)
def test_shapes_and_units_of_arguments_and_results_are_stated(name):
    function = FUNCTIONS[name]
    told, kinds = text(function), annotations(function)
    assert SHAPE.search(told) or not ARRAYS.search(kinds), f"no shape: {told}"
    assert UNIT.search(told) or not NUMBERS.search(kinds), f"no unit: {told}"


@pytest.mark.parametrize("name", CLASSES)
def test_shapes_and_units_of_attributes_are_stated(name):
    kind = CLASSES[name]
    told = inspect.getdoc(kind) or ""
    fields = [field for field in attrs.fields(kind) if not field.name.startswith("_")]
    for field in fields:
        if NUMBERS.search(str(field.type)):
            assert re.search(rf"\b{field.name}\b", told), f"{field.name} is not in: {told}"
    kinds = " ".join(str(field.type) for field in fields)
    assert SHAPE.search(told) or not ARRAYS.search(kinds), f"no shape: {told}"
    assert UNIT.search(told) or not NUMBERS.search(kinds), f"no unit: {told}"


@pytest.mark.parametrize("name", FUNCTIONS)
def test_errors_are_told_by_their_class(name):
    function = FUNCTIONS[name]
    told = text(function)
    missing = {
        error
        for error in raised(function, inspect.getmodule(function))
        if error not in told and "NanoromError" not in told
    }
    assert not missing, f"{missing} not in: {told}"
