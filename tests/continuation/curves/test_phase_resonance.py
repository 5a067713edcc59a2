"""Phase resonance against energy balance, backbones and the response at fixed levels."""

from __future__ import annotations

import numpy as np
import pytest

from nanorom.continuation import ModalSystem, backbone, explore, phase_resonance, readout
from nanorom.errors import ContinuationError
from tests.continuation.systems import duffing

BALANCED = 1e-8


def two_modes(quality: float) -> ModalSystem:
    return ModalSystem(
        stiffness=[1.0, 4.5],
        damping=[1 / quality, 2 / quality],
        quadratic=0.1 * np.ones((2, 2, 2)),
        cubic=np.einsum("ij,kl->ijkl", np.eye(2), np.eye(2)),
        direct=[1.0, 0.3],
    )


@pytest.mark.parametrize("quality", [1e2, 1e5, 1e8])
@pytest.mark.parametrize("mode", [0, 1])
def test_orbits_lag_by_a_quarter_and_take_in_what_they_lose(quality, mode):
    system = two_modes(quality)
    curve = phase_resonance(system, (0.001 / quality, 0.5 / quality), mode=mode)
    assert curve.level[[0, -1]] * quality == pytest.approx([0.001, 0.5], rel=1e-8)
    assert readout(curve, mode).phase == pytest.approx(-np.pi / 2, abs=1e-9)
    for index in range(len(curve)):
        frequencies, amplitudes = curve.orbit(index).spectrum()
        loss = np.abs(frequencies[:, None] * amplitudes) ** 2 @ np.diag(system.damping) / 2
        work = (1j * frequencies[1] * amplitudes[1]).real @ system.direct * curve.level[index] / 2
        assert loss.sum() == pytest.approx(work, rel=BALANCED)


def test_curve_runs_through_the_responses_at_fixed_levels():
    system, level = duffing(50.0), 0.02
    curve = phase_resonance(system, (0.001, 0.05), at=[level])
    (index,) = np.flatnonzero(np.abs(curve.level - level) < 1e-12)
    branch = explore(system, (0.8, 1.3), level).branches[0]
    phase = readout(branch).phase + np.pi / 2
    (before,) = np.flatnonzero((phase[:-1] > 0) & (phase[1:] <= 0))
    part = phase[before] / (phase[before] - phase[before + 1])
    for name in ("omega", "amplitude"):
        values = getattr(branch, name)[before : before + 2]
        between = values[0] + part * (values[1] - values[0])
        assert getattr(curve, name)[index] == pytest.approx(between, rel=1e-3)
    assert not curve.stable[-1] or curve.stable[0]


def test_it_is_the_backbone_where_damping_is_small():
    system = ModalSystem(stiffness=[1.0], damping=[1e-4], cubic=[[[[1.0]]]], direct=[1.0])
    curve = phase_resonance(system, (1e-6, 5e-5))
    free = backbone(system, amplitude=0.7)
    sizes, order = np.unique(free.amplitude[:, 0], return_index=True)
    inside = curve.amplitude[:, 0] > sizes[1]
    expected = np.interp(curve.amplitude[inside, 0] ** 2, sizes**2, free.omega[order])
    assert curve.omega[inside] == pytest.approx(expected, abs=2e-4)


def test_other_lags_and_outputs_may_be_held():
    system = duffing(50.0)
    curve = phase_resonance(system, (0.001, 0.01), lag=np.pi / 4, output=[2.0])
    assert readout(curve, [2.0]).phase == pytest.approx(-np.pi / 4, abs=1e-9)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"direct": (0.0, 1.0)}, "direct: found"),
        ({"mode": 1}, "mode: found 1; allowed 0 to 0"),
        ({"output": [1.0, 2.0]}, "output: shape"),
        ({"output": [0.0]}, "lag: no orbit near mode 0"),
    ],
)
def test_what_cannot_be_held_is_refused(given, message):
    with pytest.raises(ContinuationError, match=message):
        phase_resonance(duffing(), **({"direct": (0.001, 0.01)} | given))
    still = ModalSystem(stiffness=[1.0], damping=[0.1])
    with pytest.raises(ContinuationError, match="direct: the drive moves nothing"):
        phase_resonance(still, (0.1, 1.0))
