"""The rules of the house: who imports whom, and how large rooms, modules and functions are."""

import ast
import re
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

TOP = Path(__file__).parents[2] / "nanorom"
LONGEST_MODULE, LONGEST_FUNCTION = 400, 60  # lines
ROOMS = {"bench", "cli", "continuation", "devices", "exact", "export", "fem", "files"}
ROOMS |= {"measurement", "plots", "report", "results", "rom", "scene", "verification"}
LOOSE = {"__main__", "compiler", "errors", "launch", "types", "version", "workflow"}
BASE = {"errors", "types"}

# what a room may import beside itself; the finite elements apart
MAY_IMPORT = {
    "scene": BASE,
    "continuation": BASE | {"compiler"},
    "files": BASE | {"version"},
    "rom": BASE | {"files", "scene", "continuation"},  # the last not when it is imported
    "results": BASE | {"continuation", "files", "launch", "rom", "scene", "version"},
    "exact": BASE | {"rom", "scene"},
    "export": BASE | {"continuation", "files", "results", "rom", "scene"},
}
REACH_THE_FILM = {"bench", "cli", "devices", "measurement", "verification", "workflow", "fem"}
# from the bottom up; a room imports from those below it and from its own line
FLOORS = [
    {"scales", "symmetry", "stopwatch", "solvers"},
    {"mesh"},
    {"fields", "plan"},
    {"models", "plan_text"},
    {"statics"},
    {"modes"},
    {"output", "tensors"},
    {"routes"},
    {"reduce", "sensitivity", "spectrum", "tuning"},
]
# the finite elements may take these of the rest: what is asked, what is found, how it is kept
BESIDE_THE_FILM = BASE | {"compiler", "files", "results", "rom", "scene", "version"}


def modules() -> dict[str, Path]:
    """Path of every module by its name, packages under their own."""
    found = {}
    for path in sorted(TOP.rglob("*.py")):
        name = ".".join(path.relative_to(TOP.parent).with_suffix("").parts)
        found[name.removesuffix(".__init__")] = path
    return found


MODULES = modules()


def imported(path: Path, late: bool = True) -> set[str]:
    """Modules of the package that a module imports; ``late``: also within functions."""
    found: set[str] = set()

    def visit(node: ast.AST) -> None:
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            return
        if isinstance(node, ast.FunctionDef) and not late:
            return
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("nanorom"):
            names = [f"{node.module}.{alias.name}" for alias in node.names]
            found.update(name if name in MODULES else str(node.module) for name in names)
        elif isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names if alias.name in MODULES)
        for child in ast.iter_child_nodes(node):
            visit(child)

    visit(ast.parse(path.read_text("utf-8")))
    return found


GRAPH = {name: imported(path) - {name} for name, path in MODULES.items()}


def room(module: str) -> str:
    """First folder or module below the package."""
    return (module.split(".") + [""])[1]


def floor(module: str) -> int:
    """Floor of a module of the finite elements."""
    part = module.split(".")[2]
    return next(number for number, rooms in enumerate(FLOORS) if part in rooms)


def test_there_is_no_circle_of_imports():
    assert len(MODULES) > 100  # or the search has stopped to find them
    TopologicalSorter(GRAPH).prepare()  # raises CycleError, which names the circle


def test_every_file_is_in_a_room_of_the_house():
    tops = {room(name) for name in MODULES} - {""}
    assert tops == ROOMS | LOOSE
    inside = {name.split(".")[2] for name in MODULES if name.startswith("nanorom.fem.")}
    assert inside == set().union(*FLOORS)


@pytest.mark.parametrize("name", sorted(MAY_IMPORT))
def test_rooms_import_what_they_may(name):
    wrong = {
        (module, other)
        for module, others in GRAPH.items()
        for other in others
        if room(module) == name and room(other) not in MAY_IMPORT[name] | {name}
    }
    assert not wrong


def test_only_few_rooms_reach_the_finite_elements():
    reached = {room(m) for m, others in GRAPH.items() if any(room(o) == "fem" for o in others)}
    assert reached <= REACH_THE_FILM


def test_the_wall_stands_when_a_model_is_imported():
    for name, path in MODULES.items():
        if room(name) == "rom":
            early = {room(other) for other in imported(path, late=False)}
            assert not early & {"continuation", "fem"}, name


def test_finite_elements_are_imported_from_below_alone():
    for module, others in GRAPH.items():
        if not module.startswith("nanorom.fem."):
            continue
        for other in others:
            if room(other) != "fem":
                assert room(other) in BESIDE_THE_FILM, (module, other)
            elif other != "nanorom.fem":
                assert floor(other) <= floor(module), (module, other)


@pytest.mark.parametrize("library", ["dolfinx", "petsc4py", "slepc4py", "basix", "ufl"])
def test_libraries_of_finite_elements_stay_in_their_rooms(library):
    using = re.compile(rf"^\s*(?:from|import) {library}\b", re.MULTILINE)
    found = {room(name) for name, path in MODULES.items() if using.search(path.read_text("utf-8"))}
    assert found <= {"fem", "bench", "verification"}


@pytest.mark.parametrize("name", sorted(MODULES))
def test_modules_and_functions_are_of_one_concept(name):
    path = MODULES[name]
    text = path.read_text("utf-8")
    assert len(text.splitlines()) <= LONGEST_MODULE
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            lines = (node.end_lineno or node.lineno) - node.lineno + 1
            assert lines <= LONGEST_FUNCTION, (node.name, lines)


def test_nothing_is_passed_for_what_it_is_not():
    for name, path in MODULES.items():
        assert not re.search(r"\bcast\(\s*Any\b", path.read_text("utf-8")), name


def test_no_error_is_taken_apart_by_its_words():
    for name, path in MODULES.items():
        assert not re.search(r"in str\(error\)|str\(error\)\.(find|index)", path.read_text()), name


def test_every_model_of_a_scene_has_a_route():
    from nanorom.fem.routes.registry import ROUTES
    from nanorom.scene.film import MODELS

    assert list(ROUTES) == list(MODELS)
