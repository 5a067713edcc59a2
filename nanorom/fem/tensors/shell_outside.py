"""What everything outside the modes of a shell adds to its cubic force; theory as in `outside`.

The residual of a shell is a polynomial of degree three in its state, so that the force A_jk of two
modes follows from residuals at a few states exactly, whatever the amplitude: it is their even part.
The displacement in the surface and the director give way first, as they do in load cases.
"""

from __future__ import annotations

import numpy as np

from nanorom.fem.solvers import algebra
from nanorom.fem.tensors.outside import MATTERS, Outside
from nanorom.fem.tensors.shell_cases import ShellCases
from nanorom.rom import tensors


def response(cases: ShellCases, amplitude: float) -> Outside | None:
    """What the rest of the shell adds to the modes of the cases; None if it does nothing.

    ``amplitude`` of the states at which residuals are taken: as of the load cases.  Collective.
    """
    if cases.odd:  # it does not tell its sides
        return None
    n, comm = cases.shapes.shape[1], cases.problem.comm
    pairs = np.column_stack(np.triu_indices(n))
    force = pair_forces(cases, pairs, amplitude)
    stiffness = cases.tangent(np.zeros(len(force)))
    given_way = np.zeros_like(force)
    given_way[cases.rest] = cases.factors.solve(force[cases.rest])
    force -= algebra.multiply(stiffness, given_way)
    force[cases.rest] = 0.0  # but for what rounding has left
    factors = algebra.Factorization(stiffness, "nanorom_outside_", "shell's stiffness")
    work = comm.allreduce(force.T @ cases.shapes)
    found = factors.solve(force) - cases.shapes @ np.linalg.solve(cases.linear, work.T)
    energy = comm.allreduce(force.T @ found)
    energy = 0.5 * (energy + energy.T)
    index = np.empty((n, n), dtype=int)
    index[tuple(pairs.T)] = index[tuple(pairs.T[::-1])] = np.arange(len(pairs))
    products = energy[index[:, :, None, None], index]
    own, mass = energy.diagonal(), cases.squares(found)
    slow = own > MATTERS * max(own.max(), np.finfo(float).tiny)
    eigenvalue = float((own[slow] / mass[slow]).min()) if slow.any() else np.inf
    return Outside(tensors.paired(products), eigenvalue)


def pair_forces(cases: ShellCases, pairs: np.ndarray, amplitude: float) -> np.ndarray:
    """A_jk (owned free dofs, p) of pairs (p, 2) of modes. Collective."""

    def even(state: np.ndarray) -> np.ndarray:
        state = amplitude * state
        return (cases.residual(state) + cases.residual(-state)) / (2 * amplitude**2)

    alone = [even(shape) for shape in cases.shapes.T]
    columns = []
    for j, k in pairs:
        if j == k:
            columns.append(alone[j])
        else:
            both = even(cases.shapes[:, j] + cases.shapes[:, k])
            columns.append(0.5 * (both - alone[j] - alone[k]))
    cases.reset()
    return np.column_stack(columns)
