"""STEP: stiffness evaluation by nonlinear static load cases (steps III and IV of the paper).

Each case prescribes a deflection w = sum q_j phi_j, lets the in-plane displacement find its
equilibrium (SNES), and takes the consistent reaction of the deflection's degrees of freedom,

    F_NL = F_T - K X_c,    eta = Phi^T F_NL.

2 L + 3 L (L - 1)/2 + C(L, 3) cases give all quadratic and cubic coefficients (Muravyov and Rizzi
2003, doi:10.1016/S0045-7949(03)00145-7).
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Sequence
from itertools import combinations, groupby, permutations

import attrs
import numpy as np

from nanorom.errors import SolverError
from nanorom.fem.symmetry import Parity
from nanorom.fem.tensors import selection
from nanorom.fem.tensors.cases import (
    Case,
    Cases,
    amplitudes_of,
    load_cases,
    opposite,
    with_opposites,
)
from nanorom.fem.tensors.inplane import InPlane
from nanorom.files.partial import Journal

EXTRAPOLATED = 3  # amplitudes, each half of the last, from which coefficients go to nothing
QUADRATIC_NOISE = 1e-3  # of the cubic force: quadratic coefficients below it are round-off
NOT_A_POTENTIAL = 1e-2  # asymmetry of tensors that are refused

Coefficients = tuple[np.ndarray, np.ndarray]  # quadratic, cubic


@attrs.frozen(eq=False)
class StepResult:
    """Coefficients from static load cases.

    quadratic (L, L, L), cubic (L, L, L, L): fully symmetrised; asymmetry: largest entry that
    symmetrisation changed, relative to the largest entry (an error indicator: exact coefficients
    derive from a potential); n_cases: load cases solved; in_plane: what is known of the
    displacements, errors relative to the largest energy of a case.
    """

    quadratic: np.ndarray
    cubic: np.ndarray
    asymmetry: float
    n_cases: int
    in_plane: InPlane


def step(
    cases: Cases,
    amplitude: float,
    nonzero: np.ndarray | None = None,
    extrapolate: bool = False,
    progress: Callable[[int, int], None] | None = None,
    journal: Journal | None = None,
) -> StepResult:
    """Quadratic and cubic coefficients of the modes of some cases. Collective.

    ``amplitude`` scales every prescribed mode, in the unit of the cases' amplitudes; from it, its
    half and its quarter coefficients are `extrapolated` if asked for.  Of cases that are images of
    each other one is solved, and of three modes together none where symmetry leaves nothing to be
    found: ``nonzero`` (L, L, L, L).  Cases that the ``journal`` of an interrupted run holds are not
    solved again.  Raises SolverError if a case does not converge.
    """
    n = len(cases.parities)
    every = [
        case
        for case in load_cases(n)
        if nonzero is None or len(case) < 3 or nonzero[:, case[0][0], case[1][0], case[2][0]].any()
    ]
    if not cases.polynomial:
        every = with_opposites(every)
    sources = selection.solved_for(every, selection.images(cases.parities, cases.odd))
    batches = list(batches_of([c for c, (s, _) in sources.items() if s == c], cases))
    amplitudes = [amplitude / 2**halvings for halvings in range(EXTRAPOLATED if extrapolate else 1)]
    n_solved, found = sum(map(len, batches)), []
    for number, each in enumerate(amplitudes):

        def told(done: int, before: int = number * n_solved) -> None:
            if progress is not None:
                progress(before + done, len(amplitudes) * n_solved)

        own = solved(cases, batches, each, told, journal or Journal())
        forces = {case: signs * own[source] for case, (source, signs) in sources.items()}
        parts = coefficients if cases.polynomial else coefficients_of_parts
        found.append(parts(forces, n, each))
    quadratic, cubic = extrapolated(found)
    known = cases.in_plane(amplitude)
    return symmetric(quadratic, cubic, amplitude, len(amplitudes) * n_solved, known)


def solved(
    cases: Cases,
    batches: list[list[Case]],
    amplitude: float,
    progress: Callable[[int], None],
    journal: Journal,
) -> dict[Case, np.ndarray]:
    """Modal force (L,) of all cases, those that a journal holds taken from there. Collective."""
    every = [case for batch in batches for case in batch]
    which = hashlib.sha256(repr(every).encode()).hexdigest()[:16]
    name = f"{cases.key}, amplitude {amplitude:.9e}, cases {which}"
    table = journal.table(name, (len(cases.parities), len(every)))
    done = 0
    for batch in batches:
        columns = slice(done, done + len(batch))
        if np.isnan(table[:, columns]).any():
            q = amplitudes_of(batch, len(cases.parities), amplitude)
            table[:, columns] = cases.nonlinear_force(q)
            journal.keep()
        done += len(batch)
        progress(done)
    return dict(zip(every, table.T))


def batches_of(every: list[Case], cases: Cases) -> Iterator[list[Case]]:
    """Cases that are solved together: those in which the same classes of symmetry move.

    An interrupted run solves the same batches, so that its result is the same to the last bit.
    """

    def moving(case: Case) -> list[Parity]:
        return sorted({cases.parities[mode] for mode, _ in case})

    for _, alike in groupby(sorted(every, key=moving), key=moving):
        members = list(alike)
        for first in range(0, len(members), cases.most_columns):
            yield members[first : first + cases.most_columns]


def coefficients_of_parts(
    forces: dict[Case, np.ndarray], n_modes: int, amplitude: float
) -> Coefficients:
    """Quadratic coefficients of the even part of the forces, cubic ones of the odd part.

    Each is free of the other, so that what truncation leaves is even in the amplitude.
    """
    even, odd = (
        {case: (force + sign * forces[opposite(case)]) / 2 for case, force in forces.items()}
        for sign in (1, -1)
    )
    return coefficients(even, n_modes, amplitude)[0], coefficients(odd, n_modes, amplitude)[1]


def extrapolated(found: Sequence[Coefficients]) -> Coefficients:
    """Richardson's value at no amplitude, from halved ones: what truncation adds is even in it."""
    for power in 4.0 ** np.arange(1, len(found)):
        found = [
            ((power * b[0] - a[0]) / (power - 1), (power * b[1] - a[1]) / (power - 1))
            for a, b in zip(found, found[1:])
        ]
    return found[0]


