"""A laser over a mirror: what motion does to the absorbed light, and that to the motion."""

import attrs
import numpy as np
import pytest
from scipy.integrate import dblquad, quad
from scipy.special import j0, j1, jn_zeros, jnp_zeros

import nanorom
from nanorom.errors import ModelError, SceneError
from nanorom.fem.reduce import reduce_scene
from nanorom.rom.patterns import driven
from nanorom.scene.cavity import Cavity
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Damping, Sweep
from nanorom.scene.load import Load
from nanorom.scene.scene import Accuracy, Modes
from tests.fem.tensors.test_heat import (
    ABSORPTION,
    CAPACITY,
    DIFFUSIVITY,
    LASER,
    RADIUS,
    ROUGH,
    SPOT,
    drum,
)

EXACT = 1e-5  # of integrals on a mesh for 1e-6
LINEAR = 1e-4  # of a response whose amplitude is a thousandth of what bends it
CAVITY = {"wavelength": "633 nm", "gap": "300 nm", "contrast": 0.4}
PEAK = 2 * ABSORPTION / (np.pi * (SPOT / RADIUS) ** 2)


def test_light_weighed_with_modes_is_an_integral_of_bessel_functions():
    heat = reduce_scene(drum()).heat
    first = jn_zeros(0, 1)[0]
    mu = RADIUS * np.sqrt(heat.rate / DIFFUSIVITY)
    square = np.pi * j1(mu) ** 2 * RADIUS**2
    for power, found in ((1, heat.feed_by_mode[:, 0]), (2, heat.feed_by_pair[:, 0, 0])):

        def light(r, m, power=power):
            spot = np.exp(-2 * (r * RADIUS / SPOT) ** 2)
            return spot * j0(m * r) * j0(first * r) ** power * r

        fed = [2 * np.pi * PEAK * quad(light, 0, 1, args=(m,), epsabs=1e-12)[0] for m in mu]
        exact = fed / (CAPACITY * square)
        assert found[:2] == pytest.approx(exact[:2], rel=EXACT)
        assert found == pytest.approx(exact, rel=ROUGH)


def test_a_spot_beside_the_centre_weighs_modes_of_all_symmetries():
    place = (0.3 * RADIUS, 0.0)
    heat = reduce_scene(drum(laser={"position": place}, modes=Modes(count=3))).heat
    first, odd = jn_zeros(0, 1)[0], jn_zeros(1, 1)[0]
    rate = odd**2 * DIFFUSIVITY / RADIUS**2
    own = np.abs(heat.rate / rate - 1) < ROUGH
    (index,) = np.flatnonzero(own & (np.abs(heat.feed) > 1e-3 * np.abs(heat.feed).max()))
    largest = j1(jnp_zeros(1, 1)[0])

    def light(r, angle):
        x, y = r * np.cos(angle) - 0.3, r * np.sin(angle)
        spot = np.exp(-2 * (x * x + y * y) * (RADIUS / SPOT) ** 2)
        return spot * j1(odd * r) * np.cos(angle) / largest * j0(first * r) * r

    fed = 2 * PEAK * dblquad(light, 0, np.pi, 0, 1, epsabs=1e-10)[0]
    square = np.pi * j0(odd) ** 2 / 2 / largest**2 * RADIUS**2  # int psi^2
    assert abs(heat.feed_by_mode[index, 0]) == pytest.approx(fed / (CAPACITY * square), rel=ROUGH)


def test_slopes_are_those_of_the_standing_wave():
    cavity = Cavity(wavelength=633e-9, contrast=0.4, gap=300e-9, phase=0.3)
    absorbed = lambda w: 1 + 0.4 * np.cos(0.3 + 4 * np.pi * (300e-9 + w) / 633e-9)  # noqa: E731
    step = 1e-10
    first = (absorbed(step) - absorbed(-step)) / (2 * step * absorbed(0))
    second = (absorbed(step) - 2 * absorbed(0) + absorbed(-step)) / (step**2 * absorbed(0))
    assert cavity.slopes == pytest.approx((first, second), rel=1e-5)


