"""Mode shapes made unique: oriented by the symmetry axes, scaled to max|phi| = 1, signed, named.

An eigensolver returns a degenerate pair in any rotation and any mode with any sign and scale.
Tensors can be compared between two runs, two meshes and two rank counts only after these rules:

* within a cluster of equal frequencies, shapes are those that a slightly larger tension along x
  would select, and where it selects none, those even or odd about the x axis;
* max|phi| = 1 for the true maximum, not the largest node;
* phi > 0 where |phi| is largest; of several such points, the one of smallest angle from +x.
"""

from __future__ import annotations

import attrs
import numpy as np
from mpi4py import MPI

from nanorom.fem.fields import quadrature
from nanorom.fem.fields.places import bounding_box, extent, lattice
from nanorom.fem.fields.surface import Surface
from nanorom.fem.modes import accuracy, edges, peaks
from nanorom.fem.modes.accuracy import ModeErrors
from nanorom.fem.modes.deflections import AnyModes
from nanorom.fem.modes.eigen import Modes, clusters
from nanorom.fem.solvers import compat

EQUAL = 1e-11  # eigenvalues closer than this (relative) differ in rounding alone
SPLIT = 1e-3  # of the anisotropy (between -1 and 1), below which it does not decide
TIE = 1e-3  # extrema closer than this (relative) are equal, and the angle decides
SAME = 1e-6  # extrema closer than this (relative) to the largest may be larger
ANGLE_TIE = 0.02  # radians below the +x axis that still count as on it
ONE_PEAK = 0.01  # of half the film's longer side: extrema closer than this are one
CENTRE = 1e-3  # of the film's half width: points nearer to its centre have no angle
NEWTON_STEPS = 8
SETTLED = 1e-12  # of a cell: shorter steps change no value
FLAT = 1e-6  # smallest curvature, relative, along which a Newton step is taken


def orient(modes: AnyModes, groups: list[np.ndarray]) -> AnyModes:
    """Rotate every group of like modes to the symmetry axes, the lower first. Collective.

    The modes of a group have one parity: where mirrors cut the film, they orient its pairs.
    """
    shapes, eigenvalues = modes.shapes.copy(), modes.eigenvalues.copy()
    for group in groups:
        if len(group) > 1:
            rotation = _rotation(modes.film, shapes[:, group])
            rotated = rotation.T**2 @ eigenvalues[group]
            order = np.argsort(rotated)
            for equal in clusters(rotated[order], EQUAL):
                # a difference in rounding must not order them: the rotation does
                order[equal] = np.sort(order[equal])
                rotated[order[equal]] = rotated[order[equal]].mean()
            eigenvalues[group] = rotated[order]
            shapes[:, group] = (shapes[:, group] @ rotation)[:, order]
    return attrs.evolve(modes, shapes=shapes, eigenvalues=eigenvalues)


def _rotation(plate: Surface, shapes: np.ndarray) -> np.ndarray:
    """Orthogonal matrix that makes the orienting forms diagonal, one after the other.

    The first is the split that a difference of tension along x and y would make; the second, with
    every angular harmonic 2p even about both axes, separates cos(p theta) from sin(p theta).
    """
    gradient, anisotropy, harmonic = _orienting_forms(plate, shapes)
    values, vectors = np.linalg.eigh(anisotropy * len(gradient) / np.trace(gradient))
    for group in np.split(np.arange(len(values)), np.flatnonzero(np.diff(values) > SPLIT) + 1):
        basis = vectors[:, group]
        vectors[:, group] = basis @ np.linalg.eigh(basis.T @ harmonic @ basis)[1]
    return vectors


def _orienting_forms(plate: Surface, shapes: np.ndarray) -> np.ndarray:
    """int |grad phi|^2, int phi_x^2 - phi_y^2 and int g phi^2 as matrices (3, n, n)."""
    centre, radius = extent(plate)
    forms = np.zeros((3, shapes.shape[1], shapes.shape[1]))
    for field in quadrature.fields(plate, columns=2 * shapes.shape[1]):
        slopes = field.gradient(shapes)
        z2 = (((field.points - centre) / radius) @ np.array([1, 1j])) ** 2
        g = np.real(z2 / (1 - 0.9 * z2))  # sum of 0.9^(p - 1) r^2p cos(2 p theta)
        value = field.value(shapes)
        x, y = (_gram(field.weights, slopes[:, :, d]) for d in (0, 1))
        forms += [x + y, x - y, _gram(field.weights * g, value)]
    return plate.domain.comm.allreduce(forms)


