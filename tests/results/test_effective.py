"""Effective coefficients against closed forms of perturbation theory, and their file."""

import attrs
import numpy as np
import pytest
from scipy.constants import hbar

from nanorom.cli.main import main
from nanorom.continuation import backbone
from nanorom.errors import ModelError
from nanorom.files import stored
from nanorom.plots import effective_figure
from nanorom.results.effective import effective
from nanorom.rom.model import ReducedModel
from tests.conftest import random_model

ROUND_OFF = 1e-9  # relative


@pytest.fixture(scope="module")
def model():
    """Four modes whose quadratic forces are those of a gently curved film, and lossy."""
    model = random_model(4, seed=3)
    cubic = np.array(model.cubic) * 0.2
    loss = np.abs(cubic) / model.frequency[0] * 1e-3
    return attrs.evolve(
        model, quadratic=np.array(model.quadratic) * 0.1, cubic=cubic, cubic_damping=loss
    )


def _third_order(model, r, modes):
    """beta of a mode with some others as slaves, in closed form (Nayfeh and Mook, chapter 6)."""
    k, m = np.diag(model.stiffness), model.mass
    squares = k / m
    beta = model.cubic[r, r, r, r]
    for s in modes:
        pull = model.quadratic[r, r, s] ** 2 / m[s]
        beta -= pull * (4 / 3 / squares[s] + 2 / 3 / (squares[s] - 4 * squares[r]))
    return beta


def test_the_cubic_coefficient_and_its_parts_are_those_of_perturbation_theory(model):
    found = effective(model, 1, 5)
    assert found.cubic == pytest.approx(_third_order(model, 0, range(4)), rel=ROUND_OFF)
    parts = dict(zip(found.part, found.part_cubic))
    assert parts["own cubic force"] == model.cubic[0, 0, 0, 0]
    for mode in range(1, 4):
        alone = _third_order(model, 0, [0])
        share = _third_order(model, 0, [0, mode]) - alone
        assert parts[model.label[mode]] == pytest.approx(share, rel=1e-6)
    for total, by_part in (
        (found.cubic, found.part_cubic),
        (found.quintic, found.part_quintic),
        (found.cubic_damping, found.part_damping),
    ):
        assert by_part.sum() == pytest.approx(total, rel=ROUND_OFF)


def test_frequencies_shift_by_the_cross_kerr_coefficients_of_perturbation_theory(model):
    flat = attrs.evolve(model, quadratic=np.zeros_like(model.quadratic), cubic_damping=None)
    found = effective(flat, 1, 3)
    omega = 2 * np.pi * flat.frequency
    for mode in range(1, 4):
        # <3 B q_1^2> q_s: the force is 3 B_11ss a^2 / 2, and half of it by m omega the shift
        shift = 3 * flat.cubic[mode, mode, 0, 0] / (4 * flat.mass[mode] * omega[mode])
        assert found.kerr[mode] == pytest.approx(shift, rel=1e-6)
    self_shift = 3 * flat.cubic[0, 0, 0, 0] / (8 * flat.mass[0] * omega[0])
    assert found.kerr[0] == pytest.approx(self_shift, rel=1e-6)
    quantum = 2 * hbar / (flat.mass[0] * omega[0])
    assert found.photon == pytest.approx(found.kerr * quantum, rel=ROUND_OFF)


def test_a_fit_at_small_amplitudes_is_a_duffing_oscillator_alone_and_misleads_by_what_is_left(
    model,
):
    found = effective(model, 1, 7)
    system = model.system(damped=False)
    exact = backbone(system, 0, amplitude=1.1 * found.validity)
    known = np.interp(found.largest[20:], exact.amplitude[:, 0], exact.omega)
    assert found.omega[20:] == pytest.approx(known, rel=1e-4)
    assert found.fitted[1] == pytest.approx(found.cubic, rel=1e-2)
    small = np.abs(found.duffing - found.omega)[2] / found.omega[0]
    assert small < 1e-6 < np.abs(found.duffing - found.omega)[-1] / found.omega[0]


def test_a_viscous_modes_own_damping_is_twice_its_coefficient(model):
    alone = model.select([1])
    flat = attrs.evolve(alone, quadratic=np.zeros_like(alone.quadratic))
    found = effective(flat, 1, 5)
    assert found.cubic_damping == pytest.approx(2 * flat.cubic_damping[0, 0, 0, 0], rel=1e-4)


def test_the_file_holds_what_was_found_and_pictures_show_it(model, tmp_path):
    found = effective(model, model.label[0], 5)
    found.save(tmp_path / "effective.h5")
    again = stored.load(tmp_path / "effective.h5")
    assert again.text() == found.text() and found.mode == model.label[0]
    assert np.array_equal(again.fitted, found.fitted)
    figure = effective_figure(again)
    backbone_line, duffing_line = figure.axes[0].lines
    ratio = duffing_line.get_xdata() / backbone_line.get_xdata()
    assert ratio == pytest.approx(found.duffing / found.omega)
    widest = max(bar.get_width() for bar in figure.axes[2].patches)
    shift = 3 / 8 * found.part_cubic * found.amplitude[-1] ** 2 / found.stiffness
    assert widest == pytest.approx(np.abs(shift).max())


def test_one_command_tells_stores_and_draws_them(model, tmp_path, capsys):
    model.save(tmp_path / "rom.h5")
    arguments = ["effective", str(tmp_path / "rom.h5"), "--mode", "2", "--order", "5"]
    assert main([*arguments, "-o", str(tmp_path / "effective.h5")]) == 0
    told = capsys.readouterr().out
    assert told.startswith(model.label[1]) and "own cubic force" in told
    assert stored.load(tmp_path / "effective.h5").text() == told.strip("\n")
    assert (tmp_path / "effective.png").stat().st_size > 1000
    assert main([*arguments[:-1], "many"]) == 1
    assert capsys.readouterr().err.startswith("nanorom: error: --order: found 'many'")


def test_a_mode_that_does_not_exist_is_refused(model):
    with pytest.raises(ModelError, match="mode 9: not in the model"):
        effective(
            ReducedModel(**{f.name: getattr(model, f.name) for f in attrs.fields(type(model))}), 9
        )
