"""Heat of a laser in a drum against Bessel functions and closed integrals."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import j0, j1, jn_zeros

import nanorom
from nanorom.errors import ModelError, SceneError
from nanorom.fem.reduce import reduce_scene
from nanorom.rom.heat import heated
from nanorom.rom.patterns import aimed, driven
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Damping, Sweep
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Disc
from nanorom.scene.load import Load
from nanorom.scene.material import Material
from nanorom.scene.scene import Accuracy, Modes, Scene

RADIUS, THICKNESS = 2.5e-6, 10e-9
E, NU, DENSITY = 410e9, 0.16, 2267.0
ALPHA, CONDUCTIVITY, HEAT = -7e-6, 800.0, 720.0
SPOT, ABSORPTION = 0.7e-6, 0.2
CAPACITY = DENSITY * HEAT * THICKNESS
DIFFUSIVITY = CONDUCTIVITY / (DENSITY * HEAT)
TOLERANCE = 1e-6
ROUGH = 1e-3  # of higher thermal modes, on a mesh that is made for the film's own
LASER = {"position": (0.0, 0.0), "radius": SPOT, "power": "2 mW", "absorption": ABSORPTION}


def drum(**changes):
    drive = changes.pop("drive", Drive(laser="1 mW", **LASER | changes.pop("laser", {})))
    parts = {
        "geometry": Disc(radius=RADIUS),
        "plate": Plate(thickness=THICKNESS, model="membrane"),
        "material": Material(
            youngs_modulus=E,
            poisson_ratio=NU,
            density=DENSITY,
            expansion=ALPHA,
            conductivity=CONDUCTIVITY,
            specific_heat=HEAT,
        ),
        "tension": Tension.isotropic(0.3),
        "modes": Modes(count=1),
        "damping": Damping(quality_factor=100),
        "drive": drive,
        "sweep": Sweep("1.9 f1", "2.1 f1"),
        "accuracy": Accuracy(tolerance=TOLERANCE),
    }
    return Scene(**parts | changes)


@pytest.fixture(scope="module")
def model():
    return reduce_scene(drum())


def round_modes(count):
    return jn_zeros(0, count)


def stress(mu, r):
    """N_rr and N_tt by E h alpha of T = J0(mu r), r in radii, u = 0 at the rim.

    u = (1 + nu) alpha [I(r) - r I(1)]/r, I(r) = int_0^r T r' dr' = r J1(mu r)/mu.
    """
    integral = lambda s: s * j1(mu * s) / mu  # noqa: E731
    c = (1 + NU) * integral(1.0)
    by_r = integral(r) / r**2
    strain_t = (1 + NU) * by_r - c
    strain_r = (1 + NU) * (j0(mu * r) - by_r) - c
    thermal = j0(mu * r)
    n_r = (strain_r - thermal + NU * (strain_t - thermal)) / (1 - NU**2)
    n_t = (strain_t - thermal + NU * (strain_r - thermal)) / (1 - NU**2)
    return n_r, n_t


def test_rates_are_those_of_bessel_functions(model):
    """1/tau = mu^2 D_th/R^2."""
    count = len(model.heat.rate)
    exact = round_modes(20) ** 2 * DIFFUSIVITY / RADIUS**2
    assert count >= 4
    nearest = exact[np.abs(exact[:, None] / model.heat.rate - 1).argmin(axis=0)]
    assert model.heat.rate == pytest.approx(nearest, rel=TOLERANCE)
    assert model.heat.rate[0] == pytest.approx(exact[0], rel=TOLERANCE)


def test_a_spot_feeds_each_mode_by_its_own_share(model):
    mu = RADIUS * np.sqrt(model.heat.rate / DIFFUSIVITY)
    peak = 2 * ABSORPTION / (np.pi * (SPOT / RADIUS) ** 2)

    def fed(m):
        light = lambda r: np.exp(-2 * (r * RADIUS / SPOT) ** 2) * j0(m * r) * r  # noqa: E731
        return 2 * np.pi * peak * quad(light, 0, 1, epsabs=1e-12)[0]

    square = np.pi * j1(mu) ** 2 * RADIUS**2
    exact = [fed(m) for m in mu] / (CAPACITY * square)
    assert model.heat.feed[:2] == pytest.approx(exact[:2], rel=1e-5)
    assert model.heat.feed == pytest.approx(exact, rel=ROUGH)


def test_thermal_stress_softens_the_drum_as_its_closed_integral(model):
    """k = int N_rr phi'^2 dA, phi the membrane's J0(j r)."""
    first = jn_zeros(0, 1)[0]
    for rate, found in zip(model.heat.rate[:4], model.heat.stiffness[0, 0]):
        mu = RADIUS * np.sqrt(rate / DIFFUSIVITY)
        work = lambda r, mu=mu: stress(mu, r)[0] * (first * j1(first * r)) ** 2 * r  # noqa: E731
        exact = 2 * np.pi * E * THICKNESS * ALPHA * quad(work, 0, 1, epsabs=1e-13)[0]
        assert found == pytest.approx(exact, rel=ROUGH)
    assert model.heat.force == pytest.approx(np.zeros_like(model.heat.force), abs=1e-30)


def test_mean_power_changes_the_tension_as_a_static_temperature_does(model):
    """All thermal modes against the steady temperature, T'' + T'/r = -p/k: their sum is k : T."""
    stiffness, _ = heated(model.stiffness, model.quadratic, model.cubic, model.heat, 2e-3)
    first = jn_zeros(0, 1)[0]
    r = (np.arange(4000) + 0.5) / 4000
    light = 2 * ABSORPTION * 2e-3 / (np.pi * SPOT**2) * np.exp(-2 * (r * RADIUS / SPOT) ** 2)
    flow = np.cumsum(light * r) * RADIUS / 4000 / r  # int p r dr / r, less half a step
    slope = -flow / (CONDUCTIVITY * THICKNESS) * RADIUS
    temperature = -(np.cumsum(slope[::-1])[::-1] / 4000)
    integral = np.cumsum(temperature * r) / 4000
    u_t = (1 + NU) * (integral / r**2 - integral[-1])
    u_r = (1 + NU) * (temperature - integral / r**2 - integral[-1])
    n = (u_r - temperature + NU * (u_t - temperature)) / (1 - NU**2)
    work = 2 * np.pi * E * THICKNESS * ALPHA * np.sum(n * (first * j1(first * r)) ** 2 * r) / 4000
    assert stiffness[0, 0] - model.stiffness[0, 0] == pytest.approx(work, rel=5e-3)


