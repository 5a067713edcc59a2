"""Names of modes: f_{p,m} on discs, (m,n) on rectangles.

p counts nodal diameters, m nodal circles (the edge included), with c or s for cos(p theta) or
sin(p theta), and with a comma between p and m where one is above nine; on rectangles (m,n) counts
half-waves along x and y.  Names say what a shape is closest to: with unequal tensions a drum's
shapes are no pure harmonics.  No two modes have one name, and near ones are numbered by name: which
of them is the lower may be beyond any mesh.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import attrs
import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.special import jn_zeros, jv

from nanorom.fem.fields import quadrature
from nanorom.fem.fields.places import bounding_box, extent
from nanorom.fem.modes import turning
from nanorom.fem.modes.deflections import AnyModes, Deflections
from nanorom.fem.modes.eigen import DEGENERATE, NEAR, clusters
from nanorom.fem.modes.normal import orient
from nanorom.fem.symmetry import AXES, OPPOSITE, Parity, is_square, is_symmetric
from nanorom.scene.geometry import Disc, Rectangle
from nanorom.scene.scene import Scene
from nanorom.scene.support import deflection_of

MIXED = 0.9  # a second component at least so large makes a name of two
PURE = 0.99  # of a shape's square in one harmonic: less is a mixture
RANKED = 1e-5  # squared frequencies closer than this (relative) are ranked by name
RADIAL_GRID = 501  # points of a tabulated Bessel function: enough to tell modes apart


def name(scene: Scene, modes: AnyModes, unsure: float = 0.0) -> tuple[AnyModes, list[str]]:
    """Orient degenerate modes and name all of them by the scene's shape. Collective.

    unsure : relative error of squared frequencies; modes that it does not separate are ranked by
    name, as are those closer than `RANKED`.
    """
    unsure = min(unsure, NEAR)
    ranked = max(RANKED, unsure)
    if isinstance(scene.geometry, Disc):
        symmetric = not scene.tension.xy and is_symmetric(scene)
        free = deflection_of(scene.support.kind("edge")) == "free"
        return name_drum(modes, symmetric, scene.tension.is_isotropic, free, ranked)
    if isinstance(scene.geometry, Rectangle):
        open_ends = {s: deflection_of(kind) == "free" for s, kind in scene.supports.items()}
        equal = DEGENERATE if is_square(scene) else 0.0
        ends = [(open_ends[low], open_ends[high]) for low, high in OPPOSITE.values()]
        return name_rectangle(modes, ends, equal, ranked)
    return name_by_number(modes, max(DEGENERATE, unsure))


def name_drum(
    modes: AnyModes,
    symmetric: bool,
    isotropic: bool,
    free: bool = False,
    ranked: float = RANKED,
) -> tuple[AnyModes, list[str]]:
    """Orient the pairs of a drum and name its modes ``f01``, ``f11c``, ``f11s``... Collective.

    ``symmetric``: both axes are mirrors of the drum and its load, so that what splits a pair lies
    along them; ``isotropic``: the tension is, so that nothing splits a pair of a symmetric drum;
    ``free``: its edge is no nodal circle; ``ranked``: relative difference of squared frequencies
    below which names rank.
    """
    candidates = _drum_modes(modes.shapes.shape[1])
    content = _drum_content(modes, candidates)
    nearest = np.abs(content).argmax(axis=1)
    # a load off the axes leaves those of a pair open only where frequencies are equal; else a mesh
    # without mirrors mixes what differs by less than its error.  Modes further apart are no pair,
    # whatever their shapes are closest to
    splits = np.zeros(len(nearest), dtype=int)
    for i, cluster in enumerate(clusters(modes.eigenvalues, NEAR if symmetric else DEGENERATE)):
        splits[cluster] = i
    like = [(*candidates[i], splits[n], modes.parities[n]) for n, i in enumerate(nearest)]
    groups = [
        np.array([n for n, other in enumerate(like) if other == one])
        for one in sorted(set(like))
        if one[0] > 0
    ]
    if any(len(group) > 1 for group in groups):
        modes = orient(modes, groups)
        content = _drum_content(modes, candidates)
    keys = _drum_keys(content, candidates, symmetric)
    if isotropic and symmetric:
        modes = attrs.evolve(modes, diameters=_diameters(content, candidates))
    if isotropic or not symmetric:
        like = [(*key[:2], split) for key, split in zip(keys, splits)]
        pairs = [
            np.array([n for n, other in enumerate(like) if other == one])
            for one in like
            if one[0] > 0
        ]
        modes, keys = _sorted(_equalised(modes, pairs), pairs, keys)
    modes, keys = _sorted(modes, clusters(modes.eigenvalues, ranked), keys)
    if free:
        keys = [(p, circles, side) for (p, _, side), circles in zip(keys, _circles(keys))]
    return modes, [f"f{p}{',' if max(p, m) > 9 else ''}{m}{side}" for p, m, side in keys]


def _drum_keys(
    content: np.ndarray, candidates: list[tuple[int, int]], symmetric: bool
) -> list[tuple]:
    """Nodal diameters, circles and side of modes by their content (n, K), no two alike."""
    nearest = np.abs(content).argmax(axis=1)
    best = content[np.arange(len(nearest)), nearest]
    lean = np.abs(best.imag) - np.abs(best.real)  # to the sine
    keys: list[tuple] = []
    for n, i in enumerate(nearest):
        p, m = candidates[i]
        pair = np.flatnonzero(nearest == i)
        middle = 0.0 if symmetric or len(pair) != 2 else lean[pair].mean()
        keys.append((p, m, "" if p == 0 else "s" if lean[n] > middle else "c"))
    known: list[tuple] = []
    scores = []
    for (p, m), score in zip(candidates, content.T):
        for side, part in zip("cs" if p else ("",), (score.real, score.imag)):
            known.append((p, m, side))
            scores.append(np.abs(part))
    return _unique(keys, known, np.array(scores).T)


def _unique(keys: list[tuple], known: list[tuple], scores: np.ndarray) -> list[tuple]:
    """Keys of modes, those that several modes have dealt out by their scores (n, K)."""
    shared = [i for i, key in enumerate(keys) if keys.count(key) > 1]
    taken = {key for i, key in enumerate(keys) if i not in shared}
    left = [k for k, key in enumerate(known) if key not in taken]
    chosen = list(keys)
    for i, k in zip(*linear_sum_assignment(scores[np.ix_(shared, left)] ** 2, maximize=True)):
        chosen[shared[i]] = known[left[k]]
    return chosen


def _circles(keys: list[tuple]) -> list[int]:
    """Nodal circles of the modes of a free disc, from (p, m, side) in the order of frequencies.

    Those of p = 0 and 1 without any are rigid motions, which are left out.
    """
    found = []
    for i, (p, _, side) in enumerate(keys):
        before = sum((q, other) == (p, side) for q, _, other in keys[:i])
        found.append(before + (1 if p < 2 else 0))
    return found


def _diameters(content: np.ndarray, candidates: list[tuple[int, int]]) -> np.ndarray | None:
    """Nodal diameters (n,) of modes that are one harmonic each; None if one seems to be mixed."""
    orders = np.array([p for p, _ in candidates])
    shares = np.column_stack(
        [np.sum(np.abs(content[:, orders == p]) ** 2, axis=1) for p in range(orders.max() + 1)]
    )
    pure = shares.max(axis=1) > PURE * shares.sum(axis=1)
    return shares.argmax(axis=1) if pure.all() else None


@lru_cache(maxsize=8)
def _drum_modes(count: int) -> list[tuple[int, int]]:
    """Nodal diameters and circles (p, m) of an ideal membrane's lowest modes, some to spare."""
    highest = 2 * int(np.sqrt(count)) + 4
    zeros = [(z, p, m + 1) for p in range(highest) for m, z in enumerate(jn_zeros(p, highest))]
    enough = 2 * count + 10
    return [(p, m) for _, p, m in sorted(zeros)[:enough]]


