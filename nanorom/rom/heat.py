"""Heat in the film as states of first order beside its modes.

    T_s' = -R_s T_s + (P0 + P1 cos omega t) p_s ,  K -> K + sum_s k_s T_s ,  F -> F + sum_s f_s T_s

The temperature above that of the frame is sum_s T_s psi_s(x), psi_s the modes of heat conduction
with |psi_s| <= 1; expansion against the frame takes tension out of the film (k), and pushes one
that is not flat (f).  Where a cavity makes what is absorbed depend on the deflection w, by a factor
1 + a w + b w^2/2 of what it is at rest, the mean power feeds them by the motion, too:

    T_s' = ... + P0 (a sum_j g_sj q_j + b/2 sum_jk h_sjk q_j q_k)
"""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.files.schema import array
from nanorom.rom.arrays import as_array, as_optional
from nanorom.types import Array

STEPS, SETTLED = 50, 1e-13  # of Newton's method for the heated state; relative


@attrs.frozen(eq=False, kw_only=True)
class Heat:
    """S thermal modes and what they do to L modes."""

    rate: Array = attrs.field(
        converter=as_array, metadata=array("S", "1/s", "rates R at which thermal modes relax")
    )
    feed: Array = attrs.field(
        converter=as_array,
        metadata=array("S", "K/J", "what a watt of the scene's laser feeds them with"),
    )
    stiffness: Array = attrs.field(
        converter=as_array, metadata=array("L, L, S", "N/m/K", "k: what they add to K")
    )
    force: Array = attrs.field(
        converter=as_array, metadata=array("L, S", "N/K", "f: how they push the modes")
    )
    feed_by_mode: Array | None = attrs.field(
        default=None,
        converter=as_optional,
        metadata=array("S, L", "K/J", "g: as feed, of light weighed with each mode"),
    )
    feed_by_pair: Array | None = attrs.field(
        default=None,
        converter=as_optional,
        metadata=array("S, L, L", "K/J", "h: as feed, of light weighed with products of modes"),
    )

    def temperature(self, power: float) -> Array:
        """T_s (S,) in K of a constant power in W."""
        return power * self.feed / self.rate


def heated(
    stiffness: Array, quadratic: Array, cubic: Array, heat: Heat, power: float
) -> tuple[Array, Array]:
    """Stiffness (L, L) and quadratic tensor (L, L, L) about the state under a constant power in W.

    The film moves until K q + A qq + B qqq balances the heat's force, by Newton's method.
    """
    t = heat.temperature(power)
    linear, force = stiffness + heat.stiffness @ t, heat.force @ t
    q = np.zeros(len(force))
    for _ in range(STEPS):
        by_q = quadratic @ q
        by_qq = cubic @ q @ q
        step = np.linalg.solve(linear + 2 * by_q + 3 * by_qq, force - (linear + by_q + by_qq) @ q)
        q = q + step
        if np.abs(step).max() <= SETTLED * np.abs(q).max():
            break
    return linear + 2 * quadratic @ q + 3 * cubic @ q @ q, quadratic + 3 * cubic @ q
