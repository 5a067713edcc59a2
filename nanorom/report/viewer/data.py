"""What the live page knows of each kind of result, taken from what its schema declares."""

from __future__ import annotations

import numpy as np

from nanorom.continuation import Diagram
from nanorom.continuation.orbits.bifurcations import KINDS
from nanorom.files import schema
from nanorom.report.viewer.pack import Pack
from nanorom.results import diagram_file, table
from nanorom.results.loadcurve import LoadCurve
from nanorom.results.response import Response
from nanorom.results.verified import Verified
from nanorom.rom.model import ReducedModel
from nanorom.types import Array

OF_MODEL = (("L",), ("P",))  # axes of its arrays that are shown: of modes and of points
LARGE = 600_000  # bytes of shapes beyond which they are kept to 16 bits: 1.5e-5 of their largest
MOST_SHAPES = 1_000_000  # bytes of shapes; those of the highest modes are left out
MOST_ORBITS = 120_000  # Fourier coefficients; beyond them every second, third ... orbit is kept
FINEST = np.iinfo(np.int16).max
NEGLIGIBLE = 1e-7  # of the largest coefficient of an orbit: what no picture shows


def add_model(pack: Pack, model: ReducedModel) -> None:
    """The modes, and their shapes where the model has them."""
    shown = {leaf.path for leaf in schema.leaves(model) if leaf.item.axes in OF_MODEL}
    schema.give(model, pack.sub("rom", shown))
    if model.shapes is None:
        return
    own, shapes = pack.sub("rom/shapes"), model.shapes
    own.numbers("points", shapes.points, "f4", "m")
    own.numbers("cells", shapes.cells, "u2" if len(shapes.points) < 2**16 else "u4")
    drawn = max(1, min(model.size, MOST_SHAPES // (2 * len(shapes.points))))
    values = shapes.values[:drawn]
    if 4 * values.size <= LARGE:
        own.numbers("values", values, "f4")
    else:
        step = float(np.abs(values).max()) / FINEST
        own.numbers("values", np.rint(values / step), "i2", scale=step)


def add_response(pack: Pack, response: Response) -> None:
    """Every level with its branches, special points and orbits."""
    own = pack.sub("response")
    schema.give(response, own)
    start, stop = response.sweep.hertz(float(response.frequency[0]))
    own.value("range", [start, stop])
    own.value("headings", table.headings(response))
    own.value("kinds", {kind.code: [kind.name, kind.marker] for kind in KINDS.values()})
    own.value("levels", [_level(response, number) for number in range(len(response.diagrams))])
    every = _thinning(response)
    own.value("every", every)
    own.value("negligible", NEGLIGIBLE)
    for number, diagram in enumerate(response.diagrams):
        _add_diagram(own.sub(f"level/{number}"), diagram, every)


def add_load_curve(pack: Pack, curve: LoadCurve) -> None:
    """All of it."""
    own = pack.sub("tuning")
    schema.give(curve, own)
    own.value("names", curve.names)


def add_verified(pack: Pack, verified: Verified) -> None:
    """All of it but the scene."""
    wanted = {leaf.path for leaf in schema.leaves(verified)}
    schema.give(verified, pack.sub("verified", wanted))


def _level(response: Response, number: int) -> dict[str, object]:
    direct, parametric = response.drive.levels[number]
    return {
        "direct": direct,
        "parametric": parametric,
        "name": response.drive.names[number],
        "branches": len(response.diagrams[number].branches),
    }


def _add_diagram(pack: Pack, diagram: Diagram, every: int) -> None:
    for number, branch in enumerate(diagram.branches):
        own = pack.sub(f"branch/{number}")
        for name in ("omega", "amplitude", "stable"):
            own.array(name, diagram_file.BRANCH[name], getattr(branch, name))
        for name in ("period_multiple", "parent", "ending", "wave", "family"):
            own.value(name, getattr(branch, name))
        kept = np.unique(np.append(np.arange(0, len(branch), every), len(branch) - 1))
        own.numbers("kept", kept, "i4")
        own.numbers("multipliers", branch.multipliers[kept], "f4", "1")
        _add_orbits(own, [branch.coefficients[i] for i in kept])
    points, own = diagram.special_points, pack.sub("special_points")
    for name, item in diagram_file.POINTS.items():
        if name not in ("state", "multipliers"):
            own.array(name, item, np.array([getattr(point, name) for point in points]))
    own.numbers("multipliers", np.array([point.multipliers for point in points]), "f4", "1")
    _add_orbits(own, [point.coefficients for point in points])
    missing = diagram.unexplored
    for name, item in diagram_file.UNEXPLORED.items():
        pack.array(f"unexplored/{name}", item, np.array([getattr(each, name) for each in missing]))


def _add_orbits(pack: Pack, orbits: list[Array]) -> None:
    """Fourier coefficients, without the highest harmonics where these are negligible."""
    cut = [_cut(orbit) for orbit in orbits]
    pack.numbers("rows", np.array([len(orbit) for orbit in cut]), "i4")
    stacked = np.concatenate([orbit.ravel() for orbit in cut]) if cut else np.empty(0)
    pack.numbers("coefficients", stacked, "f4", "m")


def _cut(orbit: Array) -> Array:
    """An orbit without what is negligible of it."""
    size = np.abs(orbit)
    kept = np.where(size > NEGLIGIBLE * size.max(initial=0.0), orbit, 0.0)
    rows = np.flatnonzero(kept.any(axis=1))
    last = int(rows[-1]) if len(rows) else 0
    return np.asarray(kept[: last + 1 + last % 2])  # cosine and sine together


def _thinning(response: Response) -> int:
    """Every how many points of a branch an orbit is kept, so that a page stays small."""
    branches = [branch for diagram in response.diagrams for branch in diagram.branches]
    total = sum(
        np.count_nonzero(_cut(orbit)) for branch in branches for orbit in branch.coefficients
    )
    return int(max(1, -(-total // MOST_ORBITS)))
