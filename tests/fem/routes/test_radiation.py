"""What a frame of a given impedance takes out of a film, against films that end on dashpots."""

import numpy as np
import pytest
from scipy.special import iv, ivp, jv, jvp

from nanorom.errors import SceneError
from nanorom.fem.reduce import reduce_scene
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Disc, Rectangle, String
from nanorom.scene.load import Load
from nanorom.scene.material import Material
from nanorom.scene.scene import Accuracy, Modes, Scene
from nanorom.scene.support import Spring, Support

IMPEDANCE = 5e9  # N s/m^2: it gives way by 1e-12 of the film, so that the first order is exact
NITRIDE = {"youngs_modulus": "250 GPa", "poisson_ratio": 0.23, "density": "3100 kg/m^3"}
THICKNESS = 50e-9
MEMBRANE = 1e-8  # of Q: consistent forces converge as squares of the tolerance's shapes do
LAYERED = 1e-6  # of a film that bends in an edge layer
BEAM = 1e-9  # of polynomials in one dimension
SIDES = 1e-5  # of two meshes for frequencies to 1e-7, whose corners are not smooth


def film(geometry, model, tension, **changes):
    parts = {
        "geometry": geometry,
        "plate": Plate(thickness=THICKNESS, model=model),
        "material": Material(**NITRIDE),
        "tension": tension,
        "support": Support(impedance=IMPEDANCE),
        "modes": Modes(count=6),
        "accuracy": Accuracy(tolerance=1e-8),
    }
    return Scene(**parts | changes)


def radiated(scene):
    return reduce_scene(scene).losses["radiation"]


def rooted(function, start, *rest):
    """Complex root near a real one, by Newton's method with a difference quotient."""
    x, step = complex(start), 1e-7 * start
    for _ in range(20):
        value = function(x, *rest)
        x = x - value * step / (function(x + step, *rest) - value)
    return x


def inverse_quality(root):
    return 2 * abs(root.imag) / root.real


def test_round_membrane_on_dashpots_has_the_complex_frequencies_of_bessel_functions():
    """T w_r = -Z w_t at the rim of J_n(k r), for n = 0, 1, 2 and one circle."""
    radius, surface = 10e-6, 3100 * THICKNESS
    found = radiated(film(Disc(radius=radius), "membrane", Tension.isotropic(1.0)))
    ratio = 1j * IMPEDANCE / np.sqrt(surface)  # i Z c/T

    def at_rim(x, n):
        return jvp(n, x) / ratio + jv(n, x)

    zeros = [(0, 2.404825557695773), (1, 3.831705970207512), (2, 5.135622301840683)]
    exact = [inverse_quality(rooted(at_rim, x, n)) for n, x in [*zeros, (0, 5.520078110286311)]]
    assert found[[0, 1, 3, 5]] == pytest.approx(exact, rel=MEMBRANE)
    assert found[[2, 4]] == pytest.approx(found[[1, 3]], rel=MEMBRANE)


def clamped_disc(omega, tension, bending, surface, radius):
    """D (lap w)_r - T w_r - i omega Z w at the rim of a disc whose edge does not turn, n = 0."""
    half = tension / (2 * bending)
    root = np.sqrt(half**2 + surface * omega**2 / bending)
    a, b = np.sqrt(root - half), np.sqrt(root + half)
    share = a * jvp(0, a * radius) / (b * ivp(0, b * radius))  # J - share I: no slope
    w = jv(0, a * radius) - share * iv(0, b * radius)
    lap = -(a**3) * jvp(0, a * radius) - share * b**3 * ivp(0, b * radius)
    return bending * lap - 1j * omega * IMPEDANCE * w


def test_clamped_plate_under_tension_radiates_as_its_exact_solution_does():
    radius, tension = 10e-6, 0.05
    scene = film(Disc(radius=radius), "plate", Tension.isotropic(tension))
    model = reduce_scene(scene)
    bending = scene.material.bending_stiffness(THICKNESS)

    def at_rim(omega):
        return clamped_disc(omega, tension, bending, 3100 * THICKNESS, radius)

    for mode in (0, 5):
        omega = 2 * np.pi * model.frequency[mode]
        exact = inverse_quality(rooted(at_rim, omega))
        assert model.losses["radiation"][mode] == pytest.approx(exact, rel=LAYERED)


