"""Invariant manifolds against time integration and harmonic balance."""

from functools import partial

import attrs
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

import nanorom
from nanorom import Material, Modes, Plate, Scene, String, Support, Tension
from nanorom.continuation import backbone, explore
from nanorom.errors import AccuracyWarning, ModelError
from nanorom.rom.manifold.invariance import STYLES
from tests.rom.manifold.systems import one_to_two, random_system, rest

INTEGRATION = 1e-11
# seed, modes, quadratic forces; in the last a slave near twice the frequency ends the range early
SYSTEMS = [(0, 4, 1.0), (1, 4, 1.0), (2, 4, 1.0), (17, 5, 2.0)]
WITHIN = 1e-4  # relative: of frequencies over the told range
FOLDS = 5e-6  # relative, of folds and torus points at order 7


def _departure(system, reduced, size, time=3.0):
    """How far the motion from a place on the manifold is from that which it says."""
    begin = size * np.exp(1j * np.arange(1, len(reduced.masters) + 1)) / len(reduced.masters)
    options = {"rtol": INTEGRATION, "atol": INTEGRATION * size, "method": "DOP853"}
    slow = solve_ivp(lambda _, z: reduced.flow(z), (0, time), begin, **options)
    full = solve_ivp(partial(rest, system), (0, time), reduced.state(begin), **options)
    return np.abs(reduced.state(slow.y[:, -1]) - full.y[:, -1]).max() / size


@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize("masters", [[1], [1, 3]])
def test_motions_stay_on_the_manifold_up_to_the_order_of_its_expansion(style, masters):
    system = random_system(5, losses=0.2, coupled=1.0, ratio=0.03)
    for order in (2, 3, 5):
        reduced = nanorom.manifold(system, masters, order, style)
        far, near = (_departure(system, reduced, size) for size in (0.04, 0.02))
        assert far / near == pytest.approx(2.0**order, rel=0.35), order


@pytest.mark.parametrize(("seed", "modes", "quadratic"), SYSTEMS)
def test_backbones_are_those_of_harmonic_balance_over_the_told_range(seed, modes, quadratic):
    system = random_system(seed, modes, quadratic)
    for order in (5, 7):
        reduced = nanorom.manifold(system, [1], order)
        reach = reduced.validity
        exact = backbone(system, 0, amplitude=1.3 * reach, tolerance=1e-11)
        rising = np.argsort(exact.amplitude[:, 0])
        x = np.linspace(max(0.2 * reach, exact.amplitude[0, 0]), reach, 9)
        known = CubicSpline(exact.amplitude[rising, 0], exact.omega[rising])(x)
        omega, amplitude = reduced.backbone(x)
        assert np.abs(omega / known - 1).max() < WITHIN, order
        assert amplitude[:, 0] == pytest.approx(x, rel=1e-9)
        others = CubicSpline(exact.amplitude[rising, 0], exact.amplitude[rising])(x)
        assert np.abs(amplitude - others).max() < 2 * WITHIN * reach


def test_a_higher_order_holds_farther_and_is_taken_where_a_range_is_asked_for():
    system = random_system(0)
    orders = [nanorom.manifold(system, [1], order).validity for order in (3, 5, 7)]
    assert orders == sorted(orders)
    reach = 1.02 * orders[1]
    assert nanorom.manifold(system, [1], 3, reach=reach).order == 7
    with pytest.raises(ModelError, match="reach: found 5"):
        nanorom.manifold(system, [1], 3, reach=5.0)


def test_the_estimated_error_is_no_less_than_the_true_one():
    system = random_system(2)
    reduced = nanorom.manifold(system, [1], 5)
    x = reduced.validity * np.array([0.5, 1.0, 1.5])
    exact = backbone(system, 0, amplitude=2 * reduced.validity, tolerance=1e-11)
    known = CubicSpline(exact.amplitude[:, 0], exact.omega)(x)
    true = np.abs(reduced.backbone(x)[0] / known - 1)
    estimate = reduced.error(x)
    assert np.all(estimate > 0.5 * true)
    assert np.all(np.diff(estimate) > 0)


def test_folds_and_torus_points_of_two_masters_in_resonance_are_those_of_the_whole_system():
    system = one_to_two()
    exact = explore(system, omega=(0.9, 1.1), direct=0.01)
    reduced = nanorom.manifold(system, [1, 2], 7)
    found = reduced.response((0.9, 1.1), direct=0.01)
    for kind, count in (("NS", 2), ("LP", 3)):
        known = sorted(point.omega for point in exact.points(kind))
        omega = [point.omega for point in found.points(kind)]
        assert len(omega) == count
        assert omega[:2] == pytest.approx(known[:2], rel=FOLDS)
        if kind == "NS":  # published for it
            assert omega == pytest.approx([0.987743, 1.009667], abs=1e-6)