@pytest.fixture(scope="module")
def bent():
    scene = drum(load=Load(pressure="2 kPa"), accuracy=Accuracy(tolerance=1e-4))
    return reduce_scene(scene).with_damping(Damping(quality_factor=1000))


def delayed(model, cavity, power, omega):
    """Force by displacement, sum f_s g_s/(R_s + i omega), of a mean power of light."""
    heat = model.heat
    fed = power * Cavity(**cavity).slopes[0] * heat.feed_by_mode[:, 0]
    return (heat.force[0] * fed / (heat.rate + 1j * omega)).sum()


def lit(model, cavity, power, level):
    """Drive of P0 and P1, and the modal equations under it."""
    drive = Drive(laser=level, cavity=cavity, **LASER | {"power": power})
    return drive, driven(model, drive)


def test_weak_response_has_the_stiffness_and_damping_of_delayed_light(bent):
    """K - Re and C - Im/omega of sum f_s g_s/(R_s + i omega)."""
    power, level = 1e-4, 1e-10
    drive, system = lit(bent, CAVITY, power, level)
    natural = np.sqrt(system.stiffness[0, 0] / bent.mass[0])
    sweep = Sweep(0.98 * natural / (2 * np.pi), 1.02 * natural / (2 * np.pi))
    found = nanorom.respond(bent, drive, sweep, Damping(quality_factor=1000), processes=1)
    branch = found.diagrams[0].branches[0]
    heat = bent.heat
    j = bent.drive["laser"][0]
    omega = branch.omega
    pushed = [(heat.force[0] * heat.feed / (heat.rate + 1j * w)).sum() for w in omega]
    own = [delayed(bent, CAVITY, power, w) for w in omega]
    inertia = system.stiffness[0, 0] - bent.mass[0] * omega**2
    dynamic = inertia + 1j * omega * system.damping[0, 0] - own
    exact = np.abs(level * (j + np.array(pushed)) / dynamic)
    assert branch.amplitude[:, 0] == pytest.approx(exact, rel=LINEAR)
    without = np.abs(level * (j + np.array(pushed)) / (dynamic + own))
    assert exact.max() > 1.05 * without.max()


@pytest.mark.parametrize("turned", [0.0, np.pi])
def test_films_oscillate_by_themselves_where_light_takes_all_damping(bent, turned):
    """C omega = Im sum f_s g_s/(R_s + i omega), with the cavity of the right sign only."""
    cavity = CAVITY | {"gap": 633e-9 / 8, "phase": turned}
    _, system = lit(bent, cavity, 1e-9, 1e-10)
    natural = np.sqrt(system.stiffness[0, 0] / bent.mass[0])
    own = delayed(bent, cavity, 1.0, natural).imag
    threshold = system.damping[0, 0] * natural / abs(own)

    def stable(power):
        drive, system = lit(bent, cavity, power, 1e-6 * power)
        sweep = Sweep(0.5 * natural / (2 * np.pi), 0.6 * natural / (2 * np.pi))
        found = nanorom.respond(bent, drive, sweep, Damping(quality_factor=1000), processes=1)
        return found.diagrams[0].branches[0].stable.all()

    assert stable(0.9 * threshold)
    assert stable(1.1 * threshold) == (own < 0)


def test_bad_cavities_are_told():
    for cavity, told in (
        ({"wavelength": "633 nm", "contrast": 2.0}, r"^drive\.cavity\.contrast: found 2"),
        ({"contrast": 0.5}, r"^drive\.cavity\.wavelength: missing"),
        (
            {"wavelength": "633 nm", "contrast": 1.0, "phase": np.pi},
            r"^drive\.cavity: the film rests in a dark node",
        ),
    ):
        with pytest.raises(SceneError, match=told):
            Drive(laser="1 mW", cavity=cavity, **LASER)
    with pytest.raises(SceneError, match=r"^drive\.cavity: not used with"):
        Drive(direct="1 Pa", cavity=CAVITY)


def test_a_model_of_before_says_what_it_lacks(bent):
    heat = attrs.evolve(bent.heat, feed_by_mode=None, feed_by_pair=None)
    with pytest.raises(ModelError, match=r"^drive\.cavity: the model does not know"):
        lit(attrs.evolve(bent, heat=heat), CAVITY, 1e-4, 1e-10)
