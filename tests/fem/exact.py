"""Scenes with exact solutions, and the exact solutions."""

from __future__ import annotations

import itertools
import json
from pathlib import Path

import numpy as np
from scipy.optimize import brentq
from scipy.special import ive, jn_zeros, jv, jvp

from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Disc
from nanorom.scene.material import Material
from nanorom.scene.scene import Accuracy, Modes, Scene

DATA = Path(__file__).parent / "data"
RADIUS, THICKNESS, MODULUS, DENSITY = 2.5e-6, 10e-9, 410e9, 2267.0


def drum(kappa: float, count: int = 11, nu: float = 0.16, model: str = "plate", **kwargs) -> Scene:
    """Clamped drum with T R^2/D = kappa; a membrane takes its tension from that, too."""
    rigidity = MODULUS * THICKNESS**3 / (12 * (1 - nu**2))
    tension = kappa * rigidity / RADIUS**2
    return Scene(
        geometry=Disc(radius=RADIUS),
        plate=Plate(thickness=THICKNESS, model=model),
        material=Material(youngs_modulus=MODULUS, poisson_ratio=nu, density=DENSITY),
        tension=Tension(x=tension, y=tension),
        modes=Modes(count=count),
        accuracy=kwargs.pop("accuracy", Accuracy(tolerance=1e-6)),
        **kwargs,
    )


def paper_drum(count: int = 11, tolerance: float = 1e-6) -> Scene:
    """The graphene nanodrum of the paper, with E = 410 GPa."""
    return Scene(
        geometry=Disc(radius="2.5 um"),
        plate=Plate(thickness="10 nm", model="plate"),
        material=Material(youngs_modulus="410 GPa", poisson_ratio=0.16, density="2267 kg/m^3"),
        tension=Tension(x="0.321 N/m", y="0.257 N/m"),
        modes=Modes(count=count),
        accuracy=Accuracy(tolerance=tolerance),
    )


def clamped_disc(kappa: float, count: int) -> np.ndarray:
    """omega R^2 sqrt(rho h/D) of the ``count`` lowest modes, pairs counted twice.

    Roots of b J_p'(b)/J_p(b) = g I_p'(g)/I_p(g), with g^2 - b^2 = kappa and lambda = b g.
    """

    def characteristic(b: float, p: int) -> float:
        g = np.sqrt(b**2 + kappa)
        ratio = 0.5 * (ive(p - 1, g) + ive(p + 1, g)) / ive(p, g)
        return b * jvp(p, b) - g * ratio * jv(p, b)

    found = []
    for p in range(12):
        grid = np.linspace(0.5 + p, 14 + p, 600)
        values = [characteristic(b, p) for b in grid]
        for low, high, f, g in zip(grid, grid[1:], values, values[1:]):
            if f * g < 0:
                b = brentq(characteristic, low, high, args=(p,), xtol=1e-14, rtol=1e-14)
                found += [b * np.sqrt(b**2 + kappa)] * (1 if p == 0 else 2)
    return np.sort(found)[:count]


def membrane_disc(count: int) -> np.ndarray:
    """omega R sqrt(rho h/T): zeros of J_p, pairs counted twice."""
    zeros = [z for p in range(10) for z in jn_zeros(p, 6) for _ in range(1 if p == 0 else 2)]
    return np.sort(zeros)[:count]


def symmetric_tensor(entries: list, size: int) -> np.ndarray:
    """Dense tensor from [r, j, k, l, value] rows with 1-based r <= j <= k <= l."""
    tensor = np.zeros((size,) * 4)
    for *index, value in entries:
        for order in itertools.permutations(i - 1 for i in index):
            tensor[order] = value
    return tensor


def drum_tensor() -> np.ndarray:
    """B (15, 15, 15, 15) in E h/R^2 of the clamped drum with T R^2/D = 100, nu = 0.16.

    Provenance: spectral Galerkin solution without finite elements (radial polynomials times
    harmonics, in-plane problem solved exactly), converged to 2e-12 from K = 40 to K = 56.
    """
    data = json.loads((DATA / "drum-tensor-kappa100.json").read_text())
    return symmetric_tensor(data["T"], len(data["modes"]))
