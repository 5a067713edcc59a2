"""The value of a mode at its peak, more accurate than the finite-element function's own.

At a point a finite-element function of degree k is right to order k + 1, its smooth averages to
order 2 k: what remains of a tensor's error is that of the peaks by which shapes are scaled.  In a
flat film of constant tension every mode solves

    D lap lap phi - T_x phi_xx - T_y phi_yy = lambda phi,      x, y along the axes of the tension,

of which plane and evanescent waves exp(i k d.x) are exact solutions for every direction d,
with D k^4 + T(d) k^2 = lambda and T(d) = T_x d_x^2 + T_y d_y^2.  So are the products of sines and
cosines in x and y that they make with their mirror images.  Waves fitted to the mode by
weighted least squares on a disc about the peak average the error away, and their value is the
peak's (an extraction in the sense of Babuska and Miller 1984, doi:10.1002/nme.1620200610; plane
waves as local solutions: Trefftz 1926).  Three discs tell how far it is settled, and give an
estimate of the error.
"""

from __future__ import annotations

from collections.abc import Iterable

import attrs
import basix
import numpy as np
from scipy.linalg import lstsq

from nanorom.fem.fields import quadrature
from nanorom.fem.models.plate import Plate
from nanorom.fem.modes.edges import Room
from nanorom.fem.modes.eigen import Modes
from nanorom.fem.solvers import compat
from nanorom.fem.symmetry import AXES

DIRECTIONS = 7  # of the waves, over a quarter turn
REACH = 3.5  # largest wavenumber x radius that so many directions represent to 1e-9
SHARES = (1.0, 0.75, 0.56)  # of the radius: the discs on which a value is fitted
BY_CHANCE = 0.2  # rate of settling below which two values may be alike by chance
STEEPEST = 24.0  # largest decay rate x radius at which evanescent waves are fitted
MILD = 8.0  # the same of discs that reach beyond the edge
CLEAR = 12.0  # decay lengths off the edge beyond which they need not be
SMOOTHNESS = 3  # exponent of the weight (1 - r^2/radius^2)
LONGEST = 2.0  # reach of a wave, by the shortest one's, with which it still is fitted
CUTOFF = 1e-13  # of singular values
ROUNDING = 1e-9  # of a radius
ON_MIRROR = 1e-4  # of a radius: a peak nearer to a mirror lies on it, to its fourth power
SAMPLES = 10_000  # on a disc: errors are averaged away long before
WAVE_DEGREE = 6  # of the polynomial that is as good as a wave within a cell


def is_homogeneous(plate: Plate) -> bool:
    """Whether the film obeys the one equation everywhere: flat, with a constant tension."""
    return plate.uniform


def fitted(
    modes: Modes, owners: np.ndarray, centres: np.ndarray, room: Room, area: float
) -> tuple[np.ndarray, np.ndarray]:
    """Values (n,) of shapes at points (n, 2), and their estimated errors. Collective.

    owners: (n,) the mode whose value is taken at a point; room: about the points; area: of the
    rectangle about the film.  Not a number where there is no room.
    """
    waves = [_Waves.of(modes, *place) for place in zip(owners, centres, room.inside, room.widest)]
    radii = np.array([wave.radius for wave in waves])
    rule = _rule(modes.plate)
    cells = _sampled(modes.plate, len(rule[1]), float(np.pi * radii.min() ** 2 / area))
    fields = quadrature.fields_at(modes.plate, *rule, 4 * len(modes.parities), cells)
    return _settled(_values(modes, fields, owners, waves, SHARES))


