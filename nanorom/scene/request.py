"""What is asked of a scene: which modes, how they are reduced, and how accurately."""

from __future__ import annotations

from typing import Any

import attrs

from nanorom.errors import SceneError
from nanorom.scene import fields as v
from nanorom.scene import units

MOST_MODES = 100  # the cubic tensor has L^4 entries
HIGHEST_MODE = 1000
AUTO = "auto"  # count of modes that are chosen by what they do
FIRST = 24  # modes among which the choice begins
HIGHEST_DEGREE = 8


def _mode_numbers(value: Any) -> tuple[int, ...]:
    if not v.is_list(value) or not 1 <= len(value) <= MOST_MODES:
        raise units.wrong("modes.select", value, f"a list of 1 to {MOST_MODES} mode numbers")
    numbers = [v.read_integer(n, "modes.select", 1, HIGHEST_MODE) for n in value]
    if len(set(numbers)) < len(numbers):
        twice = next(n for n in numbers if numbers.count(n) > 1)
        raise SceneError(f"modes.select: mode {twice} appears twice; allowed: each mode once")
    return tuple(sorted(numbers))


def _mode_count(value: Any) -> int | str:
    if isinstance(value, str):
        if value != AUTO:
            raise units.wrong("modes.count", value, f'an integer from 1 to {MOST_MODES}, or "auto"')
        return AUTO
    return v.read_integer(value, "modes.count", 1, MOST_MODES)


@attrs.frozen(field_transformer=v.readers)
class Modes:
    """Which modes take part: the lowest ``count``, or ``select`` by 1-based number.

    With the count "auto" it is those that the response needs; until they are known, as many of the
    lowest stand for them as are looked at first.
    """

    count: int | str | None = attrs.field(
        default=None,
        metadata=v.custom(
            "modes.count",
            _mode_count,
            allowed=f'an integer from 1 to {MOST_MODES}, or "auto"',
            about="the lowest so many modes take part; auto: those that the response needs to be "
            "right to accuracy.response",
        ),
    )
    select: tuple[int, ...] | None = attrs.field(
        default=None,
        converter=v.as_optional_integers,
        metadata=v.custom(
            "modes.select",
            _mode_numbers,
            allowed="a list of up to 100 mode numbers, each once",
            about="instead of count: the modes by number, from 1 by frequency",
        ),
    )

    def __attrs_post_init__(self) -> None:
        if (self.count is None) == (self.select is None):
            found = "no key" if self.count is None else "count and select"
            raise SceneError(f"modes: found {found}; allowed: either count or select")

    @property
    def numbers(self) -> tuple[int, ...]:
        """1-based numbers by frequency of the modes that take part."""
        if self.select is not None:
            return self.select
        count = FIRST if self.automatic else self.count
        return tuple(range(1, int(count or 0) + 1))

    @property
    def automatic(self) -> bool:
        """Whether the program chooses them."""
        return self.count == AUTO

    @property
    def highest(self) -> int:
        """How many modes must be computed to have them all."""
        return self.numbers[-1]


@attrs.frozen(field_transformer=v.readers)
class Reduction:
    """How the tensors are found, and what moves while the modes deflect the film.

    in_plane: the displacement in the plane, free (in equilibrium) or fixed; outside: the rest of
    the film, static (in equilibrium too) or at rest; amplitude: largest deflection in m of STEP's
    load cases; None: found.
    """

    method: str = attrs.field(
        default="direct",
        metadata=v.choice(
            "reduction.method",
            ("direct", "step", "tangent"),
            about="how tensors are found: by linear in-plane problems, nonlinear static "
            "load cases or tangent stiffnesses",
        ),
    )
    in_plane: str = attrs.field(
        default="free",
        metadata=v.choice(
            "reduction.in_plane", ("free", "fixed"), about="whether the film may move in its plane"
        ),
    )
    amplitude: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity(
            "reduction.amplitude",
            "m",
            about="largest deflection of STEP's load cases; found by itself if left out",
        ),
    )
    solver: str = attrs.field(
        default="auto",
        metadata=v.choice(
            "reduction.solver",
            ("auto", "factors", "multigrid"),
            about="factors are fast, multigrid takes less memory; auto goes by size",
        ),
    )
    outside: str = attrs.field(
        default="static",
        metadata=v.choice(
            "reduction.outside",
            ("static", "rest"),
            about="whether the rest of a film that is not flat follows the modes statically",
        ),
    )


USUAL_TOLERANCE = 1e-6  # where the scene says nothing


@attrs.frozen(field_transformer=v.readers)
class Accuracy:
    """A tolerance that the program meets by itself, or degree and mesh_size chosen by hand.

    tolerance: relative, of frequencies and tensors; mesh_size: in m; response: relative, of what
    follows from the model.
    """

    tolerance: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity(
            "accuracy.tolerance",
            "1",
            v.within(1e-14, 1),
            about="relative, of frequencies and tensors; the mesh is made to meet it; "
            "1e-6 unless degree and mesh_size are given",
        ),
    )
    degree: int | None = attrs.field(
        default=None,
        metadata=v.integer(
            "accuracy.degree",
            1,
            HIGHEST_DEGREE,
            about="instead of tolerance, beside mesh_size: degree of the elements",
        ),
    )
    mesh_size: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity(
            "accuracy.mesh_size",
            "m",
            about="instead of tolerance, beside degree: length of a cell's sides",
        ),
    )
    response: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity(
            "accuracy.response",
            "1",
            v.within(1e-6, 1),
            about="relative, of the response's points: what the modes that are left out may make "
            "of it; 1e-3 for modes.count auto",
        ),
    )

    def __attrs_post_init__(self) -> None:
        by_hand = [n for n in ("degree", "mesh_size") if getattr(self, n) is not None]
        if self.tolerance is not None and by_hand:
            raise SceneError(
                f"accuracy.{by_hand[0]}: found beside tolerance; "
                "allowed: either tolerance, or degree and mesh_size"
            )
        if len(by_hand) == 1:
            other = "mesh_size" if by_hand == ["degree"] else "degree"
            raise SceneError(f"accuracy.{other}: missing; {by_hand[0]} needs it beside it")
        if self.tolerance is None and not by_hand:
            object.__setattr__(self, "tolerance", USUAL_TOLERANCE)
