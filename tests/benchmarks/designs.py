"""Designs beside scans by brute force, runs at a tenth of the tolerance and closed forms.

./run python -m tests.benchmarks.designs [drum] [string] [trampoline]
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import attrs
import numpy as np
from scipy.optimize import brentq

import nanorom
from nanorom.bench import report
from tests.devices.strings import STRING

HERE = Path(__file__).parent
DEMOS = HERE.parents[1] / "demos"
MESHES = Path(nanorom.__file__).parents[1] / "meshes"
COMMAND = "python -m tests.benchmarks.designs"


@attrs.frozen
class Problem:
    """A scene whose key varies between two bounds, and what its best device is.

    given: what `nanorom.design` is asked; formula: what is scanned, and equals wanted there, or is
    largest (None); points: of the scan; exact: the key's best value in closed form, if known.
    """

    name: str
    scene: nanorom.Scene
    key: str
    bounds: dict[str, Any]
    given: dict[str, Any]
    formula: str
    wanted: float | None
    points: int
    exact: float | None = None


@attrs.frozen
class Verified:
    """A row of the table: the scan's bounds on the best value, the design's, and its finer run."""

    problem: str
    scan: str
    found: str
    exact: str
    value: str
    finer: str
    devices: int
    seconds: float


def drum() -> Problem:
    """The paper's drum, of such a thickness that its second mode is at twice the first."""
    scene = nanorom.Scene.from_file(DEMOS / "drum.toml").with_(modes=2)
    bounds = {"from": "10 nm", "to": "100 nm", "spacing": "log"}
    given = {"conditions": "f2/f1 = 2", "starts": 2}
    return Problem("f2 = 2 f1", scene, "plate.thickness", bounds, given, "f2/f1", 2.0, 41)


def string_coefficient(spring: float) -> float:
    """E h w/(2 L) (int phi'^2)^2 of a string without bending that a spring holds at one end."""
    length, stretch = 1e-4, 250e9 * 5e-9 * 2e-6
    kl = brentq(lambda x: spring * length * np.sin(x) + x * np.cos(x), np.pi / 2, np.pi)
    slopes = (kl / length) ** 2 * length * (0.5 + np.sin(2 * kl) / (4 * kl))
    return float(stretch / (2 * length) * slopes**2)


def string() -> Problem:
    """A string whose Duffing coefficient is tuned through the spring at one end."""
    wanted = string_coefficient(3e4)
    bounds = {"from": "1e4 N/m^2", "to": "1e5 N/m^2", "spacing": "log"}
    given = {"conditions": f"b111 = {wanted!r}", "starts": 2}
    scene, key = nanorom.Scene.from_toml(STRING), "support.edge.left.spring"
    return Problem("string's b111", scene, key, bounds, given, "b111", wanted, 41, 3e4)


TRAMPOLINE = f"""
geometry = {{ shape = "mesh", file = "{MESHES}/trampoline.geo", scale = "100 um", \
parameters = {{ pad = 0.4, width = 0.2 }} }}
plate = {{ thickness = "50 nm", model = "plate" }}
material = {{ youngs_modulus = "250 GPa", poisson_ratio = 0.23, density = "3100 kg/m^3", \
loss = 1e-4 }}
tension = {{ stress = "1 GPa" }}
support = {{ edge = {{ ends = "clamped", free = "free" }} }}
modes = {{ count = 1 }}
accuracy = {{ tolerance = 1e-2 }}
"""


def trampoline() -> Problem:
    """A trampoline of nitride whose tethers are as wide as the largest f Q asks for."""
    scene = nanorom.Scene.from_toml(TRAMPOLINE)
    given = {"maximize": "f1 * Q1", "starts": 1, "evaluations": 12}
    bounds, key = {"from": 0.12, "to": 0.3}, "geometry.parameters.width"
    return Problem("largest f Q", scene, key, bounds, given, "f1*Q1", None, 7)


PROBLEMS: dict[str, Callable[[], Problem]] = {
    "drum": drum,
    "string": string,
    "trampoline": trampoline,
}


def scanned(problem: Problem) -> tuple[float, float]:
    """Between which points of a scan the best value lies."""
    grid = {problem.key: problem.bounds | {"count": problem.points}}
    names = problem.formula.split("*")
    scan = nanorom.study(problem.scene, grid, names)
    x, y = scan[problem.key], np.prod([scan[name] for name in names], axis=0)
    if problem.wanted is None:
        best = int(np.nanargmax(y))
        return float(x[max(best - 1, 0)]), float(x[min(best + 1, len(x) - 1)])
    place = int(np.flatnonzero(np.diff(np.sign(y - problem.wanted)))[0])
    return float(x[place]), float(x[place + 1])


def verified(problem: Problem) -> Verified:
    """The design of a problem beside its scan; AssertionError where they do not agree."""
    begin = time.perf_counter()
    low, high = scanned(problem)
    found = nanorom.design(problem.scene, {problem.key: problem.bounds}, **problem.given)
    best = found[problem.key]
    assert low <= best <= high
    exact = "-" if problem.exact is None else f"{problem.exact:.8g}"
    return Verified(
        problem=f"{problem.name} by {problem.key}",
        scan=f"{problem.points} devices: {low:.5g} to {high:.5g}",
        found=f"{best:.8g}",
        exact=exact,
        value=f"{found.ended_value[found.chosen, 0]:.10g}",
        finer=f"{found.finer[0]:.10g}",
        devices=len(found.search),
        seconds=time.perf_counter() - begin,
    )


def main() -> None:
    """Verify the problems that are named, or all, and print the table."""
    rows = []
    for name in sys.argv[1:] or PROBLEMS:
        rows.append(verified(PROBLEMS[name]()))
        print(rows[-1], flush=True)
    if len(rows) == len(PROBLEMS):
        report.write_markdown("Designs", [rows], HERE / "designs.md", COMMAND)


if __name__ == "__main__":
    main()
