"""Films that the stress of their layers bows: closed forms, von Karman's equations of a disc."""

import numpy as np
import pytest
from mpi4py import MPI
from scipy.integrate import solve_bvp

from nanorom.fem.fields import places
from nanorom.fem.mesh import mesh
from nanorom.fem.mesh.shapes import Grid
from nanorom.fem.models.coupled import Film
from nanorom.fem.models.plate import Plate
from nanorom.fem.models.state import State, Stiffness
from nanorom.fem.reduce import reduce_scene
from nanorom.fem.statics import loads
from nanorom.scene.layers import Layer, Stack
from nanorom.scene.scene import Scene

TOLERANCE = 1e-6
SAINT_VENANT = 1e-4  # what is left of the clamped end, three widths from it
START = 1e-3  # of the radius: nearer to the centre slopes are linear
RADIUS, H, E, NU = 10e-6, 100e-9, 160e9, 0.25

DISC = """
[geometry]
shape = "disc"
radius = "10 um"
[support]
edge = "simply_supported"
[[layer]]
thickness = "50 nm"
youngs_modulus = "160 GPa"
poisson_ratio = 0.25
density = 2330
stress = {below}
[[layer]]
thickness = "50 nm"
youngs_modulus = "160 GPa"
poisson_ratio = 0.25
density = 2330
stress = {above}
[modes]
count = 1
[accuracy]
tolerance = 1e-4
"""


def bowed(stress):
    return reduce_scene(Scene.from_toml(DISC.format(below=-stress, above=stress)))


def deflection(moment):
    """Of a disc's centre by von Karman's equations in slope and radial force (Foeppl's form).

    D (r p'' + p' - p/r) = s p, r s'' + s' - s/r = -E h p^2/2 with p = w', s = r N; at the edge
    D (p' + nu p) = m and no displacement.  In units of the radius, h and D: s by D, p by h.
    """
    stretch = 12 * (1 - NU**2)  # E h by D/h^2

    def slopes(r, y):
        p, dp, s, ds = y
        return [dp, (s * p - dp + p / r) / r, ds, (-stretch * p**2 / 2 - ds + s / r) / r]

    def edges(a, b):
        rim = b[1] + NU * b[0] - moment, b[3] - NU * b[2]
        return [a[0] - START * a[1], a[2] - START * a[3], *rim]

    r = np.linspace(START, 1, 200)
    guess = np.zeros((4, len(r)))
    guess[0], guess[1] = moment / (1 + NU) * r, moment / (1 + NU)
    found = solve_bvp(slopes, edges, r, guess, tol=1e-8, max_nodes=100_000)
    assert found.success
    x, weights = np.polynomial.legendre.leggauss(200)
    return -(1 - START) * found.sol(START + (1 - START) * (x + 1) / 2)[0] @ weights / 2


def test_a_released_bilayer_disc_bows_as_its_closed_form_says():
    """w = -m (R^2 - r^2)/(2 D (1 + nu)): stretched above, it is a bowl."""
    moment = 1e4 * H**2 / 4
    exact = -moment * RADIUS**2 * 12 * (1 - NU**2) / (2 * E * H**3 * (1 + NU))
    assert float(bowed(1e4).static["centre_deflection"]) == pytest.approx(exact, rel=TOLERANCE)


def test_a_disc_that_bows_by_its_thickness_meets_von_karman_s_equations():
    stress = 2e7
    bending = E * H**3 / (12 * (1 - NU**2))
    exact = H * deflection(stress * H**2 / 4 * RADIUS**2 / (bending * H))
    assert abs(exact) > H / 2
    found = float(bowed(stress).static["centre_deflection"])
    assert found == pytest.approx(exact, rel=10 * TOLERANCE)


def test_a_released_strip_has_the_curvature_of_timoshenko_s_bimetal():
    """Timoshenko 1925, eq. 4, doi:10.1364/JOSA.11.000233, of a strain mismatch."""
    (h1, e1), (h2, e2) = (1e-7, 160e9), (0.4e-7, 70e9)
    mismatch, ratio, stiff = 1e-6, h1 / h2, e1 / e2
    h = h1 + h2
    shape = 3 * (1 + ratio) ** 2 + (1 + ratio * stiff) * (ratio**2 + 1 / (ratio * stiff))
    exact = 6 * mismatch * (1 + ratio) ** 2 / (h * shape)
    upper = Layer(h2, e2, 0.0, 1000.0, stress=e2 * mismatch)
    stack = Stack.of([Layer(h1, e1, 0.0, 1000.0), upper])
    length, known = 10e-6, stack.film()["material"]
    domain = mesh.build(MPI.COMM_SELF, Grid(tuple(np.linspace(0, 1, 7)), (-0.1, 0.0, 0.1)))
    stiffness = Stiffness(bending=1.0, stretching=1e4)
    plate = Plate.on(domain, 4, ["left"], stiffness=stiffness, state=State((0.0, 0.0)))
    film = Film(plate)
    loads.problem(film, loads.moment(film, stack.moment * length / known.bending)).solve(1.0)
    w = places.evaluate(plate, film.deflection(), np.array([[1.0, 0], [0.9, 0], [0.8, 0]]))
    curvature = (w[0] - 2 * w[1] + w[2]) / 0.01 / length
    assert curvature == pytest.approx(exact, rel=SAINT_VENANT)


def test_a_clamped_bilayer_stays_flat():
    text = DISC.format(below=-1e6, above=1e6).replace("simply_supported", "clamped")
    assert reduce_scene(Scene.from_toml(text)).static == {}
