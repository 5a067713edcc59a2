"""How far a solution is from that of the stated model, read off its own spectral decay.

A Galerkin solution is the best approximation in energy, and a polynomial of degree p is all that a
cell can hold: the energy beyond degree p is, to a constant of order one, the error of degree p
(Babuska and Osborn 1991 for eigenvalues).  In every cell the fields are expanded in polynomials
that are orthonormal in the energy and sorted by degree, so that sums of squares tell the energy
beyond any degree below the one computed with, and extrapolation what is beyond that.  The constants
were set against the exact solutions of discs, squares and strings (``nanorom bench --accuracy``).
"""

from __future__ import annotations

from collections.abc import Iterator

import attrs
import numpy as np
from mpi4py import MPI

from nanorom.fem.fields import quadrature
from nanorom.fem.models.plate import Plate
from nanorom.fem.modes import decay
from nanorom.fem.modes.eigen import NEAR, Modes, clusters
from nanorom.fem.solvers import algebra, compat
from nanorom.scene import elasticity

ROUNDING = 0.1 * np.finfo(float).eps  # per root of sum K_ii phi_i^2 / lambda: measured
POINTWISE = 12.0  # from a shape's extrapolated tail in the cells at its peak to its error there
AT_PEAK = 0.9  # of the largest value: what a cell at the peak has somewhere
FREQUENCY = 3.0  # from the extrapolated energy of a shape to the error of its eigenvalue
AVERAGES = 6.0  # from that of a shape and of what weighs it to the error of integrals over it
IN_PLANE = 1.5  # from that of the in-plane displacement to its error
STRETCHED = 1.0  # from the same to the error of frequencies that it stiffens
RELAXED = 1.5  # from the bound on what an error of relaxed pre-stress does to its estimate
CHUNK = 256  # cells at a time
TENSOR = np.array([1.0, 1.0, np.sqrt(2.0)])  # from (xx, yy, 2 xy) to a basis of unit tensors


@attrs.frozen(eq=False)
class ModeErrors:
    """Estimated relative errors (n,) of modes: frequency, its part from rounding, averages, scale.

    average: of integrals over the shape; scale: of the value at its peak, to which it is scaled;
    mixing: the part of average that modes of nearly one frequency cause, which errors turn into
    each other.  strained: no error, but the part of the energy that is not of springs.
    """

    frequency: np.ndarray
    rounding: np.ndarray
    average: np.ndarray
    scale: np.ndarray
    mixing: np.ndarray
    strained: np.ndarray

    def take(self, index: np.ndarray) -> ModeErrors:
        """Those of some of the modes."""
        return ModeErrors(*(part[index] for part in attrs.astuple(self, recurse=False)))


@attrs.frozen(eq=False)
class _ShapeTails:
    """What shapes (n,) leave out: energies beyond the degree and beyond the last but one, whole.

    rounding: of the curvature at a point, relative; energy: eigenvalue times the square.
    """

    beyond: np.ndarray
    last: np.ndarray
    whole: np.ndarray
    rounding: np.ndarray
    energy: np.ndarray

    @classmethod
    def of(cls, modes: Modes, stiffening: float) -> _ShapeTails:
        plate, comm = modes.plate, modes.plate.domain.comm
        owned = modes.shapes[: modes.n_owned]
        square = comm.allreduce(np.sum(owned * algebra.multiply(modes.mass, owned), axis=0))
        diagonal = np.zeros(len(square))
        for parity in sorted(set(modes.parities)):
            own = [i for i, p in enumerate(modes.parities) if p == parity]
            diagonal[own] = np.abs(modes.stiffness.diagonal(parity)) @ owned[:, own] ** 2
        # under compression the energy is a difference, and all small beside its parts counts
        beyond, last, whole = comm.allreduce(_deflection_tails(plate, modes.shapes, stiffening))
        # of the curvature at a point, not of the matrix's entries, which are its squares
        rounding = ROUNDING * np.sqrt(comm.allreduce(diagonal) / whole)
        return cls(beyond, last, whole, rounding, modes.eigenvalues * square)

    @property
    def rounded(self) -> np.ndarray:
        """Relative errors (n,) of frequencies by rounding."""
        return self.rounding * self.whole / self.energy

    @property
    def frequency(self) -> np.ndarray:
        """Relative errors (n,) of frequencies."""
        return 0.5 * FREQUENCY * self.beyond / self.energy + self.rounded


