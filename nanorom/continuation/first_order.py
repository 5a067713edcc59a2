"""States of first order beside the modes: temperatures, photocurrents, slow charges.

    T' = -R T + g q + h qq + (drive)
    M q'' + C q' + (K + sum_s k_s T_s) q + ... = F(t, q) + f T

Inside, a state is a coordinate without inertia and with unit damping, so that orbits, multipliers
and branches need nothing else. Of such a coordinate, the rate T' is no state of its own: it counts
as one with a multiplier of zero.
"""

from __future__ import annotations

from collections.abc import Mapping

import attrs
import numpy as np

from nanorom.continuation.arrays import checked, square, symmetrise_quadratic
from nanorom.errors import ContinuationError
from nanorom.types import Array

FASTEST = 300.0  # relaxation by the highest natural frequency: faster ones cost minutes


@attrs.frozen(eq=False, init=False)
class FirstOrder:
    """S states of first order of a `ModalSystem` of L modes, in any units of their own.

    Parameters
    ----------
    rate : (S, S), (S,) or number
        R, relaxation rates 1/tau, per unit of time; off the diagonal, what states pass on.
    displacement : (S, L), optional
        g, by which displacements feed the states.
    squares : (S, L, L), optional
        h, by which products q_j q_k feed them.
    force : (L, S), optional
        f, modal force per unit of a state.
    stiffness : (L, L, S), optional
        k, modal stiffness per unit of a state.

    Raises
    ------
    ContinuationError
        for wrong shapes, NaN, or states that do not relax.
    """

    rate: Array
    displacement: Array
    squares: Array
    force: Array
    stiffness: Array

    def __init__(
        self,
        rate: object,
        displacement: object = None,
        squares: object = None,
        force: object = None,
        stiffness: object = None,
    ) -> None:
        given = {"displacement": (0, displacement), "squares": (0, squares), "force": (1, force)}
        sizes = [np.shape(a)[i] for i, a in given.values() if a is not None]  # type: ignore[arg-type]
        count = np.shape(rate)[0] if np.ndim(rate) else (sizes or [1])[0]  # type: ignore[arg-type]
        modes = self._modes(displacement, squares, force, stiffness)
        shapes = {
            "displacement": (count, modes),
            "squares": (count, modes, modes),
            "force": (modes, count),
            "stiffness": (modes, modes, count),
        }
        arrays = {"displacement": displacement, "squares": squares}
        arrays |= {"force": force, "stiffness": stiffness}
        self.__attrs_init__(  # type: ignore[attr-defined]
            rate=square(rate, count, "states.rate"),
            **{
                name: np.zeros(shapes[name])
                if array is None
                else checked(array, shapes[name], f"states.{name}")
                for name, array in arrays.items()
            },
        )
        if np.linalg.eigvals(self.rate).real.min() <= 0:
            raise ContinuationError(
                "states.rate: a state does not relax; every relaxation rate must be positive"
            )

    @staticmethod
    def _modes(displacement: object, squares: object, force: object, stiffness: object) -> int:
        for array, axis in ((displacement, 1), (squares, 1), (force, 0), (stiffness, 0)):
            if array is not None and np.ndim(array) > axis:  # type: ignore[arg-type]
                return int(np.shape(array)[axis])  # type: ignore[arg-type]
        raise ContinuationError(
            "states: coupled to no mode; give displacement, squares, force or stiffness"
        )

    @property
    def size(self) -> int:
        """Number of states S."""
        return len(self.rate)

    @property
    def modes(self) -> int:
        """Number of modes L that they go with."""
        return len(self.force)

    def condensed(self) -> tuple[Array, Array, Array, Array, Array]:
        """What states that follow at once, T = R^-1 (g q + h qq + s), add to the modes.

        Stiffness (L, L), quadratic (L, L, L) and cubic tensor (L, L, L, L), in the units of the
        system; force (L, S) and stiffness (L, L, S) by what feeds the states.
        """
        follow = np.linalg.inv(self.rate)
        linear, square_ = follow @ self.displacement, np.tensordot(follow, self.squares, axes=1)
        return (
            -self.force @ linear,
            np.tensordot(self.stiffness, linear, axes=1) - np.tensordot(self.force, square_, 1),
            np.tensordot(self.stiffness, square_, axes=1),
            self.force @ follow,
            self.stiffness @ follow,
        )


def joined(
    arrays: Mapping[str, Array], states: FirstOrder, mass: Array, frequency: float
) -> dict[str, Array]:
    """Arrays over the mass of L modes, `widened` by the states, with the equations of these.

    The states' equations are multiplied by `frequency`, the unit of 1/time: what makes the other
    equations of second order non-dimensional does it for these, too.
    """
    result = dict(arrays)
    q, t = slice(0, states.modes), slice(states.modes, None)
    for name in ("damping", "stiffness", "quadratic"):
        result[name] = result[name].copy()
    result["damping"][t, t] = frequency * np.eye(states.size)
    result["stiffness"][t, t] = frequency * states.rate
    result["stiffness"][t, q] = -frequency * states.displacement
    result["quadratic"][t, q, q] = -frequency * symmetrise_quadratic(states.squares)
    inverse = np.linalg.inv(mass)
    result["stiffness"][q, t] = -inverse @ states.force
    stiffness = np.tensordot(inverse, states.stiffness, axes=1) / 2
    result["quadratic"][q, q, t] = stiffness
    result["quadratic"][q, t, q] = stiffness.transpose(0, 2, 1)
    return result


def widened(arrays: Mapping[str, Array], count: int) -> dict[str, Array]:
    """The arrays with zeros for `count` more coordinates."""
    if not count:
        return dict(arrays)
    wider = {}
    for name, array in arrays.items():
        coordinates = array.ndim - (name in ("direct", "parametric"))  # the last axis: terms
        by_axis = [(0, count)] * coordinates + [(0, 0)] * (array.ndim - coordinates)
        wider[name] = np.pad(array, by_axis)
    return wider


def units_of(stiffness: Array, quadratic: Array, force: Array, modes: int) -> Array:
    """Sizes (L + S,) of the coordinates of scaled equations: one of the modes, and of the states
    what unit displacements or, without these, the drive makes of them.
    """
    t = slice(modes, None)
    relaxation = np.linalg.inv(np.eye(len(stiffness) - modes) + np.abs(stiffness[t, t]))
    feeds = (
        np.abs(stiffness[t, :modes]).sum(axis=1) + np.abs(quadratic[t]).sum(axis=(1, 2)),
        np.abs(force[t]).sum(axis=1),
    )
    sizes = np.abs(relaxation) @ feeds[0]
    sizes = np.where(sizes > 0, sizes, np.abs(relaxation) @ feeds[1])
    return np.append(np.ones(modes), np.where(sizes > 0, sizes, 1.0))
