"""Static load cases against closed forms: indentation, Hencky's limit, relaxation, snap-through."""

import numpy as np
import pytest
from mpi4py import MPI
from scipy.special import i0, i1, k0, k1

from nanorom.errors import SolverError
from nanorom.fem.mesh import mesh
from nanorom.fem.mesh.shapes import Grid
from nanorom.fem.models import coupled
from nanorom.fem.models.plate import Plate
from nanorom.fem.models.state import State, Stiffness
from nanorom.fem.modes import coupled as coupled_modes
from nanorom.fem.statics import loads
from nanorom.fem.statics import path as loadpath
from tests.fem.drums import NU, centre, drum
from tests.fem.radial import Disc

ROUND_OFF = 1e-9


def indent(plate, forces):
    """Deflections under a point force at the centre."""
    state = coupled.Film(plate)
    load = loads.patch(state, np.zeros(2), 0.0)
    points = loadpath.load_steps(loads.problem(state, load), forces)
    return np.array([centre(plate, state) for _ in points])


def linear_compliance(bending):
    """w(0)/F of a clamped disc with T = R = 1 under a point force at its centre.

    From w = F/(2 pi T) (-K0(b r) - ln r + a + c I0(b r)), b = sqrt(T/D), w = w' = 0 at the edge.
    """
    b = 1 / np.sqrt(bending)
    c = (1 / b - k1(b)) / i1(b)
    return (np.log(b / 2) + np.euler_gamma + k0(b) + c * (1 - i0(b))) / (2 * np.pi)


CENTRED = (0.02, 0.12, 0.45, 1.0)


def test_indentation_is_linear_first():
    bending = 0.05
    plate = drum(bending, radii=CENTRED)
    w = indent(plate, [1e-4])
    assert w[0] / 1e-4 == pytest.approx(linear_compliance(bending), rel=1e-5)


def test_deep_indentation_of_a_membrane_is_schwerins_cubic_law():
    """F = pi/3 E h w^3/R^2 exactly at nu = 1/3, where w = w(0) (1 - (r/R)^(2/3)).

    Schwerin (1929); the same as F = q^3 E h w^3/R^2 with q = 1/(1.05 - 0.15 nu - 0.16 nu^2) (Lee
    et al. 2008, doi:10.1126/science.1157996) to 0.8 %.
    """
    plate = drum(0.0, radii=(2e-3, 0.02, 0.12, 0.45, 1.0), nu=1 / 3)
    force = 1e5
    w = indent(plate, np.geomspace(0.1, force, 7))
    assert force / w[-1] ** 3 == pytest.approx(np.pi / 3, rel=2e-3)


def test_indentation_turns_from_linear_to_cubic():
    """F = k1 w + k3 w^3 (Lee et al. 2008) with the two limits' stiffnesses, within its accuracy."""
    bending = 0.01
    plate = drum(bending, radii=CENTRED, nu=1 / 3)
    forces = np.array([0.01, 0.3, 3.0, 30.0, 1000.0])
    w = indent(plate, forces)
    law = w / linear_compliance(bending) + np.pi / 3 * w**3
    assert law == pytest.approx(forces, rel=0.2)  # an interpolation, worst in between
    assert law[0] == pytest.approx(forces[0], rel=5e-3)
    slope = np.diff(np.log(forces)) / np.diff(np.log(w))
    assert slope[0] == pytest.approx(1.0, abs=0.05)
    assert slope[-1] > 2.6
    assert np.all(np.diff(slope) > 0)


def test_hencky_limit_of_a_pressurised_membrane():
    """w(0) (E h/(p R^4))^(1/3) tends to Hencky's coefficient as p grows.

    Hencky's series (1915; corrected by Fichter 1997, NASA TP 3658): with
    w = (p R^4/(E h))^(1/3) sum a_2n (1 - (r/R)^(2n+2)), b0 solves the edge condition.
    """
    nu = 0.3
    plate = drum(0.0, nu=nu)
    state = coupled.Film(plate)
    problem = loads.problem(state, loads.pressure(state))
    last = 1e6
    for _ in loadpath.load_steps(problem, [1e2, 1e4, last]):
        pass
    assert centre(plate, state) / np.cbrt(last) == pytest.approx(hencky(nu), rel=1e-3)


def hencky(nu, terms=40):
    """Hencky's coefficient w(0) (E h/(p R^4))^(1/3), by his power series.

    N_r = (p^2 R^2 E h)^(1/3)/4 sum b_2n rho^2n obeys N^2 (rho N'' + 3 N') = -8 rho in that scale;
    at the edge u = 0: (1 - nu) N + rho N' = 0.
    """
    from scipy.optimize import brentq

    def series(b0):
        # 4 n (n + 1) b_n = -8 [1/b^2]_(n-1) in powers of rho^2
        b = np.zeros(terms)
        b[0] = b0
        inverse = np.zeros(terms)
        square = np.zeros(terms)
        for n in range(terms):
            if n > 0:
                b[n] = -8 * inverse[n - 1] / (4 * n * (n + 1))
            square[n] = b[: n + 1] @ b[n::-1]
            unit = 1.0 if n == 0 else 0.0
            inverse[n] = (unit - square[1 : n + 1] @ inverse[:n][::-1]) / square[0]
        return b

    def edge(b0):
        b = series(b0)
        return np.sum(((1 - nu) + 2 * np.arange(terms)) * b)

    b = series(brentq(edge, 1.4, 3.0))
    # w' = -p r/(2 N_r): w(0) = 2 int rho / sum b rho^2n
    x, weight = np.polynomial.legendre.leggauss(60)
    rho = (x + 1) / 2
    return float(np.sum(weight / 2 * 2 * rho / np.polynomial.polynomial.polyval(rho**2, b)))


