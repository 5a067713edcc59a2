"""An orbit as a motion in time, as a spectrum and as a shape."""

from __future__ import annotations

import numpy as np

from nanorom.continuation import explore
from tests.continuation.systems import from_monomials


def test_sampled_motion_spectrum_and_shape_agree() -> None:
    diagram = explore(from_monomials("p2"), (1.5, 2.5), direct=0.002, parametric=0.013)
    orbit = diagram.branches[1].orbit(20)
    assert orbit.period_multiple == 2
    times, q, v = orbit.time_series(points=400, periods=2)
    np.testing.assert_allclose(q[400], q[0], atol=1e-12)
    frequencies, amplitudes = orbit.spectrum()
    rebuilt = (np.exp(1j * np.outer(times, frequencies)) @ amplitudes).real
    np.testing.assert_allclose(rebuilt, q, atol=1e-12)
    np.testing.assert_allclose(np.gradient(q[:, 0], times)[5:-5], v[5:-5, 0], atol=1e-3)
    np.testing.assert_allclose(np.abs(q).max(axis=0), diagram.branches[1].amplitude[20], rtol=1e-3)
    modes = np.array([[1.0, 0.0, 2.0], [0.0, 1.0, 1.0]])
    np.testing.assert_allclose(orbit.shape(modes, times), q @ modes)