@lru_cache(maxsize=8)
def _radial_parts(candidates: tuple[tuple[int, int], ...]) -> np.ndarray:
    """Normalised radial parts J_p(j_pm r) (K, points) on a grid from the centre to the edge."""
    grid = np.linspace(0, 1, RADIAL_GRID)
    radial = np.empty((len(candidates), RADIAL_GRID))
    for i, (p, m) in enumerate(candidates):
        zero = jn_zeros(p, m)[-1]
        radial[i] = jv(p, zero * grid) / abs(jv(p + 1, zero)) / (1 if p == 0 else np.sqrt(0.5))
    return radial


def _drum_content(modes: Deflections, candidates: list[tuple[int, int]]) -> np.ndarray:
    """Products (n, K) of the shapes with J_p(j_pm r) exp(i p theta), normalised membrane modes."""
    plate = modes.film
    centre, radius = extent(plate)
    radial = _radial_parts(tuple(candidates))
    orders = np.array([p for p, _ in candidates])
    total = np.zeros((modes.shapes.shape[1], len(candidates)), dtype=complex)
    for field in quadrature.fields(plate, columns=4 * len(candidates)):
        z = (((field.points - centre) / radius) @ np.array([1, 1j])).ravel()
        nearest = np.rint(np.minimum(np.abs(z), 1.0) * (RADIAL_GRID - 1)).astype(int)
        turns = (z / np.maximum(np.abs(z), 1e-300)) ** np.arange(orders.max() + 1)[:, None]
        weighted = (field.weights[..., None] * field.value(modes.shapes)).reshape(len(z), -1)
        harmonics = np.take(radial, nearest, axis=1) * turns[orders]
        total += (harmonics @ weighted).T
    total = plate.domain.comm.allreduce(total)
    for i, parity in enumerate(modes.parities):
        total[i] = _allowed(total[i], orders, modes, parity)
    return total


