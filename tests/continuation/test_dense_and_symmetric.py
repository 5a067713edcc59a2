"""Systems that once found faults: symmetry classes, dense tensors, strong drive."""

from __future__ import annotations

import numpy as np

from nanorom.continuation import ModalSystem, explore

FEW_POINTS = 100  # a loop of some ten series steps; one of tiny steps has a thousand and more


def two_classes() -> ModalSystem:
    """A driven mode and one of another symmetry class, which moves from its instability on."""
    vectors = np.array([[1.0, 0.0], [0.0, 1.2], [0.6, 0.8], [0.6, -0.8]])
    cubic = np.einsum("mi,mj,mk,ml->ijkl", vectors, vectors, vectors, vectors)
    cubic[np.abs(cubic) < 1e-12] = 0.0  # exactly even in the second mode
    frequencies = np.array([1.0, 1.7])
    return ModalSystem(
        damping=frequencies / 100,
        stiffness=frequencies**2,
        cubic=cubic,
        direct=[1.0, 0.0],
        parametric=[0.2, 1.0],
    )


def test_doubled_branch_of_another_symmetry_class_is_followed_in_few_steps() -> None:
    diagram = explore(two_classes(), (3.0, 3.8), direct=0.05, parametric=0.12)
    one, two = diagram.points("PD", branch=0)
    (doubled,) = (b for b in diagram.branches if b.period_multiple == 2)
    assert doubled.ending == "bifurcation"
    assert {round(w, 6) for w in doubled.omega[[0, -1]]} == {round(p.omega, 6) for p in (one, two)}
    assert len(doubled) < FEW_POINTS