def _settled(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Value (n,) on the largest of three discs that shrink by one factor, (3, n), and its error.

    A larger disc averages more of the error away: values settle, at a rate that three tell.
    """
    largest, middle, smallest = values
    change, before = np.abs(largest - middle), np.abs(middle - smallest)
    rate = np.divide(change, before, out=np.ones_like(change), where=before > change)
    return largest, change * np.maximum(rate, BY_CHANCE)


@attrs.frozen(eq=False)
class _Waves:
    """Waves about a mode's peak, and the disc on which they are fitted.

    axes: (2, 2) columns are those of the tension, x and y but for a sheared one; straight,
    evanescent: wavenumbers and decay rates (2, m) along them; even: along them, whether the peak
    lies on a mirror, so that the mode is even about it.
    """

    centre: np.ndarray
    radius: float
    axes: np.ndarray
    straight: np.ndarray
    evanescent: np.ndarray
    even: np.ndarray

    @classmethod
    def of(cls, modes: Modes, i: int, centre: np.ndarray, inside: float, widest: float) -> _Waves:
        """Of mode i at a point (2,) in a distance from the film's edge, no wider than told."""
        plate, eigenvalue = modes.plate, modes.eigenvalues[i]
        angle = np.pi / 2 * (np.arange(DIRECTIONS) + 0.5) / DIRECTIONS
        direction = np.array([np.cos(angle), np.sin(angle)])
        principal, axes = plate.state.tensor.diagonal(), np.eye(2)
        if plate.state.shear:
            principal, axes = np.linalg.eigh(plate.state.tensor)
        tension = principal @ direction**2
        bending = plate.stiffness.bending if plate.bending else 0.0
        root = np.sqrt(tension**2 + 4 * bending * eigenvalue)
        with np.errstate(divide="ignore"):
            waves = np.sqrt(2 * eigenvalue / (tension + root))
            decays = np.sqrt((tension + root) / np.array(2 * bending))
        radius = REACH / waves.min()
        if decays.max() * radius > STEEPEST:
            # clear of the edge and of the layer in which the film bends there, or so small that
            # the evanescent waves are those of the layer
            clear = inside - CLEAR / decays.min()
            within = min(STEEPEST / decays.max(), max(inside, MILD / decays.max()))
            radius = min(radius, max(clear, within))
        radius = float(max(min(radius, widest), np.finfo(float).tiny))
        straight = waves * radius < LONGEST * REACH  # no waves much shorter than the others
        mild = decays * radius < (1 + ROUNDING) * STEEPEST
        parities = [plate.mirrors.parity_in(axis, modes.parities[i]) for axis in AXES]
        even = np.array([p == 0 for p in parities]) & (np.abs(centre) < ON_MIRROR * radius)
        return cls(
            np.where(even, 0.0, centre),
            radius,
            axes,
            (direction * waves)[:, straight],
            (direction * np.where(mild, decays, 0.0))[:, mild],
            even,
        )

    def on_disc(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Which points (n, 2) are on the disc, on one side of mirrors; (r/radius)^2 of them all."""
        away = points - self.centre
        square, size = np.einsum("nd,nd->n", away, away), self.radius**2
        # without room, as at a free edge, the square of the radius may be nothing
        ratio = np.divide(square, size, out=np.full(len(square), np.inf), where=square < size)
        return (ratio < 1) & (points[:, self.even] > 0).all(axis=1), ratio

    def at(self, points: np.ndarray) -> np.ndarray:
        """Values (n, w) at points (n, 2), at most about 1 in size on the disc."""
        away = (points - self.centre) @ self.axes
        largest = np.cosh(self.radius * np.hypot(*self.evanescent))
        return np.hstack(
            [
                *self._products(away, self.straight, np.cos, np.sin),
                *(p / largest for p in self._products(away, self.evanescent, np.cosh, np.sinh)),
            ]
        )

    def _products(
        self, away: np.ndarray, numbers: np.ndarray, even: np.ufunc, odd: np.ufunc
    ) -> list[np.ndarray]:
        """Products of functions of x and of y (n, m) that may be part of the mode."""
        phase = away.T[:, :, None] * numbers[:, None]
        x, y = (
            [even(part)] if mirror else [even(part), odd(part)]
            for part, mirror in zip(phase, self.even)
        )
        return [a * b for a in x for b in y]


def _values(
    modes: Modes,
    fields: Iterable[quadrature.CellFields],
    owners: np.ndarray,
    waves: list[_Waves],
    shares: tuple[float, ...],
) -> np.ndarray:
    """Values (s, n) at the centres of waves fitted to the shapes on discs.

    Discs have shares (s,) of the radii.  Not a number where one holds too few points.  The
    triangular factors of every chunk of cells and of every rank are stacked: no normal equations.
    Collective.
    """
    plate, n_modes = modes.plate, modes.shapes.shape[1]
    factors: dict[tuple[int, int], np.ndarray] = {}
    samples = np.zeros((len(shares), len(owners)))
    for field in fields:
        values = field.value(modes.shapes).reshape(-1, n_modes).T
        points, values = plate.mirrors.unfold(field.points.reshape(-1, 2), values, modes.parities)
        weights = np.tile(field.weights.ravel(), plate.mirrors.copies)
        for n, (i, wave) in enumerate(zip(owners, waves)):
            near, ratio = wave.on_disc(points)
            columns = np.column_stack([wave.at(points[near]), values[i, near]])
            for disc, share in enumerate(shares):
                weight = weights[near] * np.maximum(1 - ratio[near] / share**2, 0.0) ** SMOOTHNESS
                inner = weight > 0
                samples[disc, n] += inner.sum()
                rows = np.sqrt(weight[inner])[:, None] * columns[inner]
                if (disc, n) in factors:
                    rows = np.vstack([factors[disc, n], rows])
                factors[disc, n] = np.asarray(np.linalg.qr(rows, mode="r"))
    comm = plate.domain.comm
    samples = comm.allreduce(samples)
    gathered = comm.allgather(factors)
    found = np.full((len(shares), len(owners)), np.nan)
    for disc, n in np.ndindex(found.shape):
        parts = [own[disc, n] for own in gathered if (disc, n) in own]
        if not parts:
            continue
        stacked = np.concatenate(parts)
        weighted, shape = stacked[:, :-1], stacked[:, -1]
        if samples[disc, n] > 2 * weighted.shape[1]:
            amplitudes = lstsq(weighted, shape, CUTOFF, check_finite=False, lapack_driver="gelsy")
            found[disc, n] = (waves[n].at(waves[n].centre[None]) @ amplitudes[0])[0]
    return found


def _sampled(plate: Plate, n_points: int, share: float) -> np.ndarray:
    """Owned cells that give a disc of a share of the film points enough, whatever the partition."""
    surface = plate.domain.mesh
    total = surface.topology.index_map(2).size_global * plate.mirrors.copies * n_points
    numbers = compat.input_cells(surface)[: quadrature.owned_cells(plate)]
    return np.flatnonzero(numbers % max(1, int(total * share / SAMPLES)) == 0)


def _rule(plate: Plate) -> tuple[np.ndarray, np.ndarray]:
    """Points and weights in a cell for products of shapes with waves."""
    rule = basix.make_quadrature(basix.CellType.triangle, plate.degree + WAVE_DEGREE)
    return np.asarray(rule[0]), np.asarray(rule[1])