def _allowed(
    content: np.ndarray, orders: np.ndarray, modes: Deflections, parity: Parity
) -> np.ndarray:
    """Content (K,) without the harmonics that vanish over the whole film by parity.

    cos(p theta) is even in y, sin(p theta) odd; in x, p decides.
    """
    mirrors = modes.film.mirrors
    in_x, in_y = (mirrors.parity_in(axis, parity) for axis in "xy")
    cosine, sine = content.real, content.imag
    if in_y is not None:
        cosine, sine = (cosine, 0 * sine) if in_y == 0 else (0 * cosine, sine)
    if in_x is not None:
        cosine = np.where(orders % 2 == in_x, cosine, 0.0)
        sine = np.where(orders % 2 != in_x, sine, 0.0)
    return cosine + 1j * sine


def name_rectangle(
    modes: AnyModes,
    free: Sequence[tuple[bool, bool]] = ((False, False), (False, False)),
    equal: float = DEGENERATE,
    ranked: float = RANKED,
) -> tuple[AnyModes, list[str]]:
    """Orient equal frequencies and name the modes ``(m,n)`` by half-waves along x and y.

    ``free``: whether the lower and the upper end along x and y are.  Between supported ends
    half-waves are sines; between free ones cosines, counted from 0; from a held end to a free one
    there is a quarter wave more than half-waves.  ``equal``: relative difference of squared
    frequencies that are told as one; ``ranked``: that below which names rank.  Collective.
    """
    near = clusters(modes.eigenvalues)  # rounding mixes what differs by less
    modes = orient(modes, [part for group in near for part in _by_parity(modes, group)])
    spectra = _wave_content(modes, free)
    known = list(np.ndindex(spectra.shape[1:]))
    scores = np.abs(spectra).reshape(len(spectra), -1)
    keys: list[tuple] = []
    for spectrum in spectra:
        first, second = np.argsort(np.abs(spectrum).ravel())[::-1][:2]
        m, n = known[first]
        label = f"({m},{n})"
        if np.abs(spectrum.flat[second]) > MIXED * np.abs(spectrum.flat[first]):
            same = spectrum.flat[first] * spectrum.flat[second] > 0
            (m, n), other = sorted([(m, n), known[second]])
            label = f"({m},{n}){'+' if same else '-'}({other[0]},{other[1]})"
        keys.append((m, n, label))
    simple: list[tuple] = [(m, n, f"({m},{n})") for m, n in known]
    keys = _unique(keys, simple, scores)
    modes = _equalised(modes, clusters(modes.eigenvalues, equal))
    modes, keys = _sorted(modes, clusters(modes.eigenvalues, ranked), keys)
    return modes, [label for _, _, label in keys]


