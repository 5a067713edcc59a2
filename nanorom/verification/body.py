"""What manifolds of all degrees of freedom need of a scene's film, and a model of what they make.

A further kind of body is a further row of `verification.manifold.BODIES`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

import attrs
import numpy as np

from nanorom.errors import ModelError
from nanorom.fem.solvers import compat
from nanorom.rom.manifold.direct import responses
from nanorom.rom.manifold.full import FullSystem
from nanorom.rom.manifold.projection import Projection
from nanorom.rom.manifold.reduced import MASTERS, ORDER
from nanorom.rom.modal import FOLLOWING
from nanorom.rom.model import ReducedModel
from nanorom.rom.patterns import ModalWork, reduced
from nanorom.rom.shapes import Shapes
from nanorom.scene.patterns.pattern import Areal
from nanorom.scene.scene import Scene
from nanorom.types import Array
from nanorom.verification.assembled import Film, Forces, Operators

METHOD = "manifold"
OTHERS = (1.0, 3.0)  # times a master's frequency: where what modulates it at twice that pulls


@attrs.frozen(eq=False)
class Body(ABC):
    """A film or a solid about its static state, with N named modes, masters first.

    system : of n degrees of freedom, in units of its own; names, numbers (N,); shapes (n, N) of
    unit mass; squares (N,): squared frequencies; scale (N,): m per coordinate of unit mass; losses:
    1/Q (N,) by what takes energy; time in s, energy in J of the whole body: the units.
    """

    scene: Scene
    system: FullSystem
    names: list[str]
    numbers: np.ndarray
    shapes: Array
    squares: Array
    scale: Array
    losses: dict[str, Array]
    time: float
    energy: float

    @abstractmethod
    def work(self, vectors: Array, scale: Array) -> ModalWork:
        """Of simple forces on vectors (n, r) that are reached at a coordinate of scale (r,)."""

    @abstractmethod
    def drawn(self, vectors: Array, scale: Array) -> Shapes:
        """Deflections of vectors (n, r) by coordinates in m."""

    @abstractmethod
    def driven(self, masters: Array) -> tuple[Array, Array]:
        """Forces (n, p) of the scene's drive at some level, and (n, q) of its modulation where
        masters (n, m) deflect it.
        """

    def answers(self, masters: int) -> Array:
        """Fields (n, k) with which all else answers the drive, and pairs of a master and a mode.

        The latter are what a mode's frequency depends on as the master moves.
        """
        omega = np.sqrt(self.squares[:masters])
        pushed, pulled = self.driven(self.shapes[:, :masters])
        rates = [np.zeros(pushed.shape[1])] + [np.full(pushed.shape[1], w) for w in omega]
        loads = [pushed] * len(rates)
        if pulled.shape[1]:
            for times in OTHERS:
                rates.append(times * omega)
                loads.append(pulled)
        for other in range(masters, len(self.names)):
            first, both = self.shapes[:, :1], self.shapes[:, [other]]
            force = self.system.quadratic(first, both)
            for sign in (1.0, -1.0):
                rates.append(np.array([omega[0] + sign * np.sqrt(self.squares[other])]))
                loads.append(force)
        return responses(self.system, self.shapes, np.concatenate(rates), np.column_stack(loads))


@attrs.frozen(eq=False)
class VectorsWork(ModalWork):
    """Virtual work on vectors of a body, from that on all its degrees of freedom."""

    film: Film

    def uniform(self, pressure: float = 1.0) -> Array:
        return self._on(self.film.work.uniform(pressure))

    def areal(self, pattern: Areal) -> Array:
        return self._on(self.film.work.areal(pattern))

    def points(self, places: Array, weights: Array, key: str) -> Array:
        return self._on(self.film.work.points(places, weights, key))

    def inertia(self, acceleration: float = 1.0) -> Array:
        return self._on(self.film.work.inertia(acceleration))

    def stretch(self, tension: float = 1.0) -> Array:
        return self._between(self.film.work.stretch(tension))

    @abstractmethod
    def _on(self, forces: Forces) -> Array:
        """Of forces on all degrees of freedom, (r,) in N."""

    @abstractmethod
    def _between(self, operators: Operators) -> Array:
        """Of operators on all degrees of freedom, (r, r) in N/m."""


def places_of(names: Sequence[str], masters: Sequence[int | str]) -> list[int]:
    """Places of masters, by number or name, among named modes from the first on."""
    found = []
    for master in masters:
        if master in names:
            found.append(list(names).index(str(master)))
        elif isinstance(master, int) and 1 <= master <= len(names):
            found.append(master - 1)
        else:
            raise ModelError(
                f"masters: found {master!r}; allowed: 1 to {len(names)} | " + " | ".join(names)
            )
    if not found or len(set(found)) < len(found):
        raise ModelError(f"masters: found {list(masters)}; allowed: one or more different modes")
    return found


def model_of(body: Body, found: Projection, masters: int, order: int) -> ReducedModel:
    """The model whose coordinates are the named modes and the fields of a manifold of an order.

    Fields have numbers above FOLLOWING and the first master's scale; they are damped as the last
    mode is.
    """
    size, count = len(found.squares), len(body.names)
    sort = np.argsort(found.squares, kind="stable")
    places = np.concatenate([np.arange(count), np.full(size - count, count - 1)])[sort]
    scale = np.append(body.scale, np.full(size - count, body.scale[0]))[sort]
    vectors = found.vectors[:, sort]
    assert body.scene.damping is not None
    given = body.scene.damping.per_mode(len(body.scene.modes.numbers))
    by_number = dict(zip(body.scene.modes.numbers, given))
    own = np.array([by_number.get(int(n), given[-1]) for n in body.numbers])
    inverse = (1 / own + sum(body.losses.values()))[places]
    omega = np.sqrt(found.squares[sort]) / body.time
    mass = body.energy * body.time**2 / scale**2
    follows = [f"field {n + 1}" for n in range(size - count)]
    direct, parametric = reduced(body.work(vectors, scale), body.scene.drive)
    per = [1 / scale.reshape([-1 if i == k else 1 for i in range(4)]) for k in range(4)]
    quadratic = found.quadratic[np.ix_(sort, sort, sort)]
    cubic = found.cubic[np.ix_(sort, sort, sort, sort)]
    return ReducedModel(
        frequency=omega / (2 * np.pi),
        mass=mass,
        label=tuple(np.array([*body.names, *follows], dtype=object)[sort]),
        number=np.append(body.numbers, FOLLOWING + 1 + np.arange(size - count))[sort],
        stiffness=np.diag(mass * omega**2),
        damping=np.diag(mass * omega * inverse),
        quadratic=body.energy * quadratic * (per[0] * per[1] * per[2])[..., 0],
        cubic=body.energy * cubic * per[0] * per[1] * per[2] * per[3],
        drive=direct,
        parametric=parametric,
        losses={name: values[places] for name, values in body.losses.items()},
        shapes=body.drawn(vectors, scale),
        diagnostics={ORDER: order, MASTERS: " ".join(body.names[:masters])},
        scene=body.scene.to_toml(),
        method=METHOD,
        in_plane=body.scene.reduction.in_plane,
        versions=compat.versions(),
    )