def of_modes(modes: Modes, stiffening: float = 0.0) -> ModeErrors:
    """Estimate the errors of frequencies and shapes. Collective.

    stiffening : isotropic tension that acts beyond the plate's own, see `stiffening_of`.
    """
    tails = _ShapeTails.of(modes, stiffening)
    # what an integral weighs a shape with varies faster than the shape, as if of one degree less
    average = AVERAGES * np.sqrt(tails.beyond * tails.last) / tails.whole + tails.rounding
    scale = POINTWISE * _at_peaks(modes.plate, modes.shapes)
    frequency = tails.frequency
    mixing = _mixing(modes, frequency)
    if modes.shift is not None:
        frequency = frequency + modes.shift
    strained = tails.whole / tails.energy
    return ModeErrors(frequency, tails.rounded, average + mixing, scale, mixing, strained)


def unsure(modes: Modes, stiffening: float = 0.0) -> float:
    """Relative error of near squared frequencies' difference, 0 if none are near. Collective."""
    near = [group for group in clusters(modes.eigenvalues, NEAR) if len(group) > 1]
    if not near:
        return 0.0
    modes = modes.take(np.concatenate(near))
    frequency = _ShapeTails.of(modes, stiffening).frequency
    return 4 * float((frequency if modes.shift is None else frequency + modes.shift).max())


def _mixing(modes: Modes, frequency: np.ndarray) -> np.ndarray:
    """By how much (n,) errors (n,) of frequencies turn near modes of one parity into each other.

    To first order by the error's product in energy, at most the mean of both, over the difference;
    equal ones are oriented by rules.
    """
    values = modes.eigenvalues
    apart = np.abs(values[:, None] / values - 1)
    same = np.array([[a == b for b in modes.parities] for a in modes.parities])
    near = same & (apart > 0) & (apart < NEAR)
    error = 2 * np.sqrt(np.outer(frequency, frequency))
    angle = np.divide(error, apart, out=np.zeros_like(error), where=near)
    return np.asarray(np.minimum(angle, 1.0).max(axis=1, initial=0.0))


def stiffening_of(plate: Plate, tension: float | None) -> float:
    """Tension beyond the plate's own that bounds the stiffness about a state of a mean tension.

    Where load made that tension by a deflection w, a mode also stretches the film along grad w,
    by no more than twice of it.
    """
    own = 0.5 * sum(plate.state.tension)
    return 0.0 if tension is None else 3 * max(tension - own, 0.0)


def of_state(plate: Plate, deflection: np.ndarray, stiffening: float, in_plane: float) -> float:
    """Estimated error, relative, that a static deflection (local dofs,) brings to frequencies.

    Both are smooth functionals of the solution, so they err as its energy does, that of the
    in-plane displacement included (see `of_tensor`).  Collective.
    """
    tails = _deflection_tails(plate, deflection[:, None], stiffening)
    beyond, _, total = plate.domain.comm.allreduce(tails)[:, 0]
    return float(FREQUENCY * beyond / total + STRETCHED * in_plane) if total > 0 else 0.0


