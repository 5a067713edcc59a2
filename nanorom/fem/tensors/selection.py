"""What symmetry tells of load cases and tensors before any is computed.

A mirror of the film turns modal amplitudes q into s q, with a sign for every mode, and the
nonlinear force with them: eta(s q) = s eta(q).  A flat film has one mirror more, its own plane,
which turns all signs.  Of load cases that are images of each other one is solved.

A coefficient is the integral of a product of modes over the whole film.  It vanishes unless the
product has a part that every mirror leaves as it is, and on a body of revolution one that every
turn does: the nodal diameters of its modes, each taken with some sign, add up to nothing.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product

import numpy as np

from nanorom.fem.modes.deflections import Deflections
from nanorom.fem.symmetry import Parity
from nanorom.fem.tensors.cases import Case


def images(parities: list[Parity], odd: bool) -> list[np.ndarray]:
    """Signs (L,) by which the film's mirrors turn amplitudes, those of all their products.

    odd : the film's own plane is one of the mirrors.
    """
    bits = np.array([[*parity, 1] if odd else parity for parity in parities], dtype=int)
    turned = product((0, 1), repeat=bits.shape[1])
    return [1 - 2 * (bits @ np.array(mirrors, dtype=int) % 2) for mirrors in turned]


def solved_for(
    cases: Iterable[Case], signs: list[np.ndarray]
) -> dict[Case, tuple[Case, np.ndarray]]:
    """By case: the first of its images among the cases, and the signs (L,) that lead there."""
    found: dict[Case, tuple[Case, np.ndarray]] = {}
    first: set[Case] = set()
    for case in cases:
        reached = [(tuple((m, int(sign * s[m])) for m, sign in case), s) for s in signs]
        found[case] = next((image for image in reached if image[0] in first), reached[0])
        first.add(found[case][0])
    return found


def permitted(modes: Deflections, rank: int) -> np.ndarray:
    """Entries (L,) * rank of a tensor of rank 3 or 4 that symmetry does not make zero."""
    codes = np.array([int("".join(map(str, (0, *parity))), 2) for parity in modes.parities])
    pairs = codes[:, None] ^ codes
    last = codes if rank == 3 else pairs
    found = _equal(pairs, last)
    if modes.diameters is not None:
        p = modes.diameters
        sums = np.abs(p[:, None] + p), np.abs(p[:, None] - p)
        closed = np.zeros_like(found)
        for a in sums:
            for b in (p,) if rank == 3 else sums:
                closed |= _equal(a, b)
        found &= closed
    return found


def _equal(first: np.ndarray, last: np.ndarray) -> np.ndarray:
    return first[(..., *(None,) * last.ndim)] == last
