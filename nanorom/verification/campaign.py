"""A whole response held against the film: orbits chosen along it, each estimated and solved for."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from nanorom.continuation.diagrams.selection import Chosen, of_level
from nanorom.errors import SceneError
from nanorom.fem.solvers import compat
from nanorom.fem.solvers.groups import shared, together
from nanorom.results.response import Response
from nanorom.results.verified import Verified
from nanorom.scene.scene import Scene
from nanorom.types import Array, Progress
from nanorom.verification.assemble import assemble, check
from nanorom.verification.assembled import Film
from nanorom.verification.compare import Comparison, compare
from nanorom.verification.driven import DrivenFilm
from nanorom.verification.stability import Stability

POINTS = 24  # of a level
TAIL = 1e-7  # of the largest coefficient: harmonics below are left out of orbits whose errors are
# told to 1e-5 at best; each would be near resonance with many modes, and make an orbit dear
NUMBERS = (
    "residual",
    "omega_full",
    "modal_residual",
    "estimate",
    "estimate_omega",
    "error",
    "largest_multiplier",
    "left",
)


def verify(
    scene: Scene,
    response: Response,
    level: int | None = None,
    points: int = POINTS,
    solve: bool = True,
    progress: Progress | None = None,
    more: int | None = None,
) -> Verified:
    """Orbits of a response beside those of the film. Collective: ranks share the orbits.

    Parameters
    ----------
    scene : of the response's model, with [damping].
    response : its levels and patterns are those of its own drive.
    level : the only one to verify, from 1; all of them if left out.
    points : how many orbits of each level, special points among them.
    solve : False gives the estimates alone.
    progress : called as progress("orbits", done, total) on the first rank.
    more : how many modes beyond the model's highest are told apart.

    Raises SceneError for a scene that has not the response's modes or no film, SolverError as
    `nanorom.reduce`.
    """
    check(scene, response.drive)
    chosen = _chosen(response, level, points)
    film = _with_modes_of(assemble(scene, more), response)
    levels = response.drive.levels
    driven = {n: DrivenFilm(film, response.drive, *levels[n]) for n in {c.level for c in chosen}}
    stable = {n: Stability(some) for n, some in driven.items()}

    def work(own: Sequence[int]) -> dict[int, _Row]:
        found = {}
        for done, number in enumerate(own):
            if progress is not None:
                progress("orbits", done, len(own))
            point = chosen[number]
            one = compare(driven[point.level], stable[point.level], point, solve)
            found[number] = _Row.of(one, film)
        return found

    rows = shared(together(), list(range(len(chosen))), work)
    if progress is not None:
        progress("orbits", len(chosen), len(chosen))
    return _table(film, response, chosen, [rows[n] for n in range(len(chosen))])


def _chosen(response: Response, level: int | None, points: int) -> list[Chosen]:
    count = len(response.diagrams)
    if level is not None and not 1 <= level <= count:
        raise SceneError(f"level: found {level}; allowed: 1 to {count}")
    numbers = range(count) if level is None else [level - 1]
    chosen = [point for n in numbers for point in of_level(n, response.diagrams[n], points)]
    return [attrs.evolve(point, orbit=point.orbit.without_tail(TAIL)) for point in chosen]


def _with_modes_of(film: Film, response: Response) -> Film:
    """The film, the response's modes being those of its model."""
    names = film.names
    lacking = [label for label in response.label if label not in names]
    if lacking:
        raise SceneError(
            f"modes: the response has {lacking[0]}, the scene {', '.join(names)}; give the scene "
            "that the response is of"
        )
    return attrs.evolve(film, inside=np.array([names.index(label) for label in response.label]))


@attrs.frozen(eq=False)
class _Row:
    """What of a comparison goes from rank to rank."""

    values: dict[str, float]
    arrays: dict[str, Array]

    @classmethod
    def of(cls, one: Comparison, film: Film) -> _Row:
        full, unknown = one.full, np.full(len(film.parities) - len(film.inside), np.nan)
        numbers = (
            np.nan if full is None else full.residual,
            np.nan if full is None else full.omega,
            one.modal_residual,
            one.estimate,
            one.estimate_omega,
            one.error,
            one.multiplier,
            one.left,
        )
        values = dict(zip(NUMBERS, numbers))
        arrays = {
            "full": np.full(len(film.inside), np.nan) if full is None else full.amplitude,
            "outside": unknown if full is None else full.outside_amplitude,
            "takes_part": one.takes_part,
            "deflection": np.array([np.nan if full is None else full.deflection, one.deflection]),
        }
        return cls(values, arrays)


def _table(film: Film, response: Response, chosen: list[Chosen], rows: list[_Row]) -> Verified:
    outside = np.setdiff1d(np.arange(len(film.parities)), film.inside)
    count, sizes = len(rows), {"full": len(film.inside), "deflection": 2}
    columns: dict[str, Array] = {}
    for name in NUMBERS:
        columns[name] = np.array([row.values[name] for row in rows])
    for name in ("full", "outside", "takes_part", "deflection"):
        width = sizes.get(name, len(outside))
        columns[name] = np.array([row.arrays[name] for row in rows]).reshape(count, width)
    levels = np.array([response.drive.levels[c.level] for c in chosen]).reshape(count, 2)
    return Verified(
        scene=film.scene.to_toml(),
        versions=compat.versions(),
        label=tuple(response.label),
        frequency=np.asarray(response.frequency),
        outside_label=tuple(film.names[i] for i in outside),
        level=np.array([c.level for c in chosen], dtype=int),
        direct=levels[:, 0],
        parametric=levels[:, 1],
        branch=np.array([c.branch for c in chosen], dtype=int),
        type=tuple(c.type for c in chosen),
        omega=np.array([c.orbit.omega for c in chosen]),
        period_multiple=np.array([c.orbit.period_multiple for c in chosen], dtype=int),
        harmonics=np.array([c.orbit.harmonics for c in chosen], dtype=int),
        modal=np.array([c.amplitude for c in chosen]).reshape(count, len(response.label)),
        **columns,
    )
