"""Random scenes, each held against itself at a hundredth of its tolerance.

What an estimate claims is checked where nobody chose the case: shapes, supports, tensions,
Poisson's ratios, loads, modes and tolerances are drawn by a seed, every scene by its own number,
so that one can be solved again alone.  Lengths are in film sizes, stiffness in units of
D = E h^3/12/(1 - nu^2).
"""

from __future__ import annotations

import time
import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

import attrs
import numpy as np

from nanorom.bench import bounded, report
from nanorom.errors import AccuracyWarning, NanoromError
from nanorom.fem.mesh.gmsh import MESHES
from nanorom.files.lines import Lines
from nanorom.rom.model import ReducedModel
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Disc, Geometry, MeshFile, Rectangle, String
from nanorom.scene.load import Load
from nanorom.scene.material import Material
from nanorom.scene.scene import Accuracy, Modes, Scene
from nanorom.scene.support import Kind, Spring, Support, deflection_of
from nanorom.version import version
from nanorom.workflow import reduce

SEED, COUNT, FEW = 16, 200, 4
FINER = 1e-2  # tolerance of the solution that a scene is held against, by its own
ROUNDING = 1e-11  # errors below it are none
MOST_ABOVE = 3.0  # times its estimate that an error may be
THICKNESS = 1e-4  # of the film's size: tensions of 1e5 D stretch it by 1e-4 at most
SIDES = ("left", "right", "bottom", "top")


@attrs.frozen
class Drawn:
    """A random scene: what was found against what was claimed.

    error: true ones, against the finer solution; estimate: told ones, of both solutions; ratio: the
    larger quotient of the two; seconds: of the processor, both solutions; verdict: "ok", what is
    wrong, why the scene was refused, or at which bound it was ended.
    """

    number: int
    scene: str
    tolerance: float
    dofs: int
    seconds: float
    error_frequency: float
    estimate_frequency: float
    error_tensor: float
    estimate_tensor: float
    ratio: float
    verdict: str


@attrs.frozen
class Summary:
    """How many of the scenes that were solved are wrong, and the worst of them.

    above_tolerance: claimed and not met; above_estimate: by more than `MOST_ABOVE`; dead: ended in
    an error that is not one line about the scene; not_met: told that the tolerance is not met;
    unfinished: ended at a bound of `bounded`.
    """

    scenes: int
    above_tolerance: int
    above_estimate: int
    dead: int
    refused: int
    not_met: int
    unfinished: int
    worst_by_tolerance: float
    worst_by_estimate: float


def rows(path: Path, quick: bool = False) -> Iterator[Drawn]:
    """Scenes by their numbers, each in a process of its own with bounds, or a few quick ones.

    The file ``path`` is written at the end; until then rows are kept beside it, and gone on from:
    hours of computation may be interrupted.
    """
    if quick:
        yield from (held(number, drawn(number)) for number in range(FEW))
        return
    names = [field.name for field in attrs.fields(Drawn)]
    kept = Lines(path, repr((version(), SEED, names)))
    solved = kept.each(range(COUNT), lambda number: attrs.asdict(within_bounds(number)))
    found = []
    for row in solved:
        found.append(Drawn(**row))
        yield found[-1]
    report.write_csv(found, path)
    kept.finished()


def within_bounds(number: int) -> Drawn:
    """A scene in a process of its own, which is ended where it takes too much."""
    try:
        return bounded.bounded(held, number, drawn(number))
    except bounded.Bound as error:
        return _unsolved(number, drawn(number), f"unfinished: {error}")
    except NanoromError as error:
        return _unsolved(number, drawn(number), f"dead: {error}")


def summary(rows: Sequence[Drawn]) -> Summary:
    """Counts and worst ratios of rows."""
    verdicts = Counter(row.verdict.split(":")[0] for row in rows)
    solved = [row for row in rows if np.isfinite(row.ratio)]
    errors = [max(row.error_frequency, row.error_tensor) for row in solved]
    met = [row.verdict != "not met" for row in solved]
    shares = [e / row.tolerance for e, row, ok in zip(errors, solved, met) if ok]
    return Summary(
        len(rows),
        verdicts["above the tolerance"],
        verdicts["above the estimate"],
        verdicts["dead"],
        verdicts["refused"],
        verdicts["not met"],
        verdicts["unfinished"],
        max(shares, default=0.0),
        max((row.ratio for row in solved), default=0.0),
    )


# -- what is drawn --------------------------------------------------------------------------------


def drawn(number: int, seed: int = SEED) -> Scene:
    """The scene of a number: one and the same on every machine."""
    random = np.random.default_rng([seed, number])
    geometry, support = _shape(random)
    nu = float(random.uniform(-0.3, 0.48))
    rigidity = THICKNESS**3 / (12 * (1 - nu**2))
    return Scene(
        geometry=geometry,
        plate=Plate(thickness=THICKNESS, model="auto"),
        material=Material(youngs_modulus=1.0, poisson_ratio=nu, density=1.0),
        tension=_tension(random, rigidity),
        support=support,
        load=_load(random, rigidity),
        modes=Modes(count=int(random.integers(1, 9))),
        accuracy=Accuracy(tolerance=float(10.0 ** random.integers(-6, -2))),
    )


