"""Losses of modes against closed forms and independent solutions."""

import numpy as np
import pytest
from numpy.polynomial import legendre
from scipy.optimize import brentq

from nanorom.errors import AccuracyWarning, SceneError
from nanorom.fem.output.losses import zener
from nanorom.fem.reduce import reduce_scene
from nanorom.rom.model import ReducedModel
from nanorom.scene.elasticity import isotropic
from nanorom.scene.excitation import Damping
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Rectangle, String
from nanorom.scene.load import Load
from nanorom.scene.material import Gas, Material
from nanorom.scene.scene import Accuracy, Modes, Scene
from nanorom.scene.support import Support
from tests.fem.clamped import ClampedRectangle, lowest
from tests.stress import losses

LOSS = 1e-4
NITRIDE = {"youngs_modulus": "250 GPa", "poisson_ratio": 0.23, "density": "3100 kg/m^3"}
THICKNESS, STRESS = 50e-9, 1e9
EXACT = 1e-9
PLATE = 1e-5  # of Q on meshes for frequencies to 1e-6: bending is no Rayleigh quotient
SURE, LARGER = 1.5, 10.0  # true error by that told at most, and the other way round
ASYMPTOTIC = 4.0  # times the layer, by which the closed form is the exact one


def string(model="beam", length=20e-6, **changes):
    parts = {
        "geometry": String(length=length, width="0.5 um"),
        "plate": Plate(thickness=THICKNESS, model=model),
        "material": Material(loss=LOSS, **NITRIDE),
        "tension": Tension(x=STRESS * THICKNESS, y=0.0),
        "modes": Modes(count=4),
    }
    return Scene(**parts | changes)


def square(kappa=400.0, count=6, side=10e-6):
    """Clamped square of a side with T L^2/D = kappa."""
    rigidity = 250e9 * THICKNESS**3 / (12 * (1 - 0.23**2))
    return Scene(
        geometry=Rectangle(length=side, width=side),
        plate=Plate(thickness=THICKNESS, model="plate"),
        material=Material(loss=LOSS, **NITRIDE),
        tension=Tension.isotropic(kappa * rigidity / side**2),
        modes=Modes(count=count),
        accuracy=Accuracy(tolerance=1e-6),
    )


def exact_dilution(layer, count):
    """Q/Q_int (count,) of a clamped beam of length 1 under tension with sqrt(E I/S) = layer.

    From the characteristic equation and shapes in closed form: w = cosh-like decays from both ends
    and a trigonometric middle, even and odd about the middle; energies by Gauss quadrature.
    """
    tension, found = 1 / layer**2, []

    def waves(omega):
        s = np.sqrt((tension / 2) ** 2 + omega**2)
        return np.sqrt(s + tension / 2), np.sqrt(s - tension / 2)

    def characteristic(omega, odd):
        a, b = waves(omega)
        if odd:  # sinh(a x)/sinh(a/2) - sin(b x)/sin(b/2) has slope 0 at 1/2
            return a / np.tanh(a / 2) * np.sin(b / 2) - b * np.cos(b / 2)
        return a * np.tanh(a / 2) * np.cos(b / 2) + b * np.sin(b / 2)

    x, weights = legendre.leggauss(400)
    x = x / 2
    for odd in (0, 1):
        grid = np.linspace(1.0, 1.6 * count * np.pi * np.sqrt(tension) + 200, 4000)
        values = [characteristic(w, odd) for w in grid]
        for low, high, f, g in zip(grid, grid[1:], values, values[1:]):
            if f * g > 0:
                continue
            omega = brentq(characteristic, low, high, args=(odd,), xtol=1e-13, rtol=1e-15)
            a, b = waves(omega)
            outer = np.exp(a * (np.abs(x) - 0.5))
            c, s = (1 + (-1) ** k * np.exp(-2 * a * np.abs(x)) for k in (0, 1))
            ends = 1 + np.exp(-a), 1 - np.exp(-a)
            if odd:
                first = a * outer * c / ends[1] - b * np.cos(b * x) / np.sin(b / 2)
                second = a**2 * outer * s / ends[1] * np.sign(x)
                second = second + b**2 * np.sin(b * x) / np.sin(b / 2)
            else:
                first = a * outer * s / ends[0] * np.sign(x) + b * np.sin(b * x) / np.cos(b / 2)
                second = a**2 * outer * c / ends[0] + b**2 * np.cos(b * x) / np.cos(b / 2)
            stretched, bent = tension * weights @ first**2, weights @ second**2
            found.append((omega, (stretched + bent) / bent))
    return np.array([ratio for _, ratio in sorted(found)[:count]])


