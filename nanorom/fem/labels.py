"""Names of modes: f_{p,m} on discs, (m,n) on rectangles.

p counts nodal diameters, m nodal circles (the edge included), with c or s for cos(p theta) or
sin(p theta); on rectangles (m,n) counts half-waves along x and y.  Names say what a shape is
closest to: with unequal tensions a drum's shapes are no pure harmonics.
"""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.fem import quadrature
from nanorom.fem.modes import Modes, clusters
from nanorom.fem.shapes import bounding_box, extent, orient

MIXED = 0.9  # a second component at least so large makes a name of two
PAIR = 1e-3  # eigenvalues of a drum's cos-sin pair agree to this, however coarse the mesh


def name_drum(modes: Modes) -> tuple[Modes, list[str]]:
    """Orient the pairs of a drum and name its modes ``f01``, ``f11c``, ``f11s``... Collective."""
    diameters = _nodal_diameters(modes)
    groups = [
        group
        for cluster in clusters(modes.eigenvalues, PAIR)
        for group in _same(cluster, diameters)
    ]
    modes = orient(modes, groups)
    odd = _odd_in_y(modes, diameters)
    rank: dict[tuple[int, str], int] = {}
    keys = []
    for p, is_odd in zip(diameters.tolist(), odd):
        side = "" if p == 0 else "s" if is_odd else "c"
        rank[p, side] = rank.get((p, side), 0) + 1
        keys.append((p, rank[p, side], side))
    modes, keys = _sorted(modes, groups, keys)
    separator = "," if max(max(p, m) for p, m, _ in keys) > 9 else ""
    return modes, [f"f{p}{separator}{m}{side}" for p, m, side in keys]


def _same(cluster: np.ndarray, diameters: np.ndarray) -> list[np.ndarray]:
    """Split neighbours in frequency by their nodal diameters."""
    return [cluster[diameters[cluster] == p] for p in np.unique(diameters[cluster])]


def _nodal_diameters(modes: Modes) -> np.ndarray:
    """Number (n,) of nodal diameters: p^2 = int (d phi/d theta)^2 / int phi^2."""
    plate, shapes = modes.plate, modes.shapes
    centre, radius = extent(plate)
    turning, size = np.zeros((2, shapes.shape[1]))
    for field in quadrature.fields(plate, 2 * plate.degree + 2):
        x, y = np.moveaxis((field.points - centre) / radius, 2, 0)
        slopes = field.gradient(shapes) * radius
        spin = x[..., None] * slopes[:, :, 1] - y[..., None] * slopes[:, :, 0]
        turning += np.einsum("cq,cqn->n", field.weights, spin**2)
        size += np.einsum("cq,cqn->n", field.weights, field.value(shapes) ** 2)
    turning, size = plate.domain.comm.allreduce(np.array([turning, size]))
    return np.rint(np.sqrt(turning / size)).astype(int)


def _odd_in_y(modes: Modes, diameters: np.ndarray) -> np.ndarray:
    """True (n,) where a shape follows sin(p theta) rather than cos(p theta)."""
    plate = modes.plate
    centre, radius = extent(plate)
    moment = np.zeros(len(diameters), dtype=complex)
    for field in quadrature.fields(plate, 2 * plate.degree + 2):
        z = ((field.points - centre) / radius) @ np.array([1, 1j])
        weighted = field.weights[..., None] * field.value(modes.shapes)
        moment += np.sum(weighted * z[..., None] ** diameters, axis=(0, 1))
    moment = plate.domain.comm.allreduce(moment)
    return np.abs(moment.imag) > np.abs(moment.real)


def name_rectangle(
    modes: Modes, free_x: bool = False, free_y: bool = False
) -> tuple[Modes, list[str]]:
    """Orient equal frequencies and name the modes ``(m,n)`` by half-waves along x and y.

    ``free_x``, ``free_y``: the ends along x, y are free.  Between supported ends half-waves are sines; between free ones cosines, counted from 0.
    Collective.
    """
    groups = clusters(modes.eigenvalues)
    modes = orient(modes, groups)
    keys = []
    for spectrum in _wave_content(modes, free_x, free_y):
        first, second = np.argsort(np.abs(spectrum).ravel())[::-1][:2]
        m, n = np.unravel_index(first, spectrum.shape)
        label = f"({m},{n})"
        if np.abs(spectrum.flat[second]) > MIXED * np.abs(spectrum.flat[first]):
            same = spectrum.flat[first] * spectrum.flat[second] > 0
            (m, n), other = sorted([(m, n), np.unravel_index(second, spectrum.shape)])
            label = f"({m},{n}){'+' if same else '-'}({other[0]},{other[1]})"
        keys.append((m, n, label))
    modes, keys = _sorted(modes, groups, keys)
    return modes, [label for _, _, label in keys]


def _wave_content(modes: Modes, free_x: bool, free_y: bool) -> np.ndarray:
    """Coefficients (n, M, M) of the shapes in products of sines (or cosines, where free)."""
    plate = modes.plate
    low, high = bounding_box(plate)
    count = modes.shapes.shape[1] + 2
    total = np.zeros((modes.shapes.shape[1], count, count))
    for field in quadrature.fields(plate, 2 * plate.degree + 2, columns=2 * count):
        value = field.weights[..., None] * field.value(modes.shapes)
        waves = []
        for axis, free in ((0, free_x), (1, free_y)):
            s = (field.points[..., axis] - low[axis]) / (high[axis] - low[axis])
            phase = np.pi * s[..., None] * np.arange(count)
            waves.append(np.cos(phase) if free else np.sin(phase))
        total += np.einsum("cqi,cqm,cqn->imn", value, *waves, optimize=True)
    return plate.domain.comm.allreduce(total)


def _sorted(
    modes: Modes, groups: list[np.ndarray], keys: list[tuple]
) -> tuple[Modes, list[tuple]]:
    """Sort the modes of each group by their keys."""
    order = np.arange(len(keys))
    for group in groups:
        order[group] = sorted(group, key=lambda i: keys[i])
    shapes = np.ascontiguousarray(modes.shapes[:, order])
    eigenvalues = modes.eigenvalues[order]
    return attrs.evolve(modes, shapes=shapes, eigenvalues=eigenvalues), [keys[i] for i in order]