def _shape(random: np.random.Generator) -> tuple[Geometry, Support]:
    """Discs, rectangles, strings, ellipses and rings, and how they are held."""
    kind = random.choice(["disc", "rectangle", "rectangle", "string", "ellipse", "annulus"])
    if kind == "disc":
        return Disc(radius=1.0), Support(_kind(random, ("clamped", "simply_supported")))
    if kind == "rectangle":
        sides = {side: _kind(random) for side in SIDES}
        sides[str(random.choice(SIDES))] = "clamped"  # one at least is held
        return Rectangle(length=1.0, width=float(random.uniform(0.3, 1.0))), Support(sides)
    if kind == "string":
        ends = {side: _kind(random, ("clamped", "simply_supported")) for side in SIDES[:2]}
        return String(length=1.0, width=float(random.uniform(0.02, 0.2))), Support(ends)
    if kind == "ellipse":
        return MeshFile(MESHES / "ellipse.geo", scale=1.0), Support(
            {"edge": _kind(random, ("clamped", "simply_supported"))}
        )
    rims = {"outer": _kind(random), "inner": _kind(random)}
    rims[str(random.choice(list(rims)))] = "clamped"
    return MeshFile(MESHES / "annulus.geo", scale=1.0), Support(rims)


def _kind(
    random: np.random.Generator, kinds: Sequence[str] = ("clamped", "simply_supported", "free")
) -> Kind:
    """A kind of support, now and then an elastic edge."""
    kind = str(random.choice(kinds))
    if kind == "simply_supported" and random.random() < 0.3:
        return Spring(rotational=float(10.0 ** random.uniform(-1, 3)) * THICKNESS**3 / 12)
    return kind


def _tension(random: np.random.Generator, rigidity: float) -> Tension:
    """None, equal or unequal, at times in one direction alone or somewhat compressive."""
    size = rigidity * float(10.0 ** random.uniform(-1, 5))
    match random.choice(["none", "equal", "equal", "unequal", "unequal", "along", "compressive"]):
        case "none":
            return Tension(0.0, 0.0)
        case "equal":
            return Tension(size, size)
        case "unequal":
            return Tension(size, size * float(random.uniform(0.3, 1.5)))
        case "along":
            return Tension(*random.permutation([size, 0.0]))
    return Tension(*-random.uniform(0, 2 * rigidity, 2))


def _load(random: np.random.Generator, rigidity: float) -> Load | None:
    """None mostly, a pressure or a change of stress."""
    match random.choice(["none", "none", "none", "pressure", "stress"]):
        case "pressure":
            return Load(pressure=rigidity * THICKNESS * float(10.0 ** random.uniform(0, 4)))
        case "stress":
            return Load(stress=rigidity / THICKNESS * float(10.0 ** random.uniform(-1, 4)))
    return None


# -- how it is held against a finer solution ------------------------------------------------------


def held(number: int, scene: Scene) -> Drawn:
    """Solve a scene twice and judge what was claimed."""
    tolerance = scene.accuracy.tolerance
    assert tolerance is not None
    start = time.process_time()
    try:
        model, finer = (_solved(scene.with_(tolerance=t)) for t in (tolerance, FINER * tolerance))
    except Exception as error:  # what a scene dies of is what is looked for
        refused = isinstance(error, NanoromError)
        verdict = f"{'refused' if refused else 'dead'}: {error}".splitlines()[0]
        return _unsolved(number, scene, verdict, time.process_time() - start)
    errors = (
        float(np.abs(model.frequency / finer.frequency - 1).max()),
        float(np.abs(model.cubic - finer.cubic).max() / np.abs(finer.cubic).max()),
    )
    estimates = tuple(
        sum(float(each.diagnostics[key]) for each in (model, finer))
        for key in ("error_frequency", "error_tensor")
    )
    ratio = max(e / max(told, ROUNDING) for e, told in zip(errors, estimates))
    verdict = "ok"
    if _claimed(model) > tolerance:
        verdict = "not met"
    elif max(errors) > tolerance + _claimed(finer):
        verdict = "above the tolerance"
    if ratio > MOST_ABOVE:
        verdict = f"above the estimate: {ratio:.1f} times"
    return Drawn(
        number,
        told(scene),
        tolerance,
        int(model.diagnostics["dofs"]),
        time.process_time() - start,
        errors[0],
        estimates[0],
        errors[1],
        estimates[1],
        ratio,
        verdict,
    )


def _unsolved(number: int, scene: Scene, verdict: str, seconds: float = np.nan) -> Drawn:
    """The row of a scene without a solution."""
    tolerance, nan = scene.accuracy.tolerance or np.nan, np.nan
    return Drawn(number, told(scene), tolerance, 0, seconds, nan, nan, nan, nan, nan, verdict)


def _claimed(model: ReducedModel) -> float:
    """Its larger estimate."""
    return max(model.diagnostics["error_frequency"], model.diagnostics["error_tensor"])


def _solved(scene: Scene) -> ReducedModel:
    """Its model, whether or not it meets its tolerance."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AccuracyWarning)
        return reduce(scene)


def told(scene: Scene) -> str:
    """A scene in one line: shape, supports, tension and load by stiffness, nu, modes."""
    geometry, nu = scene.geometry, scene.material.poisson_ratio
    rigidity = THICKNESS**3 / (12 * (1 - nu**2))
    shape = geometry.file.stem if isinstance(geometry, MeshFile) else geometry.shape
    if isinstance(geometry, Rectangle):
        shape += f" 1 x {geometry.width:.3f}"
    named = [scene.supports[side] for side in scene.supports if side != "default"]
    kinds = map(deflection_of, named or [scene.support.default])
    held = "".join("e" if isinstance(kind, Spring) else kind[0] for kind in kinds)
    tension = ", ".join(f"{t / rigidity:.3g}" for t in (scene.tension.x, scene.tension.y))
    load = ""
    if scene.load is not None and scene.load.pressure is not None:
        load = f", pressure {scene.load.pressure / rigidity / THICKNESS:.3g}"
    elif scene.load is not None and scene.load.stress is not None:
        load = f", stress {scene.load.stress / rigidity * THICKNESS:.3g}"
    return f"{shape}, {held}, T {tension}{load}, nu {nu:.3f}, {scene.modes.highest} modes"