def test_parametric_resonance_begins_where_the_delayed_modulation_says(model):
    """At twice f1 a threshold: |sum k_s p_s P1/(R_s + i omega)| = 2 c omega_0."""
    power, damping = 0.5e-3, Damping(quality_factor=100)
    drive = Drive(laser=power, **LASER | {"power": power})
    system = driven(model.with_damping(damping), drive)
    natural = np.sqrt(system.stiffness[0, 0] / model.mass[0])
    heat, omega = model.heat, 2 * natural
    per_watt = abs((heat.stiffness[0, 0] * heat.feed / (heat.rate + 1j * omega)).sum())
    threshold = 2 * system.damping[0, 0] * natural / per_watt
    assert threshold < power
    sweep = Sweep(0.99 * omega / (2 * np.pi), 1.01 * omega / (2 * np.pi))

    def doubled(level):
        drive = Drive(laser=level, **LASER | {"power": power})
        found = nanorom.respond(model, drive, sweep, damping, processes=1)
        return [point.type for point in found.diagrams[0].special_points].count("PD")

    assert doubled(0.98 * threshold) == 0
    assert doubled(1.02 * threshold) == 2


def test_response_to_a_laser_is_of_the_modes_alone_in_memory_and_in_its_file(model, tmp_path):
    """Temperatures are no deflections: nobody adds kelvins to metres."""
    drive = Drive(laser="0.5 mW", **LASER | {"power": "0.5 mW"})
    path = tmp_path / "response.h5"
    warm = driven(model.with_damping(Damping(100)), drive).stiffness[0, 0]
    doubled = np.sqrt(warm / model.mass[0]) / np.pi
    sweep, damping = Sweep(0.9 * doubled, 1.1 * doubled), Damping(quality_factor=100)
    found = nanorom.respond(model, drive, sweep, damping, processes=1, path=path)
    read = nanorom.Response.load(path)
    again = nanorom.respond(model, drive, sweep, damping, processes=1, path=path)
    for response in (found, read, again):
        (diagram,) = response.diagrams
        assert len(diagram.branches) == 3 and len(diagram.points("PD")) == 2
        for branch in diagram.branches:
            assert branch.amplitude.shape == (len(branch), model.size)
            assert all(orbit.shape[1] == model.size for orbit in branch.coefficients)
        for point in diagram.special_points:
            assert point.amplitude.shape == (model.size,) and point.state.shape == (2 * model.size,)
            motion = point.orbit.coefficients
            start = motion[0] + motion[1::2].sum(axis=0)
            scale = np.abs(diagram.branches[1].amplitude).max()
            assert point.state[: model.size] == pytest.approx(start, abs=1e-12 * scale)
        assert "isola" in [left.kind for left in diagram.unexplored]
    assert nanorom.plots.response_figure(read).axes


def test_heat_pushes_a_film_that_a_gate_has_bent():
    """f is the virtual work of thermal stress: the slope of k along the static deflection."""
    scene = drum(load=Load(pressure="2 kPa"), accuracy=Accuracy(tolerance=1e-4))
    model = reduce_scene(scene)
    flat = reduce_scene(drum(accuracy=Accuracy(tolerance=1e-4)))
    height = float(model.static["centre_deflection"])
    # the deflection is nearly the first mode's shape
    guess = -flat.heat.stiffness[0, 0] * height
    assert model.heat.force[0] == pytest.approx(guess, rel=0.2, abs=0.05 * np.abs(guess).max())
    assert (model.select([1]).heat.force == model.heat.force).all()


BAD = [
    (
        {"laser": {"power": "0.5 mW"}},
        r"^drive\.laser: found 1 mW; allowed: at most drive\.power",
    ),
    ({"laser": {"absorption": 0.0}}, r"^drive\.absorption: found 0\.0; allowed: greater than 0"),
    ({"laser": {"position": ("3 um", 0)}}, r"^drive\.position: found \(3, 0\) µm; allowed: on"),
    ({"laser": {"radius": None}}, r"^drive\.radius: missing with"),
    (
        {"material": Material(youngs_modulus=E, poisson_ratio=NU, density=DENSITY)},
        r"^drive\.laser: found for a material whose heat is not known",
    ),
]


@pytest.mark.parametrize(("changes", "told"), BAD)
def test_lasers_that_make_no_sense_are_refused(changes, told):
    with pytest.raises(SceneError, match=told):
        drum(**changes)


def test_laser_survives_the_file_and_asks_for_a_model_that_knows_it(model, make_model):
    scene = drum()
    assert Scene.from_toml(scene.to_toml()) == scene
    elsewhere = Drive(laser="1 mW", **LASER | {"position": ("0.1 um", 0.0)})
    with pytest.raises(ModelError, match=r"^drive\.position: the model was reduced without"):
        aimed(model, elsewhere)
