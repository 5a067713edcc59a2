"""STEP on a shell, at an amplitude where its coefficients do not depend on it.

The condensed force of a shell is no polynomial: `plateau` finds the amplitude, and `truncation`
measures what a quadratic and cubic force leaves out.
"""

from __future__ import annotations

import numpy as np

from nanorom.errors import SolverError
from nanorom.fem.tensors.shell_cases import ShellCases
from nanorom.fem.tensors.step import EXTRAPOLATED, Coefficients, StepResult, extrapolated

HALVINGS = 7  # of the amplitude, from the thickness down
NO_POLYNOMIAL = 1e-2  # change of coefficients with the amplitude that is refused
AS_GOOD = 8.0  # a change so many times the least is as good: round-off takes steps of four


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
        extrapolated(single[first : first + EXTRAPOLATED])
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