def _wave_content(modes: Deflections, free: Sequence[tuple[bool, bool]]) -> np.ndarray:
    """Coefficients (n, M, M) of the shapes in products of waves that suit the ends."""
    plate = modes.film
    low, high = bounding_box(plate)
    count = modes.shapes.shape[1] + 2
    numbers = np.arange(count)
    total = np.zeros((modes.shapes.shape[1], count, count))
    for field in quadrature.fields(plate, columns=4 * count):
        value = field.weights[..., None] * field.value(modes.shapes)
        waves = []
        for axis, (lower, upper) in enumerate(free):
            s = (field.points[..., axis] - low[axis]) / (high[axis] - low[axis])
            if lower != upper:
                s = 1 - s if lower else s
                waves.append(np.where(numbers, np.sin(np.pi * s[..., None] * (numbers - 0.5)), 0))
            else:
                phase = np.pi * s[..., None] * numbers
                waves.append(np.cos(phase) if lower else np.sin(phase))
        total += np.einsum("cqi,cqm,cqn->imn", value, *waves, optimize=True)
    total = plate.domain.comm.allreduce(total)
    for place, (name, (lower, _)) in enumerate(zip(AXES, free)):
        for i, parity in enumerate(modes.parities):
            odd = plate.mirrors.parity_in(name, parity)
            if odd is not None:  # sin(m pi s) is even about the middle for odd m, cos for even
                vanishing = numbers[numbers % 2 != (odd if lower else 1 - odd)]
                np.moveaxis(total[i], place, 0)[vanishing] = 0.0
    return total


def _by_parity(modes: Deflections, group: np.ndarray) -> list[np.ndarray]:
    """Split a group of modes into those of one parity each."""
    parities = sorted({modes.parities[i] for i in group})
    return [np.array([i for i in group if modes.parities[i] == p]) for p in parities]


def _sorted(
    modes: AnyModes, groups: list[np.ndarray], keys: list[tuple]
) -> tuple[AnyModes, list[tuple]]:
    """Sort the modes of each group by their keys."""
    order = np.arange(len(keys))
    for group in groups:
        order[group] = sorted(group, key=lambda i: keys[i])
    return modes.take(order), [keys[i] for i in order]


def _equalised(modes: AnyModes, groups: list[np.ndarray]) -> AnyModes:
    """Tell the frequencies of each group as one; by how much that shifts them is kept."""
    eigenvalues = modes.eigenvalues.copy()
    for group in groups:
        eigenvalues[group] = modes.eigenvalues[group].mean()
    shift = 0.5 * np.abs(modes.eigenvalues / eigenvalues - 1)
    return attrs.evolve(modes, eigenvalues=eigenvalues, shift=shift)


def name_by_number(modes: AnyModes, unsure: float = DEGENERATE) -> tuple[AnyModes, list[str]]:
    """Orient equal frequencies and name modes of any other shape by their number. Collective.

    Modes that differ by less than is sure are equal where a turn of the film mixes them.
    """
    near = clusters(modes.eigenvalues, unsure)
    modes = _equalised(modes, turning.pairs(modes, near))
    modes = orient(modes, clusters(modes.eigenvalues))
    return modes, [f"mode {i + 1}" for i in range(len(modes.eigenvalues))]
