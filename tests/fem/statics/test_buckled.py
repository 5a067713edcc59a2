"""A film that is compressed beyond its critical tension has two states: one is expanded about."""

import numpy as np
import pytest
from numpy.polynomial import Legendre, Polynomial
from scipy.linalg import eigh

import nanorom
from nanorom.errors import SolverError
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Disc, String
from nanorom.scene.load import Load
from nanorom.scene.material import Material
from nanorom.scene.scene import Accuracy, Modes, Scene
from nanorom.scene.support import Support
from tests.fem.radial import Disc as Radial

H = 0.01
D = H**3 / 12  # E = 1, nu = 0: a strip bends as a beam, exactly
CRITICAL = 4 * np.pi**2 * D  # of a clamped strip of length 1
TOLERANCE = 1e-5


class Strip:
    """A clamped strip of length 1 by Ritz' method: (1 - s^2)^2 s^n, s = 2 x - 1, per width."""

    def __init__(self, tension, pressure, count=22):
        s, weights = np.polynomial.legendre.leggauss(60)
        self.weights = weights / 2
        edge = Polynomial([1, 0, -2, 0, 1])
        shapes = [edge * Legendre.basis(n).convert(kind=Polynomial) for n in range(count)]
        self.middle = np.array([shape(0.0) for shape in shapes])
        self.value, self.slope, self.curvature = (
            np.array([2**k * shape.deriv(k)(s) if k else shape(s) for shape in shapes])
            for k in range(3)
        )
        self.bending = D * (self.curvature * self.weights) @ self.curvature.T
        self.stretched = (self.slope * self.weights) @ self.slope.T
        self.mass = H * (self.value * self.weights) @ self.value.T
        self.load = pressure * self.value @ self.weights
        self.tension = tension

    def state(self, side):
        """Amplitudes of the stable state on a side, by Newton's method from the buckled shape."""
        s = np.polynomial.legendre.leggauss(60)[0]
        size = side * np.sqrt(max(-self.tension - CRITICAL, 0.0) / H) / np.pi  # half of 1 - cos
        shape = size * (1 + np.cos(np.pi * s))
        root = np.sqrt(self.weights)
        a = np.linalg.lstsq((self.value * root).T, shape * root, rcond=None)[0]
        for _ in range(50):
            stiffness = self.stiffness(a)
            force = self.bending @ a + self.force(a) * self.stretched @ a - self.load
            step = np.linalg.solve(stiffness, force)
            a = a - step
        assert np.abs(step).max() < 1e-12 * np.abs(a).max()
        return a

    def force(self, a):
        """Membrane force: that of the tension and of stretching, constant along the strip."""
        return self.tension + H / 2 * a @ self.stretched @ a

    def stiffness(self, a):
        along = self.stretched @ a
        return self.bending + self.force(a) * self.stretched + H * np.outer(along, along)

    def found(self, side, count=2):
        """Deflection at the centre and frequencies about the state on a side."""
        a = self.state(side)
        values = eigh(self.stiffness(a), self.mass, eigvals_only=True)
        assert values[0] > 0
        return self.middle @ a, np.sqrt(values[:count]) / (2 * np.pi)


def strip(tension, pressure, **changes):
    fields = {
        "geometry": String(length=1.0, width=0.2),
        "plate": Plate(thickness=H, model="plate"),
        "material": Material(youngs_modulus=1.0, poisson_ratio=0.0, density=1.0),
        "tension": Tension(tension, 0.0),
        "support": Support({"left": "clamped", "right": "clamped"}),
        "load": Load(pressure=pressure),
        "modes": Modes(count=1),
        "accuracy": Accuracy(degree=8, mesh_size=0.25),  # nothing is singular without nu
    }
    return Scene(**fields | changes)


def test_ritz_strip_buckles_as_euler_says():
    """Without a load w = c (1 - cos 2 pi x), the membrane force stays critical."""
    free = Strip(-2 * CRITICAL, 0.0)
    a = free.state(1.0)
    assert free.force(a) == pytest.approx(-CRITICAL, rel=1e-10)
    exact = 2 * np.sqrt(CRITICAL / H) / np.pi
    assert free.found(1.0)[0] == pytest.approx(exact, rel=1e-10)


def test_buckled_strip_under_a_small_load_is_the_beams():
    tension, pressure = -2 * CRITICAL, 1e-3 * D
    exact = Strip(tension, pressure)
    model = nanorom.reduce(strip(tension, pressure))
    centre, frequency = exact.found(1.0)
    assert float(model.static["centre_deflection"]) == pytest.approx(centre, rel=TOLERANCE)
    assert model.frequency[0] == pytest.approx(frequency[0], rel=TOLERANCE)
    other = float(model.static["other_deflection"])
    assert other == pytest.approx(exact.found(-1.0)[0], rel=TOLERANCE)
    assert other < 0 < centre


# -- clamped disc, E h = rho h = 1, against a spectral solution in r -------------------------------

NU = 0.3
PLATE = H**2 / 12 / (1 - NU**2)  # its bending stiffness
BUCKLING = 14.681970642 * PLATE  # square of the first root of J1, by D/R^2


def drum(times, pressure):
    return Scene(
        geometry=Disc(radius=1.0),
        plate=Plate(thickness=H, model="plate"),
        material=Material(1 / H, NU, 1 / H),
        tension=Tension(-times * BUCKLING),
        load=Load(pressure=pressure),
        modes=Modes(count=1),
        accuracy=Accuracy(tolerance=TOLERANCE),
    )


def radial(times, pressure, side):
    """Centre and lowest frequency of the state that is left when a load from one side falls."""
    disc = Radial(-times * BUCKLING, PLATE, NU, count=24)
    disc.a[0] = side * H  # of the first function, (1 - r^2)^2
    for load in (side * 1e-4, side * 1e-5, pressure):
        disc.solve(pressure=load)
    return float(disc.centre()), np.sqrt(disc.eigenvalues(0, 1)[0]) / (2 * np.pi)


@pytest.mark.parametrize("times", [1.1, 3.0])
def test_buckled_drum_is_expanded_about_the_side_to_which_its_load_pushes(times):
    pressure = -1e-10
    model = nanorom.reduce(drum(times, pressure))
    centre, frequency = radial(times, pressure, -1.0)
    assert centre < 0
    assert float(model.static["centre_deflection"]) == pytest.approx(centre, rel=TOLERANCE)
    assert model.frequency[0] == pytest.approx(frequency, rel=TOLERANCE)
    other = radial(times, pressure, 1.0)[0]
    assert float(model.static["other_deflection"]) == pytest.approx(other, rel=TOLERANCE)


def test_a_load_beyond_snapping_leaves_one_state():
    pressure = 1e-5
    model = nanorom.reduce(drum(1.1, pressure))
    centre, frequency = radial(1.1, pressure, 1.0)
    assert "other_deflection" not in model.static
    assert float(model.static["centre_deflection"]) == pytest.approx(centre, rel=TOLERANCE)
    assert model.frequency[0] == pytest.approx(frequency, rel=TOLERANCE)


def test_without_a_load_the_remedy_is_told():
    with pytest.raises(SolverError, match="small load"):
        nanorom.reduce(strip(-2 * CRITICAL, 0.0, load=None))
