"""The one-dimensional beam against closed forms."""

import numpy as np
import pytest
from scipy.optimize import brentq

from nanorom.errors import SceneError, SolverError
from nanorom.fem.models.beam import Beam, modes
from nanorom.fem.reduce import reduce_scene
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Disc, String
from nanorom.scene.material import Material
from nanorom.scene.scene import Modes, Scene
from nanorom.scene.support import Support

EXACT = 1e-10


def test_string_has_harmonic_frequencies_and_b111():
    length, axial, tension, mass = 3e-4, 2.0, 1e-5, 4e-9
    found = modes(Beam(length, axial, 0.0, tension, mass), 5)
    n = np.arange(1, 6)
    exact = n / (2 * length) * np.sqrt(tension / mass)
    assert found.frequency == pytest.approx(exact, rel=EXACT)
    assert found.mass == pytest.approx(np.full(5, mass * length / 2), rel=EXACT)
    # E A/(2 L) (int phi'^2)^2 with phi = sin(n pi x/L)
    b = axial / (2 * length) * ((n * np.pi / length) ** 2 * length / 2) ** 2
    assert np.einsum("iiii->i", found.cubic) == pytest.approx(b, rel=EXACT)


def clamped_wavenumbers(count):
    """Roots of cos(k) cosh(k) = 1 of a clamped beam without tension."""
    guess = (np.arange(1, count + 1) + 0.5) * np.pi
    return np.array([brentq(lambda k: np.cos(k) - 1 / np.cosh(k), g - 0.5, g + 0.5) for g in guess])


def test_clamped_beam_without_tension_has_the_classical_roots():
    found = modes(Beam(1.0, 1.0, 1.0, 0.0, 1.0), 6)
    k = clamped_wavenumbers(6)
    assert 2 * np.pi * found.frequency == pytest.approx(k**2, rel=EXACT)
    assert found.stiffness == pytest.approx(np.diag(np.diag(found.stiffness)), abs=1e-6)


def test_simply_supported_beam_under_tension_is_exact():
    tension, bending = 40.0, 0.3
    beam = Beam(2.0, 1.0, bending, tension, 1.5, ("simply_supported", "simply_supported"))
    k = np.arange(1, 5) * np.pi / 2.0
    exact = np.sqrt((tension * k**2 + bending * k**4) / 1.5)
    assert 2 * np.pi * modes(beam, 4).frequency == pytest.approx(exact, rel=EXACT)


def test_clamped_beam_under_tension_meets_its_characteristic_equation():
    tension, bending = 2000.0, 1.0  # a layer of 2 % of the length
    omega = 2 * np.pi * modes(Beam(1.0, 1.0, bending, tension, 1.0), 3).frequency
    s = np.sqrt((tension / 2) ** 2 + omega**2)
    a, b = np.sqrt(s + tension / 2), np.sqrt(s - tension / 2)
    # 2 a b (1 - cosh a cos b) + (a^2 - b^2) sinh a sin b = 0, divided by cosh a
    residual = 2 * a * b * (1 / np.cosh(a) - np.cos(b)) + (a**2 - b**2) * np.tanh(a) * np.sin(b)
    slope = (a**2 - b**2) * np.cos(b) * np.tanh(a) + 2 * a * b * np.sin(b)
    assert np.abs(residual / slope / b).max() < EXACT


def test_cubic_tensor_is_fully_symmetric():
    cubic = modes(Beam(1.0, 3.0, 0.1, 5.0, 1.0, ("clamped", "simply_supported")), 4).cubic
    for axes in ((1, 0, 2, 3), (3, 1, 2, 0), (0, 2, 1, 3)):
        assert cubic == pytest.approx(cubic.transpose(axes), rel=1e-14)


def test_layers_of_a_thousandth_of_the_length_are_resolved():
    """A membrane's string but for the layer's width at each end, to first order."""
    layer, m = 4.56e-4, np.arange(1, 11)
    found = modes(Beam(1.0, 1.0, layer**2, 1.0, 1.0), 10)
    series = m * (1 + 2 * layer + 4 * layer**2 + (np.pi * m * layer) ** 2 / 2)
    assert 2 * found.frequency == pytest.approx(series, rel=1e-6)


def test_buckled_beam_is_refused():
    with pytest.raises(SolverError, match="buckling"):
        modes(Beam(1.0, 1.0, 1.0, -5 * np.pi**2, 1.0), 1)


def string_scene(width, model, **changes):
    given = {
        "geometry": String(length="100 um", width=width),
        "plate": Plate(thickness="100 nm", model=model),
        "material": Material(youngs_modulus="250 GPa", poisson_ratio=0.0, density="3100 kg/m^3"),
        "tension": Tension(x=10.0, y=0.0),
        "modes": Modes(select=[1]),
    }
    return Scene(**{**given, **changes})


def test_plate_strip_tends_to_the_beam_as_it_becomes_narrow():
    """With nu = 0 plate and beam have the same limit; b111 per width and the frequency agree."""
    beam = reduce_scene(string_scene("1 um", "beam"))
    strip = reduce_scene(string_scene("1 um", "plate"))
    assert strip.frequency == pytest.approx(beam.frequency, rel=1e-5)
    assert strip.mass == pytest.approx(beam.mass, rel=1e-5)
    assert strip.cubic == pytest.approx(beam.cubic, rel=1e-4)
    # ideal string: E A pi^4/(8 L^3)
    ideal = 250e9 * 1e-13 * np.pi**4 / (8 * 1e-12)
    assert beam.cubic[0, 0, 0, 0] == pytest.approx(ideal, rel=0.2)


def test_beam_is_for_strings_held_at_their_ends():
    with pytest.raises(SceneError, match=r"plate\.model"):
        reduce_scene(string_scene("1 um", "beam", geometry=Disc(radius="1 um")))
    with pytest.raises(SceneError, match=r"support\.bottom"):
        reduce_scene(string_scene("1 um", "beam", support=Support("clamped")))
