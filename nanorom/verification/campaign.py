"""A whole response held against the film: orbits chosen along it, each estimated and solved for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import attrs
import numpy as np

from nanorom.continuation.diagrams.selection import Chosen, of_level
from nanorom.continuation.orbits.orbit import PeriodicOrbit
from nanorom.errors import SceneError, SolverError
from nanorom.fem.solvers import compat
from nanorom.fem.solvers.groups import shared, together
from nanorom.results.response import Response
from nanorom.results.verified import Verified
from nanorom.scene.scene import Scene
from nanorom.types import Array, Progress
from nanorom.verification.assemble import assemble, check, rungs
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
    "named",
    "multiplier_film",
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
    more : how many modes beyond the model's highest are told apart, and lead from its orbits to the
        film's.  Left out, orbits that are not found are looked for again with more of them.

    Raises SceneError for a scene that has not the response's modes or no film, SolverError as
    `nanorom.reduce`.
    """
    check(scene, response.drive)
    chosen = _chosen(response, level, points)
    tried = rungs(scene) if more is None else [more]
    rows: dict[int, _Row] = {}
    left = list(range(len(chosen)))
    for count in tried:
        patient = count == tried[-1]
        try:
            film = _with_modes_of(assemble(scene, count), response)
        except SolverError:
            if not rows:
                raise
            break  # the film has not as many: those that it has were not enough
        work = _Work(film, response, chosen, rows, solve, patient, progress)
        rows = rows | shared(together(), left, work, lambda n: chosen[n].orbit.harmonics ** 2.0)
        left = [n for n in left if not rows[n].found]
        if not (left and solve):
            break
    if progress is not None:
        progress("orbits", len(chosen), len(chosen))
    return _table(scene, response, chosen, [rows[n] for n in range(len(chosen))])


@attrs.frozen(eq=False)
class _Work:
    """Points of a response by number, compared with one film.

    rows : of a film with fewer named modes, from whose orbits the search goes on.
    """

    film: Film
    response: Response
    chosen: Sequence[Chosen]
    rows: Mapping[int, _Row]
    solve: bool
    patient: bool
    progress: Progress | None

    def __call__(self, own: Sequence[int]) -> dict[int, _Row]:
        drive, levels = self.response.drive, {self.chosen[number].level for number in own}
        driven = {n: DrivenFilm(self.film, drive, *drive.levels[n]) for n in levels}
        stable = {n: Stability(some) for n, some in driven.items()}
        found = {}
        for done, number in enumerate(own):
            if self.progress is not None:
                stage = "orbits" if not self.rows else f"orbits, {len(self.film.names)} modes"
                self.progress(stage, done, len(own))
            point = self.chosen[number]
            near = self.rows[number].near_of(self.film) if number in self.rows else None
            both = driven[point.level], stable[point.level]
            found[number] = _Row.of(
                compare(*both, point, self.solve, near, self.patient), self.film
            )
        return found


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
    """What of a comparison goes from rank to rank.

    names : of the film's named modes, those that the model lacks being its outside_label.
    """

    names: Sequence[str]
    outside_label: tuple[str, ...]
    values: dict[str, float]
    arrays: dict[str, Array]
    near: PeriodicOrbit | None

    @property
    def found(self) -> bool:
        """Whether the film's orbit was."""
        return bool(np.isfinite(self.values["residual"]))

    def near_of(self, film: Film) -> PeriodicOrbit | None:
        """The orbit of all named modes, on those of another film."""
        if self.near is None:
            return None
        places = {name: number for number, name in enumerate(self.names)}
        known = [k for k, name in enumerate(film.names) if name in places]
        moved = np.zeros((len(self.near.coefficients), len(film.names)))
        moved[:, known] = self.near.coefficients[:, [places[film.names[k]] for k in known]]
        return attrs.evolve(self.near, coefficients=moved)

    def on(self, name: str, outside: Sequence[str]) -> Array:
        """An array, or, of modes that the model lacks, its entries of some, NaN if unknown."""
        array = self.arrays[name]
        if name not in ("outside", "takes_part"):
            return array
        known = dict(zip(self.outside_label, array))
        return np.array([known.get(label, np.nan) for label in outside])

    @classmethod
    def of(cls, one: Comparison, film: Film) -> _Row:
        full, unknown = one.full, np.full(len(film.parities) - len(film.inside), np.nan)
        outside = np.setdiff1d(np.arange(len(film.parities)), film.inside)
        numbers = (
            np.nan if full is None else full.residual,
            np.nan if full is None else full.omega,
            one.modal_residual,
            one.estimate,
            one.estimate_omega,
            one.error,
            one.multiplier,
            one.left,
            float(len(film.names)),
            one.multiplier_film,
        )
        values = dict(zip(NUMBERS, numbers))
        arrays = {
            "full": np.full(len(film.inside), np.nan) if full is None else full.amplitude,
            "outside": unknown if full is None else full.outside_amplitude,
            "takes_part": one.takes_part,
            "deflection": np.array([np.nan if full is None else full.deflection, one.deflection]),
        }
        label = tuple(film.names[i] for i in outside)
        return cls(film.names, label, values, arrays, one.near)


def _table(scene: Scene, response: Response, chosen: list[Chosen], rows: list[_Row]) -> Verified:
    outside: tuple[str, ...] = max((row.outside_label for row in rows), key=len, default=())
    count, sizes = len(rows), {"full": len(response.label), "deflection": 2}
    columns: dict[str, Array] = {}
    for name in NUMBERS:
        columns[name] = np.array([row.values[name] for row in rows])
    for name in ("full", "outside", "takes_part", "deflection"):
        width = sizes.get(name, len(outside))
        columns[name] = np.array([row.on(name, outside) for row in rows]).reshape(count, width)
    levels = np.array([response.drive.levels[c.level] for c in chosen]).reshape(count, 2)
    return Verified(
        scene=scene.to_toml(),
        versions=compat.versions(),
        label=tuple(response.label),
        frequency=np.asarray(response.frequency),
        outside_label=outside,
        level=np.array([c.level for c in chosen], dtype=int),
        direct=levels[:, 0],
        parametric=levels[:, 1],
        branch=np.array([c.branch for c in chosen], dtype=int),
        type=tuple(c.type for c in chosen),
        omega=np.array([c.orbit.omega for c in chosen]),
        period_multiple=np.array([c.orbit.period_multiple for c in chosen], dtype=int),
        harmonics=np.array([c.orbit.harmonics for c in chosen], dtype=int),
        multiplier_model=np.array([np.abs(c.multipliers).max() for c in chosen]).reshape(count),
        modal=np.array([c.amplitude for c in chosen]).reshape(count, len(response.label)),
        **columns,
    )
