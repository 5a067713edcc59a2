"""Systems the continuation tests share."""

from __future__ import annotations

import json
from itertools import permutations
from pathlib import Path

import numpy as np

from nanorom.continuation import ModalSystem

REFERENCE = json.loads((Path(__file__).parent / "reference_points.json").read_text())


def from_monomials(name: str) -> ModalSystem:
    """A system of reference_points.json: cubic coefficients per monomial q_j q_k q_l, j <= k <=
    l.
    """
    data = REFERENCE["systems"][name]
    size, frequencies = data["L"], np.array(data["w"])
    cubic = np.zeros((size,) * 4)
    for number, monomial in enumerate(data["monomials"]):
        orders = set(permutations(monomial))
        for mode in range(size):
            for order in orders:
                cubic[(mode, *order)] += data["b"][mode][number] / len(orders)
    return ModalSystem(
        damping=frequencies / data["Q"],
        stiffness=frequencies**2,
        cubic=cubic,
        direct=data["J"],
        parametric=data["J"],
    )


def duffing(quality: float = 180.0, **changes: object) -> ModalSystem:
    arguments: dict[str, object] = {
        "damping": 1 / quality,
        "stiffness": [1.0],
        "cubic": [[[[1.0]]]],
        "direct": [1.0],
        "parametric": [1.0],
    }
    arguments.update(changes)
    return ModalSystem(**arguments)


def random_potential(size: int, seed: int, quality: float = 100.0) -> ModalSystem:
    """Dense quadratic and cubic forces from a random potential bounded below, with incommensurate
    frequencies.
    """
    random = np.random.default_rng(seed)
    frequencies = 1 + 0.75 * np.arange(size) + 0.15 * random.random(size)
    vectors = random.standard_normal((3 * size, size))
    cubic = np.einsum("mi,mj,mk,ml->ijkl", vectors, vectors, vectors, vectors) / (9 * size)
    other = random.standard_normal((size, size))
    quadratic = 0.02 * np.einsum("mi,mj,mk->ijk", other, other, other) / size
    return ModalSystem(
        damping=frequencies / quality,
        stiffness=frequencies**2,
        quadratic=quadratic,
        cubic=cubic,
        direct=random.standard_normal(size),
        parametric=np.diag(random.standard_normal(size)),
    )
