"""Static load cases: what STEP asks of any film or shell, and which cases it asks for."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from typing import Protocol

import numpy as np

from nanorom.fem.symmetry import Parity
from nanorom.fem.tensors.inplane import InPlane

Case = tuple[tuple[int, int], ...]  # (mode, sign) of every mode taking part


class Cases(Protocol):
    """Nonlinear static equilibrium of a film under prescribed modal amplitudes.

    parities : classes of symmetry of its L modes.
    odd : opposite cases have opposite forces: the film does not tell its sides.
    polynomial : the force is a polynomial of degree three, but for what is neglected anyway.
    most_columns : cases that are solved together, and between which a journal is kept.
    key : tells modes and mesh from those of other cases.
    """

    odd: bool
    polynomial: bool
    most_columns: int

    @property
    def parities(self) -> list[Parity]: ...

    @property
    def key(self) -> str: ...

    def nonlinear_force(self, q: np.ndarray) -> np.ndarray:
        """eta (L, m) = Phi^T (F_T - K X_c) at modal amplitudes q (L, m). Collective."""

    def in_plane(self, amplitude: float) -> InPlane:
        """What is known of in-plane displacements at an amplitude of every mode. Collective."""


def load_cases(n_modes: int) -> Iterator[Case]:
    """All cases of STEP: +-j; ++, --, +- of each pair; +++ of each triple."""
    for j in range(n_modes):
        yield ((j, 1),)
        yield ((j, -1),)
    for j, k in combinations(range(n_modes), 2):
        yield (j, 1), (k, 1)
        yield (j, -1), (k, -1)
        yield (j, 1), (k, -1)
    for j, k, l in combinations(range(n_modes), 3):
        yield (j, 1), (k, 1), (l, 1)


def opposite(case: Case) -> Case:
    """The same modes with the other signs."""
    return tuple((mode, -sign) for mode, sign in case)


def with_opposites(cases: list[Case]) -> list[Case]:
    """Each case and its opposite, once."""
    firsts = [case for case in cases if case[0][1] > 0]
    return [*firsts, *map(opposite, firsts)]


def amplitudes_of(cases: list[Case], n_modes: int, amplitude: float) -> np.ndarray:
    """Modal amplitudes (L, m) of cases."""
    q = np.zeros((n_modes, len(cases)))
    for column, case in enumerate(cases):
        for mode, sign in case:
            q[mode, column] = sign * amplitude
    return q