def test_a_parametric_drive_opens_its_tongue_where_it_does_in_the_whole_system():
    system = random_system(3, quadratic=0.3)
    level = 0.06
    exact = explore(system, omega=(1.9, 2.15), parametric=level)
    reduced = nanorom.manifold(system, [1], 5)
    found = reduced.response((1.9, 2.15), parametric=level, period=2)
    doublings = sorted(point.omega for point in exact.points("PD"))
    opened = [point.omega for point in found.points("BP")]
    # the drive is taken to first order in its level
    assert opened == pytest.approx(doublings[:2], abs=level**2 / 2)


def test_a_clamped_beam_stiffens_as_published_for_order_three_and_as_all_its_modes_do():
    scene = Scene(
        geometry=String(1e-3, 24e-6),
        plate=Plate(1e-5, model="beam"),
        material=Material(160e9, 0.22, 2320),
        tension=Tension(0, 0),
        support=Support({"left": "clamped", "right": "clamped"}),
        modes=Modes(count=6),
    )
    pytest.importorskip("dolfinx")
    with pytest.warns(AccuracyWarning, match="in-plane"):
        model = nanorom.reduce(scene)
    centre = np.abs(model.shapes.points[:, 0]).argmin()
    shape, at = model.shapes.values[:, centre], 0.25756e-5
    found = []
    for order in (3, 7):
        reduced, q = nanorom.manifold(model, [1], order), at
        for _ in range(8):
            motion = reduced.motions([q])[0]
            q *= at / (np.abs(motion.q @ shape).max() * reduced.equations.amplitude)
        found.append(reduced.backbone([q])[0][0] / (2 * np.pi * model.frequency[0]))
    # of solid elements; MORFE and SSMTool, order 3
    assert found[0] == pytest.approx(1.018217, abs=1e-5)
    exact = backbone(model.system(damped=False), 0, amplitude=1.3 * at, tolerance=1e-11)
    reached = [np.abs(o.time_series(256, 1)[1] @ shape).max() for o in exact.orbits]
    known = CubicSpline(reached, exact.omega)(at) / (2 * np.pi * model.frequency[0])
    assert found[1] == pytest.approx(known, abs=WITHIN / 10)


def test_explore_takes_the_masters_as_oscillators():
    system = attrs.evolve(random_system(0, quadratic=0.3), direct=np.eye(4)[0])
    reach, level = (0.9, 1.1), 0.0012
    exact = explore(system, omega=reach, direct=level)
    for order, within in ((3, 1e-3), (5, 1.5e-4), (7, 1e-4)):
        reduced = nanorom.manifold(system, [1], order)
        found = explore(reduced.system(), omega=reach, direct=level)
        for own, known in zip(found.points("LP"), exact.points("LP"), strict=True):
            assert own.omega == pytest.approx(known.omega, rel=within)
            assert own.amplitude[0] == pytest.approx(known.amplitude[0], rel=30 * within)
    two = nanorom.manifold(one_to_two(), [1, 2], 3)
    known = [p.omega for p in two.response((0.9, 1.1), direct=0.01).points("NS")]
    found = explore(two.system(), omega=(0.9, 1.1), direct=0.01).points("NS")
    assert sorted(point.omega for point in found) == pytest.approx(known, rel=3e-4)


def test_a_slave_in_resonance_is_named_with_the_remedy():
    system = one_to_two()
    with pytest.raises(ModelError, match=r"mode 2 is in resonance with them \(2 w1\)"):
        undamped = nanorom.continuation.ModalSystem(
            damping=[0, 0], stiffness=[1.0, 4.0], quadratic=system.quadratic, damped=False
        )
        nanorom.manifold(undamped, [1], 3)


@pytest.mark.parametrize(
    ("masters", "options", "message"),
    [
        ([5], {}, "masters: found 5; allowed: numbers from 1 to 4"),
        ([1, 1], {}, "one or more different modes"),
        ([1], {"style": "polar"}, "style: found 'polar'"),
        ([1], {"order": 40}, "order: found 40"),
        ([1, 2, 3, 4], {"order": 21}, "monomials; allowed"),
    ],
)
def test_what_does_not_do_is_told_in_one_line(masters, options, message):
    with pytest.raises(ModelError, match=message):
        nanorom.manifold(random_system(0), masters, **options)