def hinged_beam(omega, odd, beam, end):
    """S w_x - E I w_xxx + end w at the ends of a beam that turn: cos b x + A cosh a x, or odd."""
    length, tension, bending, line = beam
    half = tension / (2 * bending)
    root = np.sqrt(half**2 + line * omega**2 / bending)
    a, b, x = np.sqrt(root + half), np.sqrt(root - half), length / 2
    if odd:
        w, rise, tangent = np.sin(b * x), b * np.cos(b * x), 1 / np.tanh(a * x)
    else:
        w, rise, tangent = np.cos(b * x), -b * np.sin(b * x), np.tanh(a * x)
    share = b**2 * w / a**2  # no moment
    first, third = rise + share * a * tangent, -(b**2) * rise + share * a**3 * tangent
    return tension * first - bending * third + end * (w + share)


@pytest.mark.parametrize("spring", [None, 3e5])
def test_beam_on_dashpots_radiates_as_its_exact_solution_does(spring):
    """Ends that turn, on dashpots or on springs that these hold."""
    length, width, tension = 100e-6, 0.5e-6, 5.0
    kind = "simply_supported" if spring is None else Spring(spring)
    support = Support({"left": kind, "right": kind}, impedance=IMPEDANCE)
    geometry = String(length=length, width=width)
    scene = film(geometry, "beam", Tension(x=tension, y=0.0), support=support)
    model = reduce_scene(scene.with_(modes=4))
    bending = width * 250e9 * THICKNESS**3 / 12
    beam = length, width * tension, bending, width * 3100 * THICKNESS

    def at_end(omega, odd):
        dashpot = 1j * omega * IMPEDANCE * width
        end = dashpot if spring is None else 1 / (1 / dashpot + 1 / (spring * width))
        return hinged_beam(omega, odd, beam, end) / abs(end)

    for mode, omega in enumerate(2 * np.pi * model.frequency):
        root = rooted(at_end, omega, mode % 2)
        assert root.real == pytest.approx(omega, rel=BEAM)
        assert model.losses["radiation"][mode] == pytest.approx(inverse_quality(root), rel=BEAM)


def test_narrow_plate_radiates_as_the_beam_does():
    """Poisson's ratio zero: a strip that is held at two ends is a beam."""
    material = Material(**NITRIDE | {"poisson_ratio": 0.0})
    support = Support({"left": "clamped", "right": "clamped"}, impedance=IMPEDANCE)
    string = String(length=20e-6, width=0.5e-6)
    tension = Tension(x=1.0, y=0.0)
    scene = film(string, "beam", tension, support=support, material=material).with_(modes=3)
    strip = scene.with_(plate=Plate(thickness=THICKNESS, model="plate"))
    assert radiated(strip) == pytest.approx(radiated(scene), rel=LAYERED)


def test_mirrors_and_meshes_do_not_change_what_is_radiated():
    """A clamped square cut at both mirrors, and one that a shear keeps whole."""
    scene = film(Rectangle(length=10e-6, width=8e-6), "plate", Tension(0.05, 0.04))
    scene = scene.with_(tolerance=1e-7)
    cut = radiated(scene)
    whole = radiated(scene.with_(tension=Tension(0.05, 0.04, 1e-12)))
    assert whole == pytest.approx(cut, rel=SIDES)


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"load": Load(pressure=1.0)}, "beside a load that deflects; allowed: films that are flat"),
        ({"plate": Plate(thickness=THICKNESS, model="shell")}, "beside plate.model = shell"),
        (
            {"support": Support("simply_supported", impedance=IMPEDANCE)},
            "simply supported or elastic sides, whose corners pull",
        ),
    ],
)
def test_frames_under_films_whose_pull_is_not_computed_are_refused(changes, match):
    with pytest.raises(SceneError, match=f"support.impedance: found .*{match}"):
        film(Rectangle(length=10e-6, width=8e-6), "plate", Tension(0.05, 0.04), **changes)


def test_ends_of_a_string_stay_held_beside_an_impedance():
    text = film(String(length=20e-6, width=5e-7), "beam", Tension(1.0, 0.0)).to_toml()
    tables = text.replace('edge = "clamped"', "")
    assert "impedance" in tables
    assert Scene.from_toml(tables).support.named == {"left": "clamped", "right": "clamped"}
