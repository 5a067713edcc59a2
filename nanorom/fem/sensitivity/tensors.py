"""Derivatives of the cubic tensor of a flat film by its shapes and by Poisson's ratio.

The tensor is one form of four shapes, B(phi_r, phi_j, phi_k, phi_l), a third of the sum over the
three ways to pair them of 1/2 <E_rj, E_kl>.  E_kl is in equilibrium, so that the displacement of a
changed pair does no work: with the membrane force N_kl of the pairs that the tensor needs anyway

    d<E_rj, E_kl> = int N_kl:(grad phi_r' (x) grad phi_j),

and no other in-plane problem is solved.  Poisson's ratio changes the energy at constant forces.
"""

from __future__ import annotations

import numpy as np

from nanorom.fem.fields import quadrature
from nanorom.fem.modes.eigen import Modes
from nanorom.fem.symmetry import product_parity
from nanorom.fem.tensors import direct
from nanorom.rom import tensors


def slopes(
    modes: Modes, changes: dict[str, np.ndarray], in_plane: str
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Derivatives (L, L, L, L) of B by the shapes, by parameter, and by nu. Collective.

    changes : derivatives of the shapes (local dofs, L), by parameter; in_plane : as for
    `direct.cubic_tensor`.
    """
    plate, n, copies = modes.plate, len(modes.parities), modes.plate.mirrors.copies
    moving = np.concatenate([*changes.values()], axis=1)
    work = np.zeros((len(changes) * n, n, n, n))  # int N_kl:(grad phi_r' (x) grad phi_j)
    by_nu = np.zeros((n,) * 4)
    members = {
        parity: np.array([i for i, own in enumerate(modes.parities) if own == parity])
        for parity in sorted(set(modes.parities))
    }

    def told(
        field: quadrature.CellFields, slope: np.ndarray, pairs: np.ndarray, force: np.ndarray
    ) -> None:
        change = np.moveaxis(field.gradient(moving), 2, 0)
        parity = product_parity(*(modes.parities[i] for i in pairs[0]))
        first, second = pairs.T
        xx, yy, xy = force[..., None]
        for own in members.values():
            partner = members.get(product_parity(modes.parities[own[0]], parity))
            if partner is None:
                continue
            x, y = (part[..., None, partner] for part in slope)
            columns = np.concatenate([own + n * p for p in range(len(changes))])
            found = _gram(change[0][..., columns], _flat(xx * x + xy * y))
            found += _gram(change[1][..., columns], _flat(xy * x + yy * y))
            found = found.reshape(len(columns), len(pairs), len(partner))
            for k, l in ((first, second), (second, first)):
                work[columns[:, None, None], partner, k[:, None], l[:, None]] += np.where(
                    (k == l)[:, None], 0.5 * found, found
                )
        plain = force / field.weights[..., None]
        trace, weighted = plain[0] + plain[1], force[0] + force[1]
        energy = _gram(weighted, trace) - _gram(force[0], plain[0]) - _gram(force[1], plain[1])
        part = np.zeros((n,) * 4)
        tensors.unpacked(energy - 2 * _gram(force[2], plain[2]), pairs, part)
        by_nu[...] += part

    direct.stretching_products(plate, modes.shapes, modes.parities, in_plane, told)
    sums = plate.domain.comm.allreduce
    work, by_nu = copies * sums(work), copies * sums(by_nu)
    work = work.reshape(len(changes), n, n, n, n)
    found = {name: _every_slot(part) for name, part in zip(changes, work)}
    stretching = plate.stiffness.stretching
    return found, tensors.symmetrised(by_nu) / stretching


def _gram(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """sum_cq first (c, q, m) second (c, q, n)."""
    rows, columns = (a.reshape(-1, a.shape[-1]) for a in (first, second))
    return np.asarray(rows.T @ columns)


def _flat(values: np.ndarray) -> np.ndarray:
    """Values (c, q, p, n) as (c, q, p n)."""
    return values.reshape(*values.shape[:2], -1)


def _every_slot(work: np.ndarray) -> np.ndarray:
    """The tensor's derivative from that of its first shape, symmetrised over all four."""
    first = tensors.symmetrised(work)
    return np.asarray(
        first
        + first.transpose(1, 0, 2, 3)
        + first.transpose(1, 2, 0, 3)
        + first.transpose(1, 2, 3, 0)
    )