def ritz_dilution(kappa, count):
    """Q/Q_int (count,) of a clamped square of side 1 with T/D = kappa."""
    film = ClampedRectangle(1.0, 1.0)
    bending = film.bending(isotropic(0.23)) * (1 - 0.23**2)
    values, vectors = lowest(bending + film.tension(kappa, kappa), film.mass(), count)
    return values / np.einsum("in,ij,jn->n", vectors, bending, vectors)


def test_tension_dilutes_the_loss_of_a_string_as_the_exact_solution_has_it():
    scene = string()
    layer = THICKNESS / 20e-6 * np.sqrt(250e9 / (12 * STRESS))
    found = LOSS / reduce_scene(scene).losses["material"]
    assert found == pytest.approx(exact_dilution(layer, 4), rel=EXACT)
    n = np.arange(1, 5)
    closed = 1 / (2 * layer + (n * np.pi * layer) ** 2)
    assert np.abs(found / closed - 1).max() < 0.05  # the closed form is that of a thin layer


@pytest.mark.parametrize("length", [100e-6, 1e-3])
def test_dilution_tends_to_the_closed_form_of_a_long_string(length):
    layer = THICKNESS / length * np.sqrt(250e9 / (12 * STRESS))
    n = np.arange(1, 5)
    closed = 1 / (2 * layer + (n * np.pi * layer) ** 2)
    found = LOSS / reduce_scene(string(length=length)).losses["material"]
    assert np.abs(found / closed - 1).max() < ASYMPTOTIC * layer


def test_clamped_square_has_the_dilution_of_an_independent_ritz_solution():
    model = reduce_scene(square())
    found = LOSS / model.losses["material"]
    exact = ritz_dilution(400.0, 6)
    assert found == pytest.approx(exact, rel=PLATE)
    layer = 1 / np.sqrt(400.0)
    closed = 1 / (2 * layer + 2 * (np.pi * layer) ** 2)
    assert exact[0] == pytest.approx(closed, rel=0.15)  # Yu et al. 2012, thin layers


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4])
def test_error_of_a_loss_is_told_and_meets_the_true_one(tolerance):
    model = reduce_scene(square().with_(tolerance=tolerance))
    true = np.abs(LOSS / model.losses["material"] / ritz_dilution(400.0, 6) - 1)
    told = model.diagnostics["error_losses"]
    assert (true < SURE * told).all()
    assert told.max() < LARGER * true.max()


@pytest.mark.parametrize("seed", [5, 13])  # clamped, hinged and round
def test_error_of_a_loss_of_a_random_film_is_told(seed):
    """More of them: tests/stress/losses.md."""
    assert losses.case(seed).ratio < SURE


def test_error_of_a_loss_on_a_mesh_that_hardly_sees_the_edge_layer_is_told_aloud():
    film = square(1e7, count=2, side=1e-3)  # it bends in 0.3 um, cells of 0.1 mm
    coarse = film.with_(degree=5, mesh_size=1e-4)
    with pytest.warns(AccuracyWarning, match=r"^the loss of mode .* is known to .* only"):
        model = reduce_scene(coarse)
    fine = reduce_scene(film)
    true = np.abs(model.losses["material"] / fine.losses["material"] - 1)
    assert 0.1 < true.max()
    assert (true < SURE * model.diagnostics["error_losses"]).all()
    assert model.frequency == pytest.approx(fine.frequency, rel=1e-3)