def coefficients(forces: dict[Case, np.ndarray], n_modes: int, amplitude: float) -> Coefficients:
    """Solve the load cases for alpha[r, j, k] and b[r, j, k, l], symmetric in j, k (, l).

    The arrays sum over all index orders: alpha_jk of the paper is 2 alpha[r, j, k] for j != k.
    """
    n, q = n_modes, amplitude
    alpha, b = np.zeros((n, n, n)), np.zeros((n, n, n, n))

    def put(array: np.ndarray, value: np.ndarray, *index: int) -> None:
        """Spread a monomial's coefficient over the orders of its indices."""
        orders = set(permutations(index))
        for order in orders:
            array[(slice(None), *order)] = value / len(orders)

    single = {}
    for j in range(n):
        plus, minus = forces[((j, 1),)], forces[((j, -1),)]
        single[j] = (plus + minus) / (2 * q**2), (plus - minus) / (2 * q**3)
        put(alpha, single[j][0], j, j)
        put(b, single[j][1], j, j, j)
    double = {}
    for j, k in combinations(range(n), 2):
        pp, mm, pm = (forces[(j, s), (k, t)] for s, t in ((1, 1), (-1, -1), (1, -1)))
        (a_j, b_j), (a_k, b_k) = single[j], single[k]
        a_jk = (pp + mm) / (2 * q**2) - a_j - a_k
        both = (pp - mm) / (2 * q**3) - b_j - b_k  # b_jjk + b_jkk
        difference = (pm - q**2 * (a_j + a_k - a_jk)) / q**3 - b_j + b_k  # b_jkk - b_jjk
        double[j, k] = a_jk, (both - difference) / 2, (both + difference) / 2
        put(alpha, a_jk, j, k)
        put(b, double[j, k][1], j, j, k)
        put(b, double[j, k][2], j, k, k)
    for triple in combinations(range(n), 3):
        force = forces.get(tuple((j, 1) for j in triple))
        if force is None:  # nothing but zeros
            continue
        pairs = list(combinations(triple, 2))
        known2 = sum(single[j][0] for j in triple) + sum(double[p][0] for p in pairs)
        known3 = sum(single[j][1] for j in triple) + sum(double[p][1] + double[p][2] for p in pairs)
        put(b, force / q**3 - known2 / q - known3, *triple)
    return alpha, b


def check_potential(result: StepResult) -> None:
    """Raise SolverError if the coefficients cannot be those of an elastic film."""
    if not result.asymmetry <= NOT_A_POTENTIAL:
        raise SolverError(
            f"the tensors deviate from those of a potential by {result.asymmetry:.1e} of their "
            f"largest entry, more than {NOT_A_POTENTIAL:g}: forces at this amplitude are not cubic "
            "polynomials; change reduction.amplitude"
        )


def symmetric(
    quadratic: np.ndarray,
    cubic: np.ndarray,
    amplitude: float,
    n_cases: int,
    in_plane: InPlane,
) -> StepResult:
    """Result from coefficients symmetric in all but their first index, and how far they are off."""
    even = (quadratic + quadratic.transpose(1, 0, 2) + quadratic.transpose(2, 1, 0)) / 3
    swaps = [cubic, *(np.swapaxes(cubic, 0, axis) for axis in (1, 2, 3))]
    odd = np.mean(swaps, axis=0)
    asymmetry = max(
        np.abs(found - fair).max() / max(np.abs(fair).max(), smallest)
        for found, fair, smallest in (
            (quadratic, even, QUADRATIC_NOISE * amplitude * np.abs(odd).max()),
            (cubic, odd, np.finfo(float).tiny),
        )
    )
    return StepResult(even, odd, float(asymmetry), n_cases, in_plane)