def _gram(weights: np.ndarray, values: np.ndarray) -> np.ndarray:
    """sum_q weight value value^T of values (c, q, n)."""
    return np.einsum("cq,cqi,cqj->ij", weights, values, values, optimize=True)


# -- scale and sign -------------------------------------------------------------------------------


def normalise(modes: AnyModes) -> AnyModes:
    """Scale every shape to a true maximum of +1 at the point that decides its sign. Collective."""
    extrema = _Extrema.of(modes.film, modes.shapes)
    return attrs.evolve(modes, shapes=modes.shapes / extrema.largest())


def normalise_film(
    modes: Modes, index: np.ndarray, stiffening: float = 0.0
) -> tuple[Modes, ModeErrors]:
    """The same of some of a plate's modes, peaks as accurate as averages where that can be done.

    Also estimates the errors of the modes, that of their scale among them; ``stiffening`` is as
    for `accuracy.of_modes`.  Collective.
    """
    plate = modes.plate
    errors = accuracy.of_modes(modes, stiffening).take(index)
    modes = modes.take(index)
    extrema = _Extrema.of(plate, modes.shapes)
    values = extrema.largest()
    scale = errors.scale
    if peaks.is_homogeneous(plate):
        mode, places = extrema.peaks(np.minimum(scale + SAME, TIE))
        low, high = bounding_box(plate)
        area = float(np.prod(high - low))
        found, deviations = peaks.fitted(modes, mode, places, edges.room(plate, places), area)
        for i, value in enumerate(values):
            own = np.flatnonzero(mode == i)
            highest = own[np.argmax(np.nan_to_num(np.abs(found[own])))]
            deviation = deviations[highest] / np.abs(value)
            if deviation < scale[i]:
                values[i], scale[i] = np.copysign(found[highest], value), deviation
    return attrs.evolve(modes, shapes=modes.shapes / values), attrs.evolve(errors, scale=scale)


def peak_places(modes: AnyModes) -> tuple[np.ndarray, np.ndarray]:
    """Modes (k,) and places (k, 2) of their largest |phi|, at least one of each. Collective."""
    ties = np.full(modes.shapes.shape[1], SAME)
    return _Extrema.of(modes.film, modes.shapes).peaks(ties)


