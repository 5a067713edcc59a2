"""Mirror symmetry: the film cut at its mirror axes, and its fields by their parity.

A film that is its own mirror image in x, in y or in both need be meshed on a half or a quarter
only.  Every mode is then even or odd about each mirror, every product of modes has the product of
their parities, and integrals of odd products over the whole film vanish exactly: those
coefficients are never computed.  A film without mirrors has one class, of empty parity.
"""

from __future__ import annotations

from itertools import product

import attrs
import numpy as np

from nanorom.scene import elasticity
from nanorom.scene.geometry import Disc, Rectangle
from nanorom.scene.scene import Scene

Parity = tuple[int, ...]  # one entry per mirror: 0 even, 1 odd

AXES = ("x", "y")
OPPOSITE = {"x": ("left", "right"), "y": ("bottom", "top")}


@attrs.frozen
class Mirrors:
    """The coordinates in which a film is its own mirror image; it is meshed where they are > 0."""

    axes: tuple[str, ...] = ()

    @classmethod
    def of(cls, scene: Scene) -> Mirrors:
        """Mirrors of a scene: tensions along the axes have both; shape, supports, masses decide."""
        if scene.tension.xy or scene.tension.variation is not None:
            return cls()
        if not elasticity.is_aligned(scene.material.law):
            return cls()
        lies = [[each == 0 for each in mass.position] for mass in scene.masses]
        lies += [[m and not region.sheared for m in region.mirrored] for region in scene.patches]
        on = [axis for i, axis in enumerate(AXES) if all(mirrored[i] for mirrored in lies)]
        if isinstance(scene.geometry, Disc):
            return cls(AXES if len(on) == len(AXES) else ())  # its mesh has a quarter or all of it
        if not isinstance(scene.geometry, Rectangle):
            return cls()
        kinds = scene.supports
        return cls(tuple(a for a in on if kinds[OPPOSITE[a][0]] == kinds[OPPOSITE[a][1]]))

    @property
    def classes(self) -> list[Parity]:
        """All parities, the fully even one first."""
        return list(product((0, 1), repeat=len(self.axes)))

    @property
    def copies(self) -> int:
        """How many times the meshed part makes the whole film."""
        return 2 ** len(self.axes)

    @property
    def even(self) -> Parity:
        """Parity of a field that every mirror leaves as it is."""
        return (0,) * len(self.axes)

    def parity_in(self, axis: str, parity: Parity) -> int | None:
        """0 or 1 for even or odd in an axis, None where the film has no mirror."""
        return parity[self.axes.index(axis)] if axis in self.axes else None

    def unfold(
        self, points: np.ndarray, values: np.ndarray, parities: list[Parity]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Points (n, 2) and values (L, n) on the meshed part, copied to the whole film."""
        for number, axis in enumerate(self.axes):
            flip = np.where(np.arange(2) == AXES.index(axis), -1.0, 1.0)
            sign = np.array([1.0 - 2.0 * parity[number] for parity in parities])
            points = np.concatenate([points, points * flip])
            values = np.concatenate([values, values * sign[:, None]], axis=1)
        return points, values


def is_symmetric(scene: Scene) -> bool:
    """The film and its static state have every mirror that its shape has."""
    centred = scene.load is None or scene.load.centred
    centred = centred and all(mass.centred for mass in scene.masses)
    centred = centred and all(all(region.mirrored) for region in scene.patches)
    return centred and scene.plate.initial_shape is None and scene.tension.variation is None


def is_of_revolution(scene: Scene) -> bool:
    """Every turn of the film about its centre leaves it and its static state as they are."""
    round_ = isinstance(scene.geometry, Disc) and scene.tension.is_isotropic
    round_ = round_ and not scene.material.crystalline
    round_ = round_ and all(region.of_revolution for region in scene.patches)
    return round_ and is_symmetric(scene)


def is_square(scene: Scene) -> bool:
    """The film and its static state stay as they are when x and y change places."""
    geometry, tension = scene.geometry, scene.tension
    return (
        isinstance(geometry, Rectangle)
        and geometry.length == geometry.width
        and tension.x == tension.y
        and elasticity.is_square(scene.material.law)
        and all(region.is_square for region in scene.patches)
        and len(set(scene.supports.values())) == 1
        and is_symmetric(scene)
    )


def line(axis: str) -> str:
    """Name of the mesh's boundary on a mirror."""
    return f"{axis}=0"


def product_parity(first: Parity, second: Parity) -> Parity:
    """Parity of the product of two fields."""
    return tuple(a ^ b for a, b in zip(first, second))
