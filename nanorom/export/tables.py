"""Modal equations as tables: MATLAB (.mat) and plain text (.csv), in the user's units.

One coefficient per monomial: force on mode r = sum over monomials of
coefficient[r] * prod_j q_j ** exponent[j].
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np

from nanorom.continuation.system import ModalSystem
from nanorom.files.whole import atomic_path
from nanorom.rom.tensors import monomial_coefficients
from nanorom.types import Array


def _all_monomials(system: ModalSystem) -> list[tuple[tuple[int, ...], Array]]:
    linear = [
        ((j,), system.stiffness[:, j]) for j in range(system.size) if np.any(system.stiffness[:, j])
    ]
    return linear + monomial_coefficients(system.quadratic) + monomial_coefficients(system.cubic)


def write_csv(
    system: ModalSystem, path: Path, omega: Any = None, direct: float = 1.0, parametric: float = 0.0
) -> None:
    """One monomial of one equation per row: mode, exponents of q_1 ... q_L, coefficient.

    Of the equations alone, in the user's units: neither range nor levels play a part.
    """
    with atomic_path(path) as temporary, open(temporary, "w", newline="") as handle:
        writer = csv.writer(handle)
        writer.writerow(["mode"] + [f"q{j + 1}" for j in range(system.size)] + ["coefficient"])
        for indices, coefficients in _all_monomials(system):
            exponents = np.bincount(indices, minlength=system.size)
            for mode in np.flatnonzero(coefficients):
                writer.writerow([mode + 1, *exponents, repr(float(coefficients[mode]))])


def write_matlab(
    system: ModalSystem, path: Path, omega: Any = None, direct: float = 1.0, parametric: float = 0.0
) -> None:
    """Matrices (L, L), monomials (n, L) and their coefficients (n, L), in the user's units."""
    from scipy.io import savemat

    table = monomial_coefficients(system.quadratic) + monomial_coefficients(system.cubic)
    exponents = np.array([np.bincount(indices, minlength=system.size) for indices, _ in table])
    coefficients = np.array([values for _, values in table])
    contents = {
        "M": system.mass,
        "C": system.damping,
        "K": system.stiffness,
        "exponents": exponents.reshape(-1, system.size).astype(float),
        "coefficients": coefficients.reshape(-1, system.size),
        "direct": system.direct,
        "parametric": system.parametric,
        "cubic_damping": system.cubic_damping,
        "description": "M q'' + C q' + K q + coefficients.' * prod(q.' .^ exponents, 2)"
        " + sum_kjl cubic_damping(:, k, j, l) q'_k q_j q_l = (direct + parametric q) cos(w t)",
    }
    with atomic_path(path) as temporary:
        savemat(temporary, contents, oned_as="column", appendmat=False)
