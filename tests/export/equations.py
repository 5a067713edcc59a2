"""Equations with every term that there is, and their motion written out index by index."""

import numpy as np

from nanorom.continuation import ModalSystem

LEVELS = {"direct": 0.3, "parametric": 0.2}
SIZE = 3


def system(seed=0, **changes):
    """Three modes coupled in every way that there is."""
    rng = np.random.default_rng(seed)
    coupled = rng.normal(size=(SIZE, SIZE))
    given = {
        "mass": np.diag([1.0, 2.0, 0.5]),
        "damping": np.diag([0.1, 0.2, 0.3]) + 0.01,
        "stiffness": np.diag([1.0, 8.0, 4.5]),
        "quadratic": rng.normal(size=(SIZE,) * 3),
        "cubic": rng.normal(size=(SIZE,) * 4),
        "cubic_damping": rng.normal(size=(SIZE,) * 4),
        "direct": rng.normal(size=SIZE),
        "parametric": coupled + coupled.T,
    }
    return ModalSystem(**given | changes)


def rate(scaled, t, x, omega, direct=1.0, parametric=1.0):
    """(q, q')' of the equations that `ScaledSystem` documents, index by index."""
    q, v = np.split(x, 2)
    drive = direct * scaled.force[:, 1] + parametric * scaled.parametric[..., 1] @ q
    force = scaled.damping @ v + scaled.stiffness @ q
    force = force + np.einsum("rjk,j,k", scaled.quadratic, q, q)
    force = force + np.einsum("rjkl,j,k,l", scaled.cubic, q, q, q)
    force = force + np.einsum("rkjl,j,l,k", scaled.loss, q, q, v)
    return np.concatenate([v, drive * np.cos(omega * t) - force])