@attrs.frozen(eq=False)
class _Extrema:
    """Local extrema near the largest |phi| of n modes, on every rank those of the whole mesh.

    mode: (m,) to which an extremum belongs; place: (m, 2); value: (m,); away: (m, 2) distance from
    the film's centre and angle from +x; unit: half the film's longer side.
    """

    mode: np.ndarray
    place: np.ndarray
    value: np.ndarray
    away: np.ndarray
    unit: float

    @classmethod
    def of(cls, plate: Surface, shapes: np.ndarray) -> _Extrema:
        gathered = plate.domain.comm.allgather(_extrema(plate, shapes))
        mode, place, value = (np.concatenate(parts) for parts in zip(*gathered))
        centre, radius = extent(plate)
        x, y = (place - centre).T
        angle = np.mod(np.arctan2(y, x) + ANGLE_TIE, 2 * np.pi)
        distance = np.hypot(x, y)
        angle[distance < CENTRE * radius] = 0.0
        return cls(mode, place, value, np.column_stack([distance, angle]), radius)

    def largest(self) -> np.ndarray:
        """Largest |phi| (n,), with the sign that phi has at the one of smallest angle from +x."""
        values = np.empty(self.mode.max() + 1)
        for i in range(len(values)):
            tied, size = self._tied(i, TIE)
            distance, angle = self.away[tied].T
            # on one ray from the centre, the nearest
            first = tied[np.lexsort((distance, np.rint(angle / ANGLE_TIE)))[0]]
            values[i] = size * np.sign(self.value[first])
        return values

    def peaks(self, ties: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Modes (k,) and places (k, 2) of what may be a mode's peak: within ties (n,) of it."""
        modes, places = [], []
        for i, tie in enumerate(ties):
            left, _ = self._tied(i, tie)
            left = left[np.argsort(-np.abs(self.value[left]), kind="stable")]
            while len(left):
                modes.append(i)
                places.append(self.place[left[0]])
                # cells beside that of the peak climb to their edge only: somewhat lower
                apart = np.linalg.norm(self.place[left] - places[-1], axis=1)
                left = left[apart > ONE_PEAK * self.unit]
        return np.array(modes), np.array(places)

    def _tied(self, i: int, tie: float) -> tuple[np.ndarray, float]:
        """Extrema of a mode that are its largest but for a relative difference; its |phi|."""
        size = np.where(self.mode == i, np.abs(self.value), 0.0)
        return np.flatnonzero(size > (1 - tie) * size.max()), float(size.max())


def _extrema(plate: Surface, shapes: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Local extrema near the largest |phi|: mode (m,), point (m, 2), value (m,)."""
    grid = lattice(2 * plate.degree)
    starts, sizes = [], []
    n_modes = shapes.shape[1]
    for _, value in quadrature.values_at(plate, grid, shapes):
        size = np.abs(value)
        starts.append(size.argmax(axis=1))
        sizes.append(size.max(axis=1))
    size = np.concatenate(sizes) if sizes else np.zeros((0, n_modes))
    start = np.concatenate(starts) if starts else np.zeros((0, n_modes), dtype=int)
    largest = size.max(axis=0, initial=0.0)
    plate.domain.comm.Allreduce(MPI.IN_PLACE, largest, op=MPI.MAX)
    cell, mode = np.nonzero(size > 0.95 * largest)
    if len(cell) == 0:  # the largest values are on other ranks
        return mode, np.empty((0, 2)), np.empty(0)
    local = shapes[compat.cell_dofs(plate.deflections)[cell], mode[:, None]]
    reference = _climb(plate.degree, local, grid[start[cell, mode]])
    basis = compat.reference_element(plate.degree).tabulate(0, reference)
    value = np.sum(np.asarray(basis).reshape(len(cell), -1) * local, axis=1)
    return mode, quadrature.map_points(plate, cell, reference)[0], value


def _climb(degree: int, local: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Reference points (m, 2) of the extrema of fields (m, n) in a cell each, near lattice points.

    Newton steps inside the cell, and along each of its edges: on a free edge of the film the
    extremum is bound to it.
    """
    best, highest = start.copy(), np.zeros(len(local))
    along_edges = [np.array(side, dtype=float)[None] for side in ((1, 0), (0, 1), (1, -1))]
    ends = np.array([(0.0, 0.0), (0.0, 0.0), (0.0, 1.0)])
    for directions, origin in [(np.eye(2), None), *zip(along_edges, ends)]:
        x = start
        if origin is not None:
            side = directions[0]
            share = np.clip((start - origin) @ side / (side @ side), 0.0, 1.0)
            x = origin + share[:, None] * side
        for _ in range(NEWTON_STEPS):
            size, step = _ascent(degree, local, x, directions)
            higher = size > highest
            best[higher], highest[higher] = x[higher], size[higher]
            last, x = x, _into_triangle(x + step)
            if np.abs(x - last).max() < SETTLED:
                break
    return best


def _ascent(
    degree: int, local: np.ndarray, x: np.ndarray, directions: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """|phi| (m,) at points (m, 2) of a cell each, and the Newton steps (m, 2) along directions.

    A step that leaves the triangle is for the caller to pull back: an extremum outside belongs to
    a neighbour, which climbs to it itself.
    """
    basis = np.asarray(compat.reference_element(degree).tabulate(2, x))
    basis = basis.reshape(6, len(local), -1)
    value, gx, gy, hxx, hxy, hyy = np.einsum("kmn,mn->km", basis, local)
    sign = np.sign(value)
    hessian = -sign[:, None, None] * np.stack([hxx, hxy, hxy, hyy], axis=1).reshape(-1, 2, 2)
    gradient = sign[:, None] * np.column_stack([gx, gy])
    curvature, axes = np.linalg.eigh(directions @ hessian @ directions.T)
    slope = np.einsum("mij,mi->mj", axes, gradient @ directions.T)
    # along an axis without curvature (a string's width) there is nothing to gain
    curved = curvature > FLAT * np.abs(curvature).max(axis=1, keepdims=True)
    along = np.where(curved, slope / np.where(curved, curvature, 1.0), 0.0)
    return np.abs(value), np.einsum("mij,mj->mi", axes, along) @ directions


def _into_triangle(x: np.ndarray) -> np.ndarray:
    """Nearest points of the reference triangle to points (m, 2)."""
    beyond = np.maximum(x.sum(axis=1) - 1, 0.0) / 2
    x = np.clip(x - beyond[:, None], 0.0, 1.0)
    return x / np.maximum(x.sum(axis=1), 1.0)[:, None]