def strip(length, width, n_x, n_y, nu, free, degree=6):
    """A string along x under unit isotropic stress, clamped at its ends."""
    lines = (side / 2 * np.linspace(-1, 1, n + 1) for side, n in ((length, n_x), (width, n_y)))
    domain = mesh.build(MPI.COMM_WORLD, Grid(*map(tuple, lines)))
    sides = ["left", "right"] + ([] if free else ["bottom", "top"])
    return Plate.on(domain, degree, sides, stiffness=Stiffness(bending=1e-4, poisson_ratio=nu))


def test_released_string_keeps_the_uniaxial_part_of_its_stress():
    """Far from its ends N_x = (1 - nu) N0 and N_y = 0: frequencies of a string of that tension."""
    nu, length = 0.25, 20.0
    plate = strip(length, 1.0, 12, 1, nu, free=True)
    state = coupled.Film(plate)
    problem = loads.problem(state, None)
    problem.solve(0.0)
    relaxed = state.about()
    assert relaxed.state.shape is None  # it stays flat
    modes = coupled_modes.solve(relaxed, 1)
    frequency = np.sqrt(modes.eigenvalues[0])
    # the ends hold the width: a stiffer piece of about half a width each, of order width/length
    assert frequency == pytest.approx(np.pi / length * np.sqrt(1 - nu), rel=0.02)


def test_relaxation_leaves_a_held_film_as_it_is():
    plate = strip(2.0, 1.0, 2, 1, 0.25, free=False)
    state = coupled.Film(plate)
    loads.problem(state, None).solve(0.0)
    assert np.abs(state.state.x.array).max() < ROUND_OFF


def dome(height):
    """A clamped paraboloid cap without tension; pressure acts towards its flat side."""
    plate = drum(0.01)
    shape = plate.shape_of(lambda x: -height * (1 - x[:, 0] ** 2 - x[:, 1] ** 2))
    return plate.about(State(tension=(0.0, 0.0), shape=shape))


def test_shallow_dome_snaps_through_and_is_stable_again():
    """The path rises, falls while it is unstable, and rises again with the dome inverted."""
    plate = dome(1.0)
    state = coupled.Film(plate)
    problem = loads.problem(state, loads.pressure(state))
    limit = loadpath.limit_point(problem, 0.1)
    state.state.x.array[:] = 0.0
    problem.magnitude.value = 0.0
    path = []
    for point in loadpath.arc_length(problem, 2 * limit.magnitude, 0.1):
        path.append((point.magnitude, point.stable, centre(plate, state)))
    load, stable, deflection = np.array(path).T
    assert np.all(np.diff(deflection) > 0)
    falling = np.diff(load) < 0
    assert falling.any()
    assert not stable[1:][falling][1:-1].any()
    assert stable[0] and stable[-1]
    assert load[: np.argmax(falling) + 1].max() <= limit.magnitude * (1 + ROUND_OFF)
    assert deflection[-1] > 1.5  # inverted


def test_load_that_cannot_be_borne_says_how_far_it_came():
    gap = 0.5
    plate = drum(0.0, degree=5)
    state = coupled.Film(plate)
    load = loads.gate(state, gap)
    problem = loads.problem(state, load)
    pull_in = loadpath.limit_point(problem, 0.02).magnitude
    state.state.x.array[:] = 0.0
    problem.magnitude.value = 0.0
    steps = loadpath.load_steps(problem, [2 * pull_in], lambda _: loads.admissible(state, load))
    with pytest.raises(SolverError, match="stopped at load") as stopped:
        list(steps)
    reached = float(str(stopped.value).split("at load ")[1].split()[0])
    assert reached == pytest.approx(pull_in, rel=1e-3)


def test_initial_shape_is_a_deflected_state_without_its_stress():
    """Pressing a dome flat and a flat film into a dome store the same stretching energy."""
    plate = drum(0.0, radii=(0.5, 1.0))
    reference = Disc(1.0, 0.0, NU)
    reference.solve(5.0)
    assert reference.centre() > 0
    flat = plate.shape_of(lambda x: 0 * x[:, 0])
    state = coupled.Film(plate.about(State(shape=flat)))
    load = loads.pressure(state)
    for _ in loadpath.load_steps(loads.problem(state, load), [5.0]):
        assert centre(plate, state) == pytest.approx(reference.centre(), rel=1e-6)


def test_load_steps_are_bounded(monkeypatch):
    """A drum under a pressure of which it cannot bear much at once."""
    monkeypatch.setattr(loadpath, "MOST_STEPS", 3)
    state = coupled.Film(drum(0.0, degree=5))
    problem = loads.problem(state, loads.pressure(state))
    with pytest.raises(SolverError, match=r"still at load .* of 1e\+12 after 3 steps"):
        list(loadpath.load_steps(problem, [1e12]))
