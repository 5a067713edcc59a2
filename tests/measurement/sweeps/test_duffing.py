"""One mode's response in closed form is that of the continuation; its slopes are derivatives."""

import attrs
import numpy as np
import pytest

from nanorom.continuation import ModalSystem, explore
from nanorom.continuation.readout import readout
from nanorom.measurement.data import Trace
from nanorom.measurement.sweeps.duffing import Resonance
from nanorom.measurement.sweeps.fit import SweepFit

QUALITY = 200.0
HARMONICS = 5e-4  # what terms beyond the third harmonic's first effect change, at folds 5 % away
SLOPE = 1e-4  # of differences; at a fold of its place, which is found to 1e-9


@pytest.mark.parametrize(("force", "cubic"), [(5e-4, 1.0), (2e-3, 1.0), (1e-3, -1.0)])
def test_amplitudes_and_folds_are_those_of_the_continuation(force, cubic):
    system = ModalSystem(stiffness=[1.0], damping=[1 / QUALITY], cubic=[[[[cubic]]]], direct=[1.0])
    diagram = explore(system, omega=(0.8, 1.3), direct=force)
    branch = diagram.branches[0]
    curve = Resonance(1.0, 1 / QUALITY, cubic, 0.0).curve(force)
    sizes = readout(branch).size
    for n in np.flatnonzero(branch.stable):
        place = np.array([branch.omega[n] ** 2])
        ways = [abs(curve.amplitude(place, way)[0]) / sizes[n] - 1 for way in (True, False)]
        assert min(map(abs, ways)) < HARMONICS
    folds = sorted(point.omega for point in diagram.points("LP", 0))
    found = [] if curve.upper is None else [curve.lower[0] ** 0.5, curve.upper[0] ** 0.5]
    assert sorted(found) == pytest.approx(folds, rel=HARMONICS)


def sweeps(resonance, forces, omega):
    """Traces up and down, exact, with the frequencies in radians."""
    found = []
    for force in forces:
        curve = resonance.curve(force)
        for up in (True, False):
            y = np.abs(curve.amplitude(omega**2, up))
            if curve.upper is not None:
                own = omega**2 < curve.upper[0] if up else omega**2 > curve.lower[0]
                y = np.where(own, y, np.abs(curve.amplitude(omega**2, not up)))
            order = slice(None) if up else slice(None, None, -1)
            way = "up" if up else "down"
            found.append(Trace(omega[order], y[order], f"{force}", way))
    return found


@pytest.mark.parametrize("seed", range(3))
def test_slopes_are_derivatives_of_the_residual(seed):
    random = np.random.default_rng(seed)
    resonance = Resonance(1.0, 1 / QUALITY, random.choice([1.0, -1.0]), random.uniform(0, 0.03))
    traces = sweeps(resonance, (1e-3, 2e-3), np.linspace(0.9, 1.1, 151))
    fit = SweepFit(traces, [0, 0, 1, 1], True, True)
    loss = 1 / QUALITY / fit.scale
    forces = [np.log(force / fit.size / fit.scale**2) for force in (1e-3, 2e-3)]
    exact = [
        2 * (1 / fit.scale - 1) / loss,
        np.log(loss),
        resonance.cubic * fit.size**2 / fit.scale**2 / loss,
        resonance.damping * fit.size**2 / fit.scale / loss,
        *random.normal(0, 0.3, 2),
        *forces,
    ]
    p = np.array(exact)
    fit.settle_falls(p)
    folded = fit.rows + np.arange(len(fit.residual(p)) - fit.rows)
    slopes = fit.jacobian(p)
    far = np.abs(slopes).max(axis=1) < 0.2 * np.abs(slopes[: fit.rows]).max()
    far[folded] = True  # next to a fold slopes are bounded on purpose
    assert len(folded) == 4 and far.sum() > 0.75 * len(far)
    for i in range(len(p)):
        step = 1e-6 * max(1, abs(p[i])) * (np.arange(len(p)) == i)
        difference = (fit.residual(p + step) - fit.residual(p - step)) / (2 * step[i])
        assert slopes[far, i] == pytest.approx(
            difference[far], rel=1e-3, abs=SLOPE * np.abs(difference).max()
        )


def test_largest_amplitude_follows_the_quality_factor():
    curve = Resonance(1.0, 1 / QUALITY, 0.0, 0.0).curve(1e-3)
    assert curve.top[1] ** 0.5 == pytest.approx(1e-3 * QUALITY, rel=1e-4)
    assert attrs.astuple(curve)[-2:] == (None, None)
