"""STEP on a shell, at an amplitude where its coefficients do not depend on it.

The condensed force of a shell is no polynomial: `plateau` finds the amplitude, and `truncation`
measures what a quadratic and cubic force leaves out.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from nanorom.fem.inplane import InPlane
from nanorom.fem.shellcases import ShellCases
from nanorom.fem.step import Case, StepResult, coefficients, is_mirrored, load_cases, symmetric

BATCH = 64  # load cases solved together
HALVINGS = 9  # of the amplitude, from the thickness down


def step(
    cases: ShellCases, amplitude: float, progress: Callable[[int, int], None] | None = None
) -> StepResult:
    """Quadratic and cubic coefficients by STEP. Collective.

    ``amplitude`` of every prescribed mode, in the shell's unit of length.
    """
    n = len(cases.linear)
    every = list(load_cases(n))
    solved = [case for case in every if not (cases.odd and is_mirrored(case))]
    forces: dict[Case, np.ndarray] = {}
    for first in range(0, len(solved), BATCH):
        batch = solved[first : first + BATCH]
        q = np.zeros((n, len(batch)))
        for column, case in enumerate(batch):
            for mode, sign in case:
                q[mode, column] = sign * amplitude
        forces |= zip(batch, cases.nonlinear_force(q).T)
        if progress is not None:
            progress(len(forces), len(solved))
    for case in every:
        if case not in forces:
            forces[case] = -forces[tuple((mode, -sign) for mode, sign in case)]
    quadratic, cubic = coefficients(forces, n, amplitude)
    return symmetric(quadratic, cubic, amplitude, len(solved), InPlane())


def plateau(cases: ShellCases, thickness: float) -> tuple[float, float]:
    """The amplitude at which STEP's coefficients depend least on it, and by how much. Collective.

    Halved from the thickness down, truncation falls as its square while round-off rises; what the
    next halving changes in the coefficients of single modes, relative to the largest, tells.
    """
    amplitudes = thickness / 2.0 ** np.arange(HALVINGS)
    found, changes = _single(cases, amplitudes[0]), []
    for amplitude in amplitudes[1:]:
        finer = _single(cases, amplitude)
        sizes = [np.abs(each).max() for each in finer]
        scale = max(sizes[1], sizes[0] / thickness)
        quadratic, cubic = (np.abs(a - b).max() for a, b in zip(found, finer))
        changes.append(max(cubic, quadratic / thickness) / scale)
        found = finer
    best = int(np.argmin(changes))
    return float(amplitudes[best + 1]), float(changes[best])


def _single(cases: ShellCases, amplitude: float) -> tuple[np.ndarray, np.ndarray]:
    """Force coefficients (L, L) of q_j^2 and of q_j^3, one mode at a time."""
    q = amplitude * np.eye(len(cases.linear))
    up = cases.nonlinear_force(q)
    down = -up if cases.odd else cases.nonlinear_force(-q)
    return (up + down) / (2 * amplitude**2), (up - down) / (2 * amplitude**3)


def truncation(cases: ShellCases, result: StepResult, amplitude: float) -> float:
    """What the coefficients miss of the nonlinear force of single modes at an amplitude, relative.

    The largest error of any mode's own force over the largest force. Collective.
    """
    q = amplitude * np.eye(len(cases.linear))
    exact = cases.nonlinear_force(q)
    told = np.einsum("rjk,jc,kc->rc", result.quadratic, q, q)
    told += np.einsum("rjkl,jc,kc,lc->rc", result.cubic, q, q, q, optimize=True)
    return float(np.abs(told - exact).max() / np.abs(exact).max())