def test_loss_is_the_slope_of_frequencies_by_the_modulus():
    """omega^2 (1 + i loss E d/dE): what a complex modulus does to a frequency, to first order."""
    step, scene = 1e-3, square(kappa=60.0, count=2)
    model = reduce_scene(scene)
    up, down = (
        reduce_scene(
            scene.with_(
                material=Material(
                    youngs_modulus=250e9 * (1 + s), poisson_ratio=0.23, density=3100.0
                )
            )
        )
        for s in (step, -step)
    )
    slope = (up.frequency**2 - down.frequency**2) / (2 * step * model.frequency**2)
    assert model.losses["material"] == pytest.approx(LOSS * slope, rel=1e-4)


def test_unstressed_curved_film_loses_as_its_material_does(tmp_path):
    x, y = (a.ravel() for a in np.meshgrid(*(np.linspace(-5e-6, 5e-6, 41),) * 2))
    z = 2e-7 * np.cos(np.pi * x / 1e-5) * np.cos(np.pi * y / 1e-5)
    table = tmp_path / "shape.csv"
    np.savetxt(table, np.column_stack([x, y, z]), delimiter=",", header="x y z")
    scene = square(count=2)
    scene = scene.with_(
        plate=Plate(thickness=THICKNESS, model="plate", initial_shape=table),
        tension=Tension(0.0, 0.0),
        accuracy=Accuracy(tolerance=1e-3),
    )
    found = reduce_scene(scene).losses["material"]
    assert found == pytest.approx([LOSS, LOSS], rel=1e-6)


def test_pressure_that_stretches_a_film_adds_to_its_tension_and_its_loss():
    """Stored tension dilutes, linear stretching does not: shares of one energy."""
    scene = square(kappa=50.0, count=1).with_(tolerance=1e-3)
    model = reduce_scene(scene.with_(load=Load(pressure="5 kPa")))
    flat = reduce_scene(scene)
    share = model.losses["material"][0] / LOSS
    assert 0 < share < 1
    assert share > flat.losses["material"][0] / LOSS  # the deflected film stretches linearly


HEAT = {"expansion": "2.3e-6 1/K", "conductivity": "3 W/m/K", "specific_heat": "700 J/kg/K"}


def heat_loss(xi):
    """Zener's function from the heat equation across the thickness, solved in Chebyshev points.

    i theta = theta''/(2 xi^2) + i z on |z| < 1/2, theta' = 0 there: 12 Im int z theta dz.
    """
    n = 60
    x = np.cos(np.pi * np.arange(n + 1) / n)
    c = np.where((np.arange(n + 1) % n) == 0, 2.0, 1.0) * (-1.0) ** np.arange(n + 1)
    d = np.outer(c, 1 / c) / (x[:, None] - x + np.eye(n + 1))
    d = 2 * (d - np.diag(d.sum(axis=1)))  # by z = x/2
    operator = 1j * np.eye(n + 1) - d @ d / (2 * xi**2)
    source = 1j * x / 2
    operator[[0, -1]], source[[0, -1]] = d[[0, -1]], 0.0
    theta = np.linalg.solve(operator, source)
    nodes, weights = legendre.leggauss(80)
    poly = np.polynomial.chebyshev.chebfit(x, theta.real, n) + 1j * (
        np.polynomial.chebyshev.chebfit(x, theta.imag, n)
    )
    values = np.polynomial.chebyshev.chebval(nodes, poly)
    return 12 * np.imag(weights / 2 @ (nodes / 2 * values))


@pytest.mark.parametrize("xi", [0.02, 0.0999, 0.1001, 1.0, 2.225, 10.0])
def test_thermoelastic_function_solves_the_heat_equation_across_the_film(xi):
    assert zener(np.array([xi]))[0] == pytest.approx(heat_loss(xi), rel=1e-6)


