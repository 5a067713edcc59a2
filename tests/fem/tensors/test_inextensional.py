"""Films that bend without stretching: von Karman's theory is out of its range, and this is told."""

import numpy as np
import pytest
from numpy.polynomial import legendre
from scipy.optimize import brentq

import nanorom
from nanorom import Drive, Material, Modes, Plate, Rectangle, Scene, Support, Sweep
from nanorom.errors import AccuracyWarning, ModelError
from nanorom.scene.scene import Accuracy

LENGTH, WIDTH, THICKNESS, MODULUS = 100e-6, 10e-6, 0.2e-6, 250e9
SAME = 1e-6


def ribbon(edge, nu):
    return Scene(
        geometry=Rectangle(LENGTH, WIDTH),
        plate=Plate(THICKNESS, model="plate"),
        material=Material(MODULUS, nu, 3000),
        support=Support(edge=edge),
        modes=Modes(count=1),
        accuracy=Accuracy(degree=6, mesh_size=10e-6),
    )


def curvature_of_a_beam():
    """2 E I int phi''^2 phi'^2 of a cantilever's first mode, 1 at its tip."""
    k = brentq(lambda k: np.cos(k) + 1 / np.cosh(k), 1.5, 2.2, xtol=1e-15)
    ratio = (np.cosh(k) + np.cos(k)) / (np.sinh(k) + np.sin(k))
    s, weight = legendre.leggauss(60)
    x, weight = k * (s + 1) / 2, weight / 2
    first = k * (np.sinh(x) + np.sin(x) - ratio * (np.cosh(x) - np.cos(x))) / 2
    second = k**2 * (np.cosh(x) + np.cos(x) - ratio * (np.sinh(x) + np.sin(x))) / 2
    stiffness = MODULUS * WIDTH * THICKNESS**3 / 12
    return 2 * stiffness / LENGTH**5 * np.sum(weight * (first * second) ** 2)


def test_a_cantilever_is_told_with_its_two_stiffnesses_and_has_no_response():
    with pytest.warns(AccuracyWarning, match="bends without stretching.*4.3e.05 N/m.3.*9.9e.04"):
        model = nanorom.reduce(ribbon({"left": "clamped"}, 0.23))
    drive, sweep = Drive(direct=1e-3), Sweep(start=1e4, stop=2e4)
    with pytest.raises(ModelError, match="von Karman's theory is out of its range"):
        nanorom.respond(model.with_damping(nanorom.Damping(quality_factor=100)), drive, sweep)


def test_the_curvature_of_a_narrow_cantilever_is_that_of_a_beam():
    with pytest.warns(AccuracyWarning, match="bends without stretching"):
        model = nanorom.reduce(ribbon({"left": "clamped"}, 0.0))
    found = model.diagnostics["curvature_ratio"] * model.cubic[0, 0, 0, 0]
    assert found == pytest.approx(curvature_of_a_beam(), rel=SAME)


def test_a_film_that_is_held_has_next_to_no_curvature_stiffness():
    model = nanorom.reduce(ribbon({"left": "clamped", "right": "clamped"}, 0.23))
    assert model.diagnostics["curvature_ratio"] < 1e-3
