"""Names of modes: f_{p,m} on discs, (m,n) on rectangles.

p counts nodal diameters, m nodal circles (the edge included), with c or s for cos(p theta) or
sin(p theta); on rectangles (m,n) counts half-waves along x and y.  Names say what a shape is
closest to: with unequal tensions a drum's shapes are no pure harmonics.
"""

from __future__ import annotations

import attrs
import numpy as np
from scipy.special import jn_zeros, jv

from nanorom.fem import quadrature
from nanorom.fem.modes import Modes, clusters
from nanorom.fem.shapes import bounding_box, extent, orient

MIXED = 0.9  # a second component at least so large makes a name of two
RADIAL_GRID = 2001  # points of a tabulated Bessel function: enough to tell modes apart


def name_drum(modes: Modes, isotropic: bool) -> tuple[Modes, list[str]]:
    """Orient the pairs of a drum and name its modes ``f01``, ``f11c``, ``f11s``... Collective.

    ``isotropic``: the tension is, so that every pair is degenerate by symmetry.
    """
    candidates = _drum_modes(modes.shapes.shape[1])
    nearest = np.abs(_drum_content(modes, candidates)).argmax(axis=1)
    # a cos-sin pair belongs together whatever splits it: both axes are axes of symmetry
    groups = [np.flatnonzero(nearest == i) for i in np.unique(nearest) if candidates[i][0] > 0]
    modes = orient(modes, groups)
    content = _drum_content(modes, candidates)
    keys = []
    for i, best in enumerate(np.abs(content).argmax(axis=1)):
        p, m = candidates[best]
        odd = abs(content[i, best].imag) > abs(content[i, best].real)
        keys.append((p, m, "" if p == 0 else "s" if odd else "c"))
    if isotropic:
        modes, keys = _sorted(modes, groups, keys)
    separator = "," if max(max(p, m) for p, m, _ in keys) > 9 else ""
    return modes, [f"f{p}{separator}{m}{side}" for p, m, side in keys]


def _drum_modes(count: int) -> list[tuple[int, int]]:
    """Nodal diameters and circles (p, m) of an ideal membrane's lowest modes, with some to spare."""
    highest = 2 * int(np.sqrt(count)) + 4
    zeros = [(z, p, m + 1) for p in range(highest) for m, z in enumerate(jn_zeros(p, highest))]
    enough = 2 * count + 10
    return [(p, m) for _, p, m in sorted(zeros)[:enough]]


def _drum_content(modes: Modes, candidates: list[tuple[int, int]]) -> np.ndarray:
    """Products (n, K) of the shapes with J_p(j_pm r) exp(i p theta), normalised membrane modes."""
    plate = modes.plate
    centre, radius = extent(plate)
    grid = np.linspace(0, 1, RADIAL_GRID)
    radial = np.empty((len(candidates), RADIAL_GRID))
    for i, (p, m) in enumerate(candidates):
        zero = jn_zeros(p, m)[-1]
        radial[i] = jv(p, zero * grid) / abs(jv(p + 1, zero)) / (1 if p == 0 else np.sqrt(0.5))
    orders = np.array([p for p, _ in candidates])
    total = np.zeros((modes.shapes.shape[1], len(candidates)), dtype=complex)
    for field in quadrature.fields(plate, 2 * plate.degree, columns=4 * len(candidates)):
        z = ((field.points - centre) / radius) @ np.array([1, 1j])
        place = np.minimum(np.abs(z), 1.0) * (RADIAL_GRID - 1)
        nearest = np.rint(place).astype(int)
        waves = np.exp(1j * np.angle(z)[..., None] * orders) * radial.T[nearest]
        weighted = field.weights[..., None] * field.value(modes.shapes)
        n_points = weighted.shape[0] * weighted.shape[1]
        total += weighted.reshape(n_points, -1).T @ waves.reshape(n_points, -1)
    return plate.domain.comm.allreduce(total)


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
    """Sort the modes of each group by their keys; equal frequencies are told as equal."""
    order, eigenvalues = np.arange(len(keys)), modes.eigenvalues.copy()
    for group in groups:
        order[group] = sorted(group, key=lambda i: keys[i])
        eigenvalues[group] = eigenvalues[group].mean()
    shapes = np.ascontiguousarray(modes.shapes[:, order])
    return attrs.evolve(modes, shapes=shapes, eigenvalues=eigenvalues), [keys[i] for i in order]


def name_by_number(modes: Modes) -> tuple[Modes, list[str]]:
    """Orient equal frequencies and name modes of any other shape by their number. Collective."""
    modes = orient(modes, clusters(modes.eigenvalues))
    return modes, [f"mode {i + 1}" for i in range(len(modes.eigenvalues))]
