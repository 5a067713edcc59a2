"""Growth about a torus: Lyapunov exponents of the linearised return map along an invariant curve.

The linearised map is multiplied with itself along the rotation (its entries stay smooth curves, as
the flow about a torus is reducible), then frames that begin with the tangent of the curve are
carried on by QR factors from every node at once. Along the curve the growth is zero; the others are
those of the normal directions, and their sum is the mean of log |det|. Sources: Dieci, Russell and
Van Vleck 1997, doi:10.1137/S0036142993247311 (frames); Jorba 2001, doi:10.1088/0951-7715/14/5/303
(reducibility).
"""

from __future__ import annotations

import numpy as np

from nanorom.continuation.tori.circle import circle
from nanorom.continuation.tori.invariance import Curve
from nanorom.types import Array

DOUBLINGS = 6  # at most, of the linearised map before frames are carried
LARGE = 1e4  # entries of the product beyond which round-off would hide the weaker directions
TRANSIENT, FRAMES = 32, 32  # products of maps until the frames have settled, and for the mean


def iterated(maps: Array, rotation: float) -> tuple[Array, float, int]:
    """The linearised map applied many times, at the nodes, its rotation and how many times."""
    nodes = circle((len(maps) - 1) // 2)
    times = 1
    for _ in range(DOUBLINGS):
        ahead = (nodes.rotation(rotation) @ maps.reshape(nodes.count, -1)).reshape(maps.shape)
        longer = ahead @ maps
        if np.abs(longer).max() > LARGE:
            break
        maps, rotation, times = longer, 2 * rotation, 2 * times
    return maps, rotation, times


def exponents(curve: Curve, maps: Array, free: bool = True) -> Array:
    """Logarithms of the growth per application of the map, in falling order: (2L - 1,) of the
    normal directions, without the zero along the curve, if its angle is `free`; all (2L,) where a
    second drive gives the angle.
    """
    return np.sort(_carried(curve, maps, free)[0])[::-1]


def _carried(curve: Curve, maps: Array, free: bool) -> tuple[Array, Array, float]:
    """Growth of the directions, the frames (N, 2L, 2L) at the nodes turned by an angle, and that
    angle.
    """
    nodes, size = curve.circle, maps.shape[1]
    along = nodes.derivative @ curve.values
    power, turn, times = iterated(maps, curve.rotation)
    flat = power.reshape(nodes.count, -1)
    random = np.random.default_rng(0).standard_normal((size, size))
    frame = np.tile(random, (nodes.count, 1, 1))
    total = np.zeros(size)
    for number in range(TRANSIENT + FRAMES):
        table = nodes.interpolation(nodes.angles + number * turn)
        # exactly along the curve, or the faster growing directions would take it over
        if free:
            frame[:, :, 0] = table @ along
            frame = np.linalg.qr(frame)[0]
        here = (table @ flat).reshape(power.shape)
        frame, upper = np.linalg.qr(here @ frame)
        if number >= TRANSIENT:
            total += np.log(np.abs(np.diagonal(upper, axis1=1, axis2=2))).mean(axis=0)
    return total[int(free) :] / (FRAMES * times), frame, (TRANSIENT + FRAMES) * turn


def doubles(curve: Curve, maps: Array, free: bool = True) -> bool:
    """Whether the direction that grows fastest changes its sign, once round the curve or by the
    map: a torus that branches along it is twice as long.
    """
    nodes = curve.circle
    _, frame, angle = _carried(curve, maps, free)
    field = frame[:, :, int(free)].copy()
    for i in range(1, nodes.count):
        field[i] *= np.sign(field[i] @ field[i - 1]) or 1.0
    if field[-1] @ field[0] < 0:
        return True
    here = nodes.interpolation(nodes.angles - angle) @ field  # at the nodes themselves
    image = np.einsum("nij,nj->ni", maps, here)
    if free:
        tangent = nodes.rotation(curve.rotation) @ nodes.derivative @ curve.values
        tangent /= np.linalg.norm(tangent, axis=1)[:, None]
        image -= (image * tangent).sum(axis=1)[:, None] * tangent
    wanted = nodes.interpolation(nodes.angles + curve.rotation - angle) @ field
    return float((image * wanted).sum()) < 0
