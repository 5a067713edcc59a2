"""STEP on a shell, at an amplitude where its coefficients do not depend on it.

The condensed force of a shell is no polynomial: `plateau` finds the amplitude, and `truncation`
measures what a quadratic and cubic force leaves out.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from nanorom.fem.inplane import InPlane
from nanorom.fem.selection import Case, images, solved_for
from nanorom.fem.shellcases import ShellCases
from nanorom.fem.step import StepResult, coefficients, load_cases, symmetric

BATCH = 64  # load cases solved together
HALVINGS = 7  # of the amplitude, from the thickness down
Coefficients = tuple[np.ndarray, np.ndarray]  # quadratic, cubic


def step(
    cases: ShellCases,
    amplitude: float,
    progress: Callable[[int, int], None] | None = None,
    extrapolated: bool = False,
) -> StepResult:
    """Quadratic and cubic coefficients by STEP. Collective.

    ``amplitude`` of every prescribed mode, in the shell's unit of length; ``extrapolated`` from it
    and its half to nothing.
    """
    n = len(cases.linear)
    sources = solved_for(load_cases(n), images([()] * n, cases.odd))
    solved = [case for case, (source, _) in sources.items() if source == case]
    amplitudes = (amplitude, amplitude / 2) if extrapolated else (amplitude,)
    found, total = [], len(amplitudes) * len(solved)
    for number, each in enumerate(amplitudes):

        def told(done: int, _: int, before: int = number * len(solved)) -> None:
            if progress is not None:
                progress(before + done, total)

        own = _forces(cases, solved, each, told)
        forces = {case: signs * own[source] for case, (source, signs) in sources.items()}
        found.append(coefficients(forces, n, each))
    quadratic, cubic = _to_nothing(*found) if extrapolated else found[0]
    return symmetric(quadratic, cubic, amplitude, total, InPlane())


def _to_nothing(whole: Coefficients, half: Coefficients) -> Coefficients:
    """Richardson's value at no amplitude: what truncation adds is even in the amplitude."""
    quadratic, cubic = ((4 * b - a) / 3 for a, b in zip(whole, half))
    return quadratic, cubic


def _forces(
    cases: ShellCases,
    solved: list[Case],
    amplitude: float,
    progress: Callable[[int, int], None],
) -> dict[Case, np.ndarray]:
    """Modal force of the load cases that are solved. Collective."""
    n = len(cases.linear)
    forces: dict[Case, np.ndarray] = {}
    for first in range(0, len(solved), BATCH):
        batch = solved[first : first + BATCH]
        q = np.zeros((n, len(batch)))
        for column, case in enumerate(batch):
            for mode, sign in case:
                q[mode, column] = sign * amplitude
        forces |= zip(batch, cases.nonlinear_force(q).T)
        progress(len(forces), len(solved))
    return forces


def plateau(cases: ShellCases, thickness: float) -> tuple[float, float]:
    """The amplitude at which extrapolated coefficients depend least on it, and by how much.

    Halved from the thickness down, truncation falls as its fourth power while round-off rises;
    what the next halving changes in the coefficients of single modes, relative to the largest,
    tells.  Collective.
    """
    amplitudes = thickness / 2.0 ** np.arange(HALVINGS)
    single = [_single(cases, amplitude) for amplitude in amplitudes]
    values = [_to_nothing(*pair) for pair in zip(single, single[1:])]
    changes = []
    for found, finer in zip(values, values[1:]):
        sizes = [np.abs(each).max() for each in finer]
        scale = max(sizes[1], sizes[0] / thickness)
        quadratic, cubic = (np.abs(a - b).max() for a, b in zip(found, finer))
        changes.append(max(cubic, quadratic / thickness) / scale)
    best = int(np.argmin(changes))
    return float(amplitudes[best + 1]), float(changes[best])


def _single(cases: ShellCases, amplitude: float) -> Coefficients:
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
