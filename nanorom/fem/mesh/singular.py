"""How singular stress and curvature are in a corner of the film.

In a corner of angle w displacements go as r^a and deflections as r^(a + 1), a being the lowest root
of an equation in sin(a w) (Williams 1952, doi:10.1115/1.4010553; of plates in bending: Williams
1951; both in Grisvard 1985).  On cells of size s at the corner the energy errs as s^(2 a).
"""

from __future__ import annotations

from collections.abc import Callable

import attrs
import numpy as np

from nanorom.scene.support import Kind, Spring, deflection_of, in_plane_of

Condition = Callable[[np.ndarray], np.ndarray]

SMOOTHEST = 3.0  # roots from here on count as this: a cell of high degree resolves them
ROOTS = np.linspace(0.2, SMOOTHEST, 561)
LOADED = 1.0  # exponent where tractions that end at a corner do not fit what is beyond it
RIGID = 0.02  # roots nearer to 1 than this are rotations, which have no energy


@attrs.frozen
class Corner:
    """Two straight sides: how each of them is held, and the film's angle between them."""

    first: Kind
    last: Kind
    angle: float

    def exponent(self, nu: float) -> float:
        """Error of the energy ~ (size of the cells at the corner)^exponent."""
        return 2 * min(self._in_plane(nu), self._bending(nu))

    @property
    def moves(self) -> bool:
        """Whether the film moves at the corner: neither side holds its deflection."""
        return not any(self._holds)

    @property
    def _holds(self) -> list[bool]:
        """Whether each side holds the deflection."""
        return [
            kind.spring is None if isinstance(kind, Spring) else kind != "free"
            for kind in map(deflection_of, (self.first, self.last))
        ]

    def _in_plane(self, nu: float) -> float:
        """Lowest exponent of the in-plane displacement.

        Where a side slides or is elastic, tractions do not fit at the corner: r f(angle), r log r.
        """
        held = [in_plane_of(kind) for kind in (self.first, self.last)]
        fit = all(kind in ("fixed", "free") for kind in held) or all(self._holds)
        lowest = self._unloaded([kind if isinstance(kind, str) else "free" for kind in held], nu)
        return lowest if fit else min(lowest, LOADED)

    def _unloaded(self, kinds: list[str], nu: float) -> float:
        """The same of what no load causes; elastic edges count as free."""
        sliding = [kind in ("normal", "tangential") for kind in kinds]
        if all(sliding):
            turns = np.pi / (self.angle if kinds[0] == kinds[1] else 2 * self.angle)
            regular = abs(turns - round(turns)) < RIGID
            return SMOOTHEST if regular else min(SMOOTHEST, abs(turns - 1))
        if any(sliding):  # the film goes on beyond a side along which it slides: its mirror image
            other = kinds[sliding.index(False)]
            return attrs.evolve(self, angle=2 * self.angle)._between([other, other], nu)
        return self._between(kinds, nu)

    def _between(self, kinds: list[str], nu: float) -> float:
        """The same between sides of which each is fixed or free."""
        kappa = (3 - nu) / (1 + nu)
        sine = np.sin(self.angle)
        held = [kind == "fixed" for kind in kinds]
        if all(held):
            return self._lowest(lambda a: (a * sine / kappa) ** 2)
        if any(held):
            return self._lowest(lambda a: ((kappa + 1) ** 2 / 4 - (a * sine) ** 2) / kappa)
        return self._lowest(lambda a: (a * sine) ** 2, rigid=True)

    def _bending(self, nu: float) -> float:
        """Lowest exponent of the slope; elastic edges count as free, as they do close by."""
        sine = np.sin(self.angle)
        held = map(deflection_of, (self.first, self.last))
        kinds = {"free" if isinstance(kind, Spring) else kind for kind in held}
        if "simply_supported" in kinds:
            return self._bent_at_support(kinds, nu)
        if kinds == {"clamped"}:
            return self._lowest(lambda a: (a * sine) ** 2, rigid=True)
        if kinds == {"free"}:
            return self._lowest(lambda a: ((1 - nu) / (3 + nu) * a * sine) ** 2)
        return self._lowest(lambda a: (4 - ((1 - nu) * a * sine) ** 2) / ((1 - nu) * (3 + nu)))

    def _bent_at_support(self, kinds: set[str], nu: float) -> float:
        """The same where a side is simply supported: odd about it, the film has twice the angle."""
        turns = np.pi / self.angle
        if kinds == {"simply_supported"}:
            regular = abs(turns - round(turns)) < RIGID
            return SMOOTHEST if regular else min(SMOOTHEST, abs(turns - 1))
        twice = attrs.evolve(self, angle=2 * self.angle)
        factor = 1.0 if "clamped" in kinds else (1 - nu) / (3 + nu)
        sine = np.sin(twice.angle)
        if abs(sine) < RIGID:
            return SMOOTHEST if abs(turns - round(turns)) < RIGID else turns / 2
        return twice._lowest(lambda a: (factor * a * sine) ** 2, rigid=True)

    def _lowest(self, square: Condition, rigid: bool = False) -> float:
        """Lowest root a of sin(a w)^2 = square(a), or the real part of a complex one.

        rigid: 1 is a root of what has no energy.
        """
        difference = np.sin(ROOTS * self.angle) ** 2 - square(ROOTS)
        turns = np.flatnonzero(difference[:-1] * difference[1:] < 0)
        found = [float(ROOTS[i]) for i in turns if not rigid or abs(ROOTS[i] - 1) > RIGID]
        peak = np.pi / (2 * self.angle)  # of the sine, where two real roots meet
        if difference[0] < 0 and square(np.array(peak)) > 1 - RIGID:
            found.append(peak)
        return min(found, default=SMOOTHEST)
