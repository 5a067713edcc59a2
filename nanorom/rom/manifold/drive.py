"""What a periodic drive adds to a manifold, to first order in its level.

u = W(z) + 2 Re(S(z) exp(i omega t)), and z' = f(z) + 2 Re(g(z) exp(i omega t)) likewise, of any
degree in z: degree 0 is the linear response to the direct drive, degree 1 the parametric drive and
what the moving film makes of the direct one. Source: Haller and Ponsioen 2016,
doi:10.1007/s11071-016-2974-z; Opreni, Vizzaccaro, Touze and Frangi 2023,
doi:10.1007/s11071-022-07978-3.
"""

from __future__ import annotations

import attrs
import numpy as np
from numpy.typing import NDArray

from nanorom.errors import ModelError
from nanorom.rom.manifold.equations import Equations
from nanorom.rom.manifold.invariance import Expansion, carried
from nanorom.rom.manifold.monomials import Index
from nanorom.types import Array, Numbers

ALIKE = 1e-9  # turns that are the same


@attrs.frozen(eq=False)
class Driven:
    """S (P, 2L) and g (P, 2m) of exp(i omega t), zero above the degree asked for."""

    shape: Numbers
    dynamics: Numbers


def check_levels(levels: tuple[float, float], patterns: tuple[Array, Array]) -> None:
    """Raise ModelError for a level of the direct or the parametric drive whose pattern is zero."""
    for name, level, pattern in zip(("direct", "parametric"), levels, patterns):
        if level and not pattern.any():
            raise ModelError(
                f"{name}: found {level:g}; allowed: 0, for the pattern of this drive does no work "
                "on the manifold's modes"
            )


def driven(
    equations: Equations,
    expansion: Expansion,
    omega: float,
    levels: tuple[float, float],
    turns: Array,
    degree: int,
) -> Driven:
    """The drive's part at one frequency.

    levels : of the direct and the parametric drive; turns (2m,): phases of the masters by the
    drive's: what turns with a master is kept in its equation; degree : highest in z.
    """
    basis, monomials, places = equations.basis, expansion.monomials, expansion.masters
    q, speed = (expansion.shape @ matrix.T for matrix in (basis.shapes, basis.speeds))
    shape, dynamics = np.zeros_like(expansion.shape), np.zeros_like(expansion.dynamics)
    own = expansion.dynamics.copy()
    own[monomials.of(1)] = 0.0  # whose part is sigma
    for d in range(degree + 1):
        here = monomials.of(d)
        force = _outer(equations, q[here], levels, d)
        if d:
            s, s_speed = shape @ basis.shapes.T, shape @ basis.speeds.T
            force = force - expansion.forces.change(d, q, speed, s, s_speed)
        right: Numbers = force @ basis.inverse.T
        if d:
            right -= carried(monomials, expansion.shape, dynamics, d, 2, 0)
            right -= carried(monomials, shape, own, d, 1, 2)
        kept = _turning(monomials.powers[here], turns)
        dynamics[here] = np.where(kept, right[:, places], 0.0)
        right[:, places] -= dynamics[here]
        divisors = 1j * omega + expansion.sigma[here, None] - basis.rates
        divisors[:, places] = np.where(kept, 1.0, divisors[:, places])
        shape[here] = right / divisors
    return Driven(shape, dynamics)


def _outer(equations: Equations, q: Numbers, levels: tuple[float, float], degree: int) -> Numbers:
    """Half the amplitude (n, L) of the drive's force, of one degree."""
    force = levels[1] / 2 * (q @ equations.parametric.T)
    return force + levels[0] / 2 * equations.direct if degree == 0 else force


def _turning(powers: Index, turns: Array) -> NDArray[np.bool_]:
    """(n, 2m): whether exp(i omega t) z^a turns as a master does."""
    return np.asarray(np.abs(1 + powers @ turns[:, None] - turns) < ALIKE)
