"""Annuli with one free rim against their characteristic equations, high modes too."""

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import iv, ivp, jv, jvp, kv, kvp, yv, yvp

import nanorom
from nanorom.fem.mesh.gmsh import MESHES
from nanorom.scene.scene import Accuracy, Material, MeshFile, Modes, Plate, Scene, Support

INNER, OUTER = 0.4, 1.0  # of the file
NU, H = 0.3, 0.01
D = H**3 / 12 / (1 - NU**2)
COUNT, TOLERANCE = 12, 1e-5
RATIO, ROUNDING = 3.0, 1e-11  # of a true error to the told one, and beside it
KINDS = (jv, jvp, -1), (yv, yvp, -1), (iv, ivp, 1), (kv, kvp, 1)  # their Laplacians by k^2
GRID, DIAMETERS = np.linspace(0.3, 22, 800), 14


def determinant(k, p, clamped, free):
    """Of w and w' at the clamped rim and of moment and force at the free one, by column.

    w'' + nu (w'/r - p^2 w/r^2) and (lap w)' - (1 - nu) p^2/r^2 (w' - w/r) (Leissa, Vibration of
    Plates, 1969, section 2.2).
    """
    columns = []
    for value, slope, sign in KINDS:
        w, d1, d2 = value(p, k * free), k * slope(p, k * free), k**2 * slope(p, k * free, 2)
        moment = d2 + NU * (d1 / free - p**2 * w / free**2)
        force = sign * k**2 * d1 - (1 - NU) * p**2 / free**2 * (d1 - w / free)
        rim = value(p, k * clamped), slope(p, k * clamped)
        column = np.array([*rim, moment / k**2, force / k**3])
        columns.append(column / np.abs(column).max())
    return np.linalg.det(np.column_stack(columns))


def exact(clamped, free):
    """The lowest angular frequencies (COUNT,), pairs twice; rho = 1."""
    found = []
    for p in range(DIAMETERS):
        values = np.array([determinant(k, p, clamped, free) for k in GRID])
        for i in np.flatnonzero(values[:-1] * values[1:] < 0):
            root = brentq(determinant, *GRID[i : i + 2], args=(p, clamped, free), xtol=1e-14)
            found += [root] * (2 if p else 1)
    return np.sort(found)[:COUNT] ** 2 * np.sqrt(D / H)


@pytest.mark.parametrize(("held", "radii"), [("outer", (OUTER, INNER)), ("inner", (INNER, OUTER))])
def test_annuli_with_a_free_rim_have_their_exact_frequencies(held, radii):
    model = nanorom.reduce(
        Scene(
            geometry=MeshFile(MESHES / "annulus.geo", scale=1.0),
            plate=Plate(thickness=H, model="plate"),
            material=Material(1.0, NU, 1.0),
            support=Support({"outer": "free", "inner": "free"} | {held: "clamped"}),
            modes=Modes(count=COUNT),
            accuracy=Accuracy(tolerance=TOLERANCE),
        )
    )
    error = np.abs(2 * np.pi * model.frequency / exact(*radii) - 1).max()
    assert error < RATIO * model.diagnostics["error_frequency"] + ROUNDING
    assert model.diagnostics["error_frequency"] < TOLERANCE
