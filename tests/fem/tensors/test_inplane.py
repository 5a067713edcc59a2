"""Resonances in the film's own plane: found, told of, and refused where they meet the modes."""

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import jv, jvp

from nanorom.errors import AccuracyWarning, SolverError
from nanorom.exact import cases
from nanorom.scene.scene import Scene
from nanorom.workflow import reduce

RITZ = 1.75  # a bound from above, from the modes' own products
MODULUS, DENSITY, LENGTH = 250e9, 3100.0, 100e-6


def in_plane_frequency_of_a_disc(film):
    """Lowest in-plane frequency of a disc held at its edge, by its Helmholtz potentials."""
    shear = film.modulus / (2 * (1 + film.nu))
    ratio = np.sqrt((1 - film.nu) / 2)  # of the velocities of shear and of stretching

    def determinant(k, n):
        a = ratio * k
        return n**2 * jv(n, a) * jv(n, k) - a * k * jvp(n, a) * jvp(n, k)

    lowest = np.inf
    grid = np.linspace(0.5, 8, 400)
    for n in range(4):
        values = determinant(grid, n)
        first = np.flatnonzero(values[:-1] * values[1:] < 0)[0]
        lowest = min(lowest, brentq(determinant, grid[first], grid[first + 1], args=(n,)))
    return lowest * np.sqrt(shear / cases.DENSITY) / (2 * np.pi * film.radius)


@pytest.mark.parametrize(("method", "highest"), [("direct", 1.4), ("step", RITZ)])
def test_in_plane_frequency_is_a_bound_on_the_exact_one_of_a_disc(method, highest):
    model = reduce(cases.drum(100.0, 6).scene.with_(method=method, tolerance=1e-4))
    found = model.diagnostics["in_plane_frequency"]
    assert 1 <= found / in_plane_frequency_of_a_disc(cases.Film()) < highest


def string(count, stress, model="auto"):
    thickness = 100 if model == "beam" else 20  # nm
    return Scene.from_toml(
        f"""
        [geometry]
        shape = "string"
        length = {LENGTH}
        width = "3 um"
        [plate]
        thickness = "{thickness} nm"
        model = "{model}"
        [material]
        youngs_modulus = {MODULUS}
        poisson_ratio = 0.23
        density = {DENSITY}
        [tension]
        x = "{thickness * stress} N/m"
        y = 0
        [support]
        edge = {{ left = "clamped", right = "clamped", bottom = "free", top = "free" }}
        [modes]
        count = {count}
        """
        + ("" if model == "beam" else '[accuracy]\ndegree = 4\nmesh_size = "10 um"')
    )


def test_in_plane_frequency_of_a_string_is_that_of_its_longitudinal_waves():
    wave = np.sqrt(MODULUS / DENSITY) / (2 * LENGTH)
    found = reduce(string(3, 1.0)).diagnostics["in_plane_frequency"]
    assert 1 <= found / wave < RITZ
    assert reduce(string(3, 1.0, "beam")).diagnostics["in_plane_frequency"] == pytest.approx(wave)


@pytest.mark.parametrize(("model", "stress"), [("auto", 15.0), ("beam", 5.0)])
def test_modes_near_the_in_plane_resonances_are_warned_of_and_beyond_them_refused(model, stress):
    near = string(3, stress, model)
    beyond = string(6, 20.0, model) if model == "beam" else string(8, 200.0, model)
    with pytest.warns(AccuracyWarning, match=r"in-plane .* coefficients by \d\d+% there; ask"):
        reduce(near)
    with pytest.raises(SolverError, match=r"in-plane resonances begin at \S+ Hz .* fewer of them"):
        reduce(beyond)


def test_nothing_is_told_of_a_plane_that_is_held_fixed():
    model = reduce(cases.drum(100.0, 1).scene.with_(in_plane="fixed", tolerance=1e-3))
    assert "in_plane_frequency" not in model.diagnostics
