"""STEP on a shell, at an amplitude where its coefficients do not depend on it.

The condensed force of a shell is no polynomial: `plateau` finds the amplitude, and `truncation`
measures what a quadratic and cubic force leaves out.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from nanorom.errors import SolverError
from nanorom.fem.plan import EXTRAPOLATED
from nanorom.fem.tensors.inplane import InPlane
from nanorom.fem.tensors.selection import Case, images, solved_for
from nanorom.fem.tensors.shell_cases import ShellCases
from nanorom.fem.tensors.step import (
    StepResult,
    coefficients,
    load_cases,
    symmetric,
)

BATCH = 64  # load cases solved together
HALVINGS = 7  # of the amplitude, from the thickness down
NO_POLYNOMIAL = 1e-2  # change of coefficients with the amplitude that is refused
AS_GOOD = 8.0  # a change so many times the least is as good: round-off takes steps of four
Coefficients = tuple[np.ndarray, np.ndarray]  # quadratic, cubic


def step(
    cases: ShellCases,
    amplitude: float,
    progress: Callable[[int, int], None] | None = None,
    extrapolated: bool = False,
) -> StepResult:
    """Quadratic and cubic coefficients by STEP. Collective.

    ``amplitude`` of every prescribed mode, in the shell's unit of length; ``extrapolated`` from it,
    its half and its quarter to nothing.
    """
    n = len(cases.linear)
    firsts = [case for case in load_cases(n) if case[0][1] > 0]
    every = [*firsts, *map(opposite, firsts)]
    sources = solved_for(every, images([()] * n, cases.odd))
    solved = [case for case, (source, _) in sources.items() if source == case]
    amplitudes = amplitude / 2.0 ** np.arange(EXTRAPOLATED if extrapolated else 1)
    found, total = [], len(amplitudes) * len(solved)
    for number, each in enumerate(amplitudes):

        def told(done: int, before: int = number * len(solved)) -> None:
            if progress is not None:
                progress(before + done, total)

        own = _forces(cases, solved, each, told)
        forces = {case: signs * own[source] for case, (source, signs) in sources.items()}
        found.append(_of_parts(forces, n, each))
    quadratic, cubic = _to_nothing(found)
    return symmetric(quadratic, cubic, amplitude, total, InPlane())


def opposite(case: Case) -> Case:
    """The same modes with the other signs."""
    return tuple((mode, -sign) for mode, sign in case)


def _of_parts(forces: dict[Case, np.ndarray], n: int, amplitude: float) -> Coefficients:
    """Quadratic coefficients of the even part of the forces, cubic ones of the odd part.

    Each is free of the other, so that what truncation leaves is even in the amplitude.
    """
    even, odd = (
        {case: (force + sign * forces[opposite(case)]) / 2 for case, force in forces.items()}
        for sign in (1, -1)
    )
    return coefficients(even, n, amplitude)[0], coefficients(odd, n, amplitude)[1]


def _to_nothing(found: Sequence[Coefficients]) -> Coefficients:
    """Richardson's value at no amplitude, from halved ones: what truncation adds is even in it."""
    for power in 4.0 ** np.arange(1, len(found)):
        found = [
            ((power * b[0] - a[0]) / (power - 1), (power * b[1] - a[1]) / (power - 1))
            for a, b in zip(found, found[1:])
        ]
    return found[0]


def _forces(
    cases: ShellCases,
    solved: list[Case],
    amplitude: float,
    progress: Callable[[int], None],
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
        progress(len(forces))
    return forces


def plateau(cases: ShellCases, thickness: float) -> tuple[float, float]:
    """The largest amplitude on which extrapolated coefficients hardly depend, and how much they do.

    Halved from the thickness down, truncation falls as its sixth power while round-off rises as
    its square; what the next halving changes in the coefficients of single modes, relative to the
    largest, tells.  Amplitudes at which a case does not converge are passed over.  Raises
    SolverError if too few are left.  Collective.
    """
    amplitudes, single = [], []
    for amplitude in thickness / 2.0 ** np.arange(HALVINGS):
        try:
            single.append(_single(cases, amplitude))
        except SolverError:  # so far the shell cannot be pushed, but perhaps half as far
            if single or amplitude == thickness / 2.0 ** (HALVINGS - EXTRAPOLATED - 1):
                raise
        else:
            amplitudes.append(amplitude)
    values = [
        _to_nothing(single[first : first + EXTRAPOLATED])
        for first in range(len(single) - EXTRAPOLATED + 1)
    ]
    changes = [_change(*pair, thickness) for pair in zip(values, values[1:])]
    best = int(np.argmax(np.array(changes) <= AS_GOOD * min(changes)))
    return float(amplitudes[best]), float(changes[best])


def change(cases: ShellCases, amplitude: float, thickness: float) -> float:
    """What halving an amplitude changes in the coefficients of single modes, relative. Collective.

    Raises SolverError if that is so much that the force is no polynomial there.
    """
    found = _change(_single(cases, amplitude), _single(cases, amplitude / 2), thickness)
    if not found <= NO_POLYNOMIAL:
        raise SolverError(
            f"reduction.amplitude: at half of it the coefficients differ by {found:.1e} of their "
            f"largest, more than {NO_POLYNOMIAL:g}: the shell's force is no cubic polynomial "
            "there; lower it, or leave it out to have it found"
        )
    return found


def _change(whole: Coefficients, half: Coefficients, thickness: float) -> float:
    """Largest difference of coefficients relative to the largest, by their force at a thickness."""
    sizes = [np.abs(each).max() for each in half]
    scale = max(sizes[1], sizes[0] / thickness)
    quadratic, cubic = (np.abs(a - b).max() for a, b in zip(whole, half))
    return float(max(cubic, quadratic / thickness) / scale)


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
