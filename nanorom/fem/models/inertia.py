"""In-plane inertia, which static condensation neglects.

Condensation takes the in-plane displacement to follow the deflection at once: true where its own
resonances are far above those of the modes, whose products move at up to twice their frequency.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping

from nanorom.errors import AccuracyWarning, SlowPlaneError
from nanorom.scene.units import with_unit

NEAR = 2.0  # times the fastest product of two modes: in-plane resonances below that are told of


def check(
    in_plane: float,
    highest: float,
    classes: Mapping[int, tuple[int, ...]],
    slender: Callable[[], bool] = lambda: False,
) -> None:
    """Raise SlowPlaneError unless in-plane resonances are above the modes; warn if they are near.

    in_plane : a bound from above on the lowest in-plane frequency; highest : the largest frequency
    of the modes, both in Hz; classes : of symmetry of the modes by number; slender : whether the
    film bends in its plane as a string does, which tension makes faster too, asked when it matters.
    """
    fastest = 2 * highest
    if in_plane > NEAR * fastest:
        return
    told = f"in-plane resonances begin at {with_unit(in_plane, 'Hz', 3)} or below, "
    remedy = "make the film wider" if slender() else "lower the tension"
    if in_plane <= highest:
        raise SlowPlaneError(
            f"{told}that is below the highest mode's {with_unit(highest, 'Hz', 3)}: the film's "
            f"plane does not follow such modes statically; ask for fewer of them or {remedy}",
            classes,
        )
    warnings.warn(
        f"{told}and products of the modes move at up to {with_unit(fastest, 'Hz', 3)}: in-plane "
        f"inertia, which is neglected, changes coefficients by "
        f"{(fastest / in_plane) ** 2:.0%} there; ask for fewer modes",
        AccuracyWarning,
        stacklevel=2,
    )