def test_thermoelastic_loss_of_a_beam_is_that_of_lifshitz_and_roukes():
    scene = string(material=Material(**NITRIDE, **HEAT), tension=Tension(0.0, 0.0))
    model = reduce_scene(scene)
    capacity, omega = 3100 * 700, 2 * np.pi * model.frequency
    xi = THICKNESS * np.sqrt(omega * capacity / (2 * 3.0))
    exact = 250e9 * 2.3e-6**2 * 293 / capacity * np.array([heat_loss(x) for x in xi])
    assert model.losses["thermoelastic"] == pytest.approx(exact, rel=1e-6)


def test_thermoelastic_loss_of_a_plate_has_the_trace_of_the_curvature():
    """Simply supported: all of the energy is in the trace, (1 + nu)/(1 - nu) times a beam's."""
    scene = square(count=3).with_(
        tension=Tension(0.0, 0.0),
        support=Support("simply_supported"),
        material=Material(**NITRIDE, **HEAT),
    )
    model = reduce_scene(scene)
    capacity, omega = 3100 * 700, 2 * np.pi * model.frequency
    xi = THICKNESS * np.sqrt(omega * capacity / (2 * 3.0))
    exact = 250e9 * 2.3e-6**2 * 293 / capacity * np.array([heat_loss(x) for x in xi])
    exact *= (1 + 0.23) / (1 - 0.23)
    assert model.losses["thermoelastic"] == pytest.approx(exact, rel=PLATE)


def test_drag_of_a_rare_gas_is_the_momentum_that_its_molecules_take():
    pressure, temperature, molar_mass = 2.0, 300.0, 4e-3
    gas = Gas(pressure=pressure, temperature=temperature, molar_mass=molar_mass)
    scene = string(material=Material(**NITRIDE), gas=gas)
    model = reduce_scene(scene)
    thermal = np.sqrt(8.314462618 * temperature / molar_mass)  # standard deviation of a velocity

    def push(u):
        """Pressure by p on a wall that meets a Maxwellian gas, reflecting, at u thermal speeds."""
        v, weights = legendre.leggauss(200)
        v, weights = -u + 6 * (v + 1), 6 * weights
        return 2 * weights @ ((v + u) ** 2 * np.exp(-(v**2) / 2)) / np.sqrt(2 * np.pi)

    u = 1e-4
    drag = pressure * (push(u) - push(-u)) / (u * thermal)  # by area and velocity, both sides
    exact = drag / (3100 * THICKNESS * 2 * np.pi * model.frequency)
    assert model.losses["gas"] == pytest.approx(exact, rel=1e-6)


def test_contributions_add_up_with_what_the_scene_gives_and_survive_the_file(tmp_path):
    scene = string(
        material=Material(loss=LOSS, **NITRIDE, **HEAT),
        gas=Gas(pressure="10 Pa"),
        damping=Damping(quality_factor=5e4),
    )
    model = reduce_scene(scene)
    assert set(model.losses) == {"material", "thermoelastic", "gas"}
    inverse = 1 / 5e4 + sum(model.losses.values())
    exact = model.mass * 2 * np.pi * model.frequency * inverse
    assert np.diag(model.damping) == pytest.approx(exact, rel=1e-12)
    model.save(tmp_path / "rom.h5")
    read = ReducedModel.load(tmp_path / "rom.h5")
    assert read.losses["gas"] == pytest.approx(model.losses["gas"], rel=1e-15)
    assert read.select([2]).losses["material"] == pytest.approx(model.losses["material"][[1]])


def test_losses_alone_damp_a_scene_that_gives_no_quality_factor():
    scene = string()
    assert scene.damping == Damping()
    assert Scene.from_toml(scene.to_toml()) == scene
    model = reduce_scene(scene)
    quality = model.mass * 2 * np.pi * model.frequency / np.diag(model.damping)
    assert quality == pytest.approx(1 / model.losses["material"], rel=1e-12)


@pytest.mark.parametrize("model", ["membrane", "shell"])
def test_models_that_do_not_tell_bending_refuse_a_loss(model):
    with pytest.raises(SceneError, match=r"^material\.loss: found beside plate\.model"):
        string(model=model, tension=Tension(1.0, 1.0))