def of_softening(
    modes: Modes, deflection: np.ndarray, stiffening: float, in_plane: float, quadratic: np.ndarray
) -> np.ndarray:
    """Estimated error (n,), relative, of frequencies by that of a static deflection in the modes.

    deflection: (local dofs,); quadratic: (n, n, n) force of the modes, in the plate's units and
    those of the deflection.  An error e of the deflection moves mode j by its product in energy
    with what the discrete mode leaves out (Galerkin's orthogonality), over the mode's stiffness;
    where that is small, as before a film is pulled in, so does the stiffness of all modes change.
    Collective.
    """
    plate, comm = modes.plate, modes.plate.domain.comm
    columns = np.column_stack([deflection, modes.shapes])
    beyond, _, whole = comm.allreduce(_deflection_tails(plate, columns, stiffening))
    owned = modes.shapes[: modes.n_owned]
    square = comm.allreduce(np.sum(owned * algebra.multiply(modes.mass, owned), axis=0))
    stiffness = modes.eigenvalues * square
    product = FREQUENCY * np.sqrt(beyond[0] * beyond[1:])
    product += STRETCHED * in_plane * np.sqrt(whole[0] * whole[1:])
    moved = product / stiffness
    change = np.abs(np.einsum("iij->ij", quadratic)) @ moved / plate.mirrors.copies
    return np.asarray(change / stiffness)


