"""Backbones against their closed form."""

from __future__ import annotations

import numpy as np
from scipy.special import ellipk

from nanorom.continuation import backbone
from tests.continuation.systems import duffing


def test_duffing_backbone_is_exact() -> None:
    """x'' + x + x^3 = 0: omega = pi sqrt(1 + a^2) / (2 K(m)), m = a^2 / (2 (1 + a^2))."""
    curve = backbone(duffing(), amplitude=3.0)
    a = curve.amplitude[:, 0]
    exact = np.pi * np.sqrt(1 + a**2) / (2 * ellipk(a**2 / (2 * (1 + a**2))))
    assert a.max() > 3
    np.testing.assert_allclose(curve.omega, exact, atol=1e-8)
    np.testing.assert_allclose(curve.energy, a**2 / 2 + a**4 / 4, rtol=1e-6)
