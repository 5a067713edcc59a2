"""The main job from end to end: scene, reduced model, response, pictures, summary."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nanorom.errors import SceneError
from nanorom.files import partial
from nanorom.files.whole import (
    atomic_path,
    check_directory,
    check_writable,
    make_directory,
)
from nanorom.launch import finite_elements, mpi_rank, watched
from nanorom.rom.model import ReducedModel
from nanorom.scene import fields as v
from nanorom.scene import plausibility
from nanorom.scene.scene import Scene
from nanorom.scene.spread import spreads_of, tables_of
from nanorom.types import Progress

if TYPE_CHECKING:
    from nanorom.continuation.orbits.orbit import PeriodicOrbit
    from nanorom.results.loadcurve import LoadCurve
    from nanorom.results.response import Response
    from nanorom.results.sensitivity import Sensitivity
    from nanorom.results.verified import Verified
    from nanorom.rom.manifold.reduced import Reduced
    from nanorom.verification.orbit import FullOrbit

PICTURES = ("response.png", "amplitudes.png", "modes.png")
FILES = ("rom.h5", "response.h5", *PICTURES, "summary.json", "report.html")


def plan(scene: Scene | str | Path) -> str:
    """What a scene, or that in a file, needs, what is skipped and why, and its cost, as text.

    Raises SceneError for a scene that is not valid.
    """
    with finite_elements():
        from nanorom.fem.plan import Plan
        from nanorom.fem.routes.registry import route_of
    scene = Scene.of(scene)
    route = route_of(scene)
    route.check(scene)
    found = Plan.of(scene)
    cost, span = route.cost(found), route.span(found)
    plausibility.check(scene, span)
    items = route.items(found)
    rows = [("compute" if item.computed else "skip", item.what, item.why) for item in items]
    width = max(len(what) for _, what, _ in rows)
    lines = [f"{verb:8}{what:{width + 2}}{why}".rstrip() for verb, what, why in rows]
    remarks = [f"note    {note}" for note in plausibility.notes(scene, span)]
    return "\n".join([*lines, f"cost    {cost}", *remarks])


def reduce(
    scene: Scene | str | Path,
    progress: Progress | None = None,
    path: str | Path | None = None,
    groups: int | None = None,
) -> ReducedModel:
    """Reduce a scene, or that in a file, to its modal model by finite elements.

    These are steps I to IV of the paper (Keskekler et al., arXiv:2304.01419).
    Under MPI every rank calls it and gets the same model; ``groups`` says in how many groups the
    ranks share load cases and classes of symmetry (None: as many as are fastest and fit into
    memory); those of one group share a mesh.
    Modes that are left to the program are those that the response needs.  Where the scene has one,
    the model keeps a larger one beside it, in which errors are estimated (`ReducedModel.larger`).
    With a path the model is saved there; until then a long STEP campaign keeps its finished load
    cases beside it, and the same call goes on from them if it was interrupted.  Raises
    NanoromError if DOLFINx is not installed, MeshError or SolverError if the scene cannot be
    solved, FileError if the file cannot be written.
    """
    with finite_elements():
        from nanorom.fem.reduce import reduce_scene
        from nanorom.verification import modes
    scene = Scene.of(scene)
    if path is not None:
        path = Path(path)
        check_directory(path.parent)
        if path.parent.is_dir():
            check_writable(path)
    with watched(progress) as told:
        if scene.modes.automatic:
            model = modes.automatic(scene, told, groups)
        else:
            model = reduce_scene(scene, told, output=path, groups=groups)
            model = modes.with_larger(scene, model, groups)
    if path is not None and mpi_rank() == 0:
        make_directory(path.parent)
        model.save(path)
        partial.finished(path)
    return model


def tune(
    scene: Scene | str | Path,
    points: int = 20,
    progress: Progress | None = None,
    at: Sequence[str | float] | None = None,
) -> LoadCurve:
    """Deflection, frequencies, effective cubic coefficients as a scene's [load] grows from nothing.

    ``points`` is about how many states there are; ``at``: loads of these instead, rising, in SI or
    with a unit, in the place of the scene's.  The load that grows is the voltage if there is
    one, else the pressure, else the force; the others grow with it.  The path goes through limit
    points; under a gate it ends at the pull-in.  Under MPI every rank calls it and gets the same
    curve.  Raises NanoromError if DOLFINx is not installed, SceneError or SolverError if there is
    no such path.
    """
    with finite_elements():
        from nanorom.fem.tuning import follow, tune_at
    with watched(progress) as told:
        if at is not None:
            return tune_at(Scene.of(scene), list(at))
        return follow(Scene.of(scene), points, told)


def sensitivity(
    scene: Scene | str | Path | Mapping[str, Any],
    of: Sequence[str] | None = None,
    by: Sequence[str] | None = None,
    progress: Progress | None = None,
    spread: Mapping[str, Any] | None = None,
    *,
    written: Mapping[str, Any] | None = None,
    exact: bool = False,
) -> Sensitivity:
    """Derivatives of what the model of a scene says, by the numbers of the scene.

    ``of``: names such as f1, m1, k1, b111, b112@2, J1.pressure, P11.tension, f(f11c), effective
    coefficients beta1, delta1, chi12 (`nanorom.rom.quantities`), quotients f2/f1, and special
    points of the scene's response: LP1, the first fold by frequency at the last level, PD1@2,
    NS1.f01 (`nanorom.results.special`); all frequencies and the b of single modes if left out.
    ``by``: keys such as plate.thickness, tension.x, load.pressure or region.1.thickness, all there
    are if left out.  The table has d ln(of) / d ln(by).
    ``spread``: standard deviations of keys, "3 %" or in their unit, beside what the scene says with
    +-; what these make of each quantity is in the table, to first order.
    ``written``: tables that a Scene was read from, whose layers have keys of their own.
    Exact for flat plates and membranes on rigid supports; else by differences of reductions, whose
    errors the table tells, unless ``exact`` is asked for.  Every rank gets the same table.
    Raises SceneError, ModelError for a name that is not there, SolverError, NanoromError if
    DOLFINx is not installed.
    """
    from nanorom.results import sensitivity as results

    directory = Path(scene).parent if isinstance(scene, (str, Path)) else Path()
    if isinstance(scene, (str, Path)):
        written = v.parse_toml(v.read_text(Path(scene)))
    elif isinstance(scene, Mapping):
        written = scene
    scene = Scene.of(scene)
    results.check(scene, of)
    off = spreads_of(scene, spread or {})
    keys = None
    if by is not None:
        keys = list(dict.fromkeys([*by, *(name for own in off.values() for name in own)]))
    with finite_elements():
        from nanorom.fem.sensitivity.near import near_of
    with watched(progress) as told:
        tables = tables_of(scene, written)
        near = near_of(scene, tables, directory, keys, exact, told)
        return results.table(near, of, by, off, told)


def full_orbit(
    scene: Scene | str | Path,
    orbit: PeriodicOrbit,
    direct: float | None = None,
    parametric: float | None = None,
    **options: Any,
) -> FullOrbit:
    """The film's own periodic orbit near one of its modal model, in all degrees of freedom.

    `nanorom.verification.orbit.full_orbit` has the parameters and errors; NanoromError as well if
    DOLFINx is not installed.  Under MPI each rank solves for itself.
    """
    with finite_elements():
        from nanorom.verification import orbit as full
    return full.full_orbit(Scene.of(scene), orbit, direct, parametric, **options)


def manifold(
    model: Any,
    masters: Sequence[int | str] = (1,),
    order: int = 7,
    style: str = "normal",
    **options: Any,
) -> Reduced:
    """The invariant manifold of some modes: what all else does, as polynomials of these.

    Of a ReducedModel or ModalSystem all other modes follow
    (`nanorom.rom.manifold.reduced.manifold` has the parameters and errors).  Of a Scene every
    degree of freedom of the film does, its in-plane inertia included, which needs DOLFINx
    (`nanorom.verification.manifold.manifold`).  A file may stand for the model or the scene in it.
    """
    from nanorom.files import hdf5, stored
    from nanorom.rom.manifold import reduced

    if isinstance(model, (str, Path)):
        model = stored.given(ReducedModel, model) if hdf5.kind_of(model) else Scene.of(model)
    if not isinstance(model, Scene):
        return reduced.manifold(model, masters, order, style, **options)
    with finite_elements():
        from nanorom.verification import manifold as whole
    return whole.manifold(model, masters, order, style, **options)


def verify(
    scene: Scene | str | Path,
    response: Response | str | Path | None = None,
    path: str | Path | None = None,
    *,
    level: int | None = None,
    points: int = 24,
    solve: bool = True,
    progress: Progress | None = None,
    more: int | None = None,
) -> Verified:
    """A response beside the film's own orbits, and what the model is estimated to be wrong by.

    ``response`` or its file; left out, the scene is reduced and followed first.  ``level`` counts
    from 1, all if left out; ``points`` orbits of each are solved for, or with ``solve=False``
    estimated only.  ``more`` modes beyond the model's highest lead from its orbits to the film's,
    and are told apart: as many as it has, from 8 to 20, if left out, and where these do not lead to
    an orbit, three times as many modes.
    With a path the table is saved there.  Under MPI the ranks share the orbits, and every rank gets
    the same table.  Raises NanoromError if DOLFINx is not installed, SceneError if the response is
    not of the scene, FileError if a file cannot be read or written.
    """
    scene = Scene.of(scene)
    if path is not None:
        check_writable(path)
    with finite_elements():
        from nanorom.verification.assemble import check
        from nanorom.verification.campaign import verify as campaign
    check(scene, scene.drive if response is None else None)
    if response is None:
        response = _followed(scene, progress)
    else:
        from nanorom.files import stored
        from nanorom.results.response import Response

        response = stored.given(Response, response)
    found = campaign(scene, response, level, points, solve, progress, more)
    if path is not None and mpi_rank() == 0:
        found.save(path)
    return found


def _followed(scene: Scene, progress: Progress | None) -> Response:
    """The response of a scene, followed by one rank; SceneError if it has no drive and sweep."""
    from nanorom.fem.solvers.groups import shared, together
    from nanorom.results.respond import respond

    drive, sweep = scene.drive, scene.sweep
    if drive is None or sweep is None:
        raise SceneError("drive, sweep: missing sections, whose response is to be verified")
    model = reduce(scene, progress)

    def follow(names: Sequence[str]) -> dict[str, Response]:
        assert drive is not None and sweep is not None
        return {name: respond(model, drive, sweep, scene.damping, progress) for name in names}

    return shared(together(), ["response"], follow)["response"]


def run(
    scene: Scene | str | Path,
    directory: str | Path,
    progress: Progress | None = None,
    processes: int | None = None,
    groups: int | None = None,
) -> dict[str, Any] | None:
    """Do everything a scene asks for and leave the results in a directory.

    Leaves rom.h5, modes.png, summary.json and report.html with everything to look at, and where
    the scene has a drive and a sweep also response.h5, response.png and amplitudes.png.  Returns
    what is in summary.json; under MPI on rank 0, which alone writes.  ``processes`` is as for
    `nanorom.respond`, ``groups`` as for `nanorom.reduce`.
    """
    scene, directory = Scene.of(scene), Path(directory)
    check_directory(directory)
    if directory.is_dir():
        for name in FILES:
            check_writable(directory / name)
    with watched(progress) as told:
        start = time.perf_counter()
        model = reduce(scene, told, directory / "rom.h5", groups)
        if mpi_rank() != 0:
            return None
        seconds = {"reduce": time.perf_counter() - start}
        from nanorom.report import summary as summary_text

        summary: dict[str, Any] = {"scene": scene.to_toml(), **summary_text.of_model(model)}
        response = None
        if scene.drive is not None and scene.sweep is not None:
            from nanorom.results.respond import respond

            start = time.perf_counter()
            path = directory / "response.h5"
            response = respond(
                model,
                scene.drive,
                scene.sweep,
                scene.damping,
                told,
                processes,
                path,
                scene.readout,
            )
            seconds["respond"] = time.perf_counter() - start
            summary |= summary_text.of_response(response)
    from nanorom.report import page

    start = time.perf_counter()
    pictures = _draw(model, response, directory)
    seconds["pictures"] = time.perf_counter() - start
    summary["seconds"] = seconds
    title = f"nanorom: {directory.resolve().name}"
    page.write(directory / "report.html", title, scene, model, response, seconds, pictures)
    with atomic_path(directory / "summary.json") as temporary:
        temporary.write_text(json.dumps(summary, indent=1) + "\n", encoding="utf-8")
    return summary


def _draw(model: ReducedModel, response: Response | None, directory: Path) -> list[Path]:
    from nanorom.plots import amplitude_panels, mode_gallery, response_figure

    pictures = [directory / name for name in PICTURES]
    if response is None:
        pictures = pictures[-1:]
    else:
        response_figure(response, pictures[0])
        amplitude_panels(response, pictures[1])
    mode_gallery(model, pictures[-1])
    return pictures