def of_relaxation(modes: Modes, displacement: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Estimated error (n,), relative, of frequencies under a pre-stress that relaxed. Collective.

    displacement: (local dofs,) of the relaxation; pairs: errors of the energy of the displacements
    that modes cause, see `InPlane.energies`.  An error e of the displacement changes phi.K phi
    by the work of the stress of e on the slopes of phi, which is the product in energy of e and of
    what that displacement leaves out that the slopes of phi cause (Galerkin's orthogonality).
    """
    plate = modes.plate
    unit = plate.stiffness.stretching
    own = float(in_plane_errors(plate, displacement[:, None])[0]) / unit
    stiffness = np.diag(modes.modal_stiffness()) / plate.mirrors.copies
    if len(pairs) != len(stiffness):
        pairs = pairs.max(keepdims=True)
    return np.asarray(0.5 * RELAXED * np.sqrt(own * pairs) / stiffness)


def of_tensor(cubic: np.ndarray, modes: ModeErrors, in_plane: float) -> float:
    """Estimated error of a cubic tensor relative to its largest entry.

    in_plane : estimated error of the condensed in-plane energy, relative to its largest entry.
    """
    own = np.abs(np.einsum("iiii->i", cubic))
    scale = 4 * np.max(modes.scale * own) / np.abs(cubic).max()
    shape = np.max(modes.average)
    return float(scale + shape + IN_PLANE * in_plane)


def in_plane_errors(plate: Plate, displacements: np.ndarray) -> np.ndarray:
    """Membrane energy (m,) that in-plane displacements (local dofs, m) leave out. Collective."""
    dofs = compat.cell_dofs(plate.in_plane)[: quadrature.owned_cells(plate)]
    # no strain has more energy than this by the square of its displacement's gradient
    law = plate.law_in(np.arange(len(dofs))) * np.outer(TENSOR, TENSOR)
    stiffness = np.broadcast_to(np.linalg.eigvalsh(law)[..., -1], len(dofs))
    tails = np.zeros((3, displacements.shape[1]))
    for cells, inverse, area in _cell_maps(plate):
        metric = (stiffness[cells] * area)[:, None, None] * (inverse @ np.swapaxes(inverse, 1, 2))
        factor = decay.orthonormal(plate.degree, metric)
        for component in (0, 1):
            tails += decay.tails(plate.degree, factor, displacements[2 * dofs[cells] + component])
    return np.asarray(plate.domain.comm.allreduce(tails)[0])


def _deflection_tails(plate: Plate, deflections: np.ndarray, stiffening: float) -> np.ndarray:
    """Energies (3, n) of tension and bending in this rank's cells, see `decay.tails`."""
    dofs = compat.cell_dofs(plate.deflections)[: quadrature.owned_cells(plate)]
    values, axes = np.linalg.eigh(plate.state.tensor)
    tension = (axes * (np.abs(values) + stiffening)) @ axes.T
    bending = plate.stiffness.bending if plate.bending else 0.0
    stiffest = np.full(len(dofs), bending * elasticity.stiffest(plate.stiffness.bending_law))
    if plate.patchwork is not None:
        stiffest = bending * plate.patchwork.stiffest[plate.patchwork.which[: len(dofs)]]
    tails = np.zeros((3, deflections.shape[1]))
    for cells, inverse, area in _cell_maps(plate):
        slopes = np.einsum("c,de,cad,cbe->cab", area, tension, inverse, inverse)
        curvatures = None
        if bending:
            # grad grad of the reference cell's xx, xy and yy, the curvature of the map left out
            turned = np.einsum("cad,cbe->cdeab", inverse, inverse)
            xx, xy, yx, yy = np.moveaxis(turned.reshape(len(cells), 4, 4), 2, 0)
            turned = np.stack([xx, xy + yx, yy], axis=2)
            curvatures = np.einsum("c,cka,ckb->cab", stiffest[cells] * area, turned, turned)
        factor = decay.orthonormal(plate.degree, slopes, curvatures)
        tails += decay.tails(plate.degree, factor, deflections[dofs[cells]])
    return tails


def _cell_maps(plate: Plate) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Chunks of owned cells: numbers (c,), inverse Jacobians (c, 2, 2) and scale of the area."""
    middle = np.full((1, 2), 1 / 3)
    n_cells = quadrature.owned_cells(plate)
    for first in range(0, n_cells, CHUNK):
        cells = np.arange(first, min(first + CHUNK, n_cells))
        jacobian = quadrature.map_cells(plate, cells, middle)[1][:, 0]
        yield cells, np.linalg.inv(jacobian), np.abs(np.linalg.det(jacobian))


def _at_peaks(plate: Plate, shapes: np.ndarray) -> np.ndarray:
    """What shapes (local dofs, n) leave out in the cells at their peaks: rms, relative (n,).

    Errors of cells go on in those beside them: what is longer than the peak is away counts too.
    """
    dofs = compat.cell_dofs(plate.deflections)[: quadrature.owned_cells(plate)]
    coefficients = decay.Polynomials.of(plate.degree).coefficients
    heights, tails = [np.empty((0, shapes.shape[1]))], [np.empty((3, 0, shapes.shape[1]))]
    for first in range(0, len(dofs), CHUNK):
        local = shapes[dofs[first : first + CHUNK]]
        heights.append(np.abs(local).max(axis=1))
        squares = np.matmul(coefficients, local) ** 2
        # the reference triangle's area is a half
        parts = [2 * squares[:, i:].sum(axis=1) for i in decay.beyond(plate.degree)]
        tails.append(np.array(parts))
    height, squares = np.concatenate(heights), np.concatenate(tails, axis=1)
    middles, spans = _middles(plate)
    highest, places = _highest(plate.domain.comm, height, middles)
    away = np.linalg.norm(middles[:, None] - places, axis=2)
    near = (height > AT_PEAK * highest) | (away <= spans[:, None])
    at_peak = np.where(near, squares, 0.0).max(axis=1, initial=0.0)
    plate.domain.comm.Allreduce(MPI.IN_PLACE, at_peak, op=MPI.MAX)
    return np.asarray(np.sqrt(decay.extrapolated(at_peak)) / highest)


def _middles(plate: Plate) -> tuple[np.ndarray, np.ndarray]:
    """Middles (c, 2) and longest sides (c,) of this rank's cells."""
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    x = quadrature.map_cells(plate, np.arange(quadrature.owned_cells(plate)), corners)[0]
    return x.mean(axis=1), np.linalg.norm(x - np.roll(x, 1, axis=1), axis=2).max(axis=1)


def _highest(
    comm: MPI.Intracomm, height: np.ndarray, middles: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Largest of the cells' values (c, n), and the middles (n, 2) of the cells that have it."""
    cells = height.argmax(axis=0) if len(height) else []
    own = height.max(axis=0, initial=-1.0), middles[cells]
    highest, places = zip(*(part for part in comm.allgather(own) if len(part[1])))
    rank, modes = np.argmax(highest, axis=0), np.arange(height.shape[1])
    return np.array(highest)[rank, modes], np.array(places)[rank, modes]
