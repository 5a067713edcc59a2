"""Figures 3 and 4: the phenomena that the paper names, in a short form of the demos."""

import sys
from math import tau
from pathlib import Path

import numpy as np
import pytest

import nanorom
from nanorom import motion
from nanorom.errors import ModelError
from nanorom.linear import linear_response
from nanorom.plots import motion as pictures

DEMOS = Path(__file__).parents[2] / "demos"
LEVEL = 1.6  # gamma by the threshold of f01
EDGE_TOLERANCE = 2e-4  # of the tongue: first-order perturbation beside a weak direct drive


@pytest.fixture(scope="module")
def demos():
    sys.path.insert(0, str(DEMOS))
    import fig3
    import fig4

    yield fig3, fig4
    sys.path.remove(str(DEMOS))


@pytest.fixture(scope="module")
def directory(tmp_path_factory):
    return tmp_path_factory.mktemp("figures")


@pytest.fixture(scope="module")
def membrane(demos, directory):
    """The drum without bending at one level: its model, response and doubled branch."""
    fig3, _ = demos
    responses = fig3.main(
        directory, ladder=(LEVEL,), sweep=("1.95 f1", "2.05 f1"), variants=("membrane",), f03=False
    )
    model = nanorom.ReducedModel.load(directory / "membrane" / "rom.h5")
    (response,) = responses.values()
    return model, response, fig3.of_first_mode(response.diagrams[0], model)


def test_period_doubles_where_gamma_exceeds_the_threshold(membrane):
    """Edges of the tongue 2 f1 (1 +- sqrt(g^2 - 1)/(2 Q)), g: gamma by its threshold."""
    model, response, _ = membrane
    edges = sorted(p.omega / tau / model.frequency[0] for p in response.diagrams[0].points("PD"))
    half = np.sqrt(LEVEL**2 - 1) / (2 * 180)
    assert edges[:2] == pytest.approx([2 - 2 * half, 2 + 2 * half], rel=EDGE_TOLERANCE)


def test_without_bending_the_branch_locks_to_f21_where_the_paper_has_it(membrane):
    model, response, branch = membrane
    top = branch.omega[np.where(branch.stable, branch.omega, 0).argmax()] / tau
    assert 2.4 < top / model.frequency[0] < 2.75
    assert branch.amplitude[:, model.label.index("f21c")].max() > 5e-9
    torus = [
        p.omega / tau / model.frequency[0]
        for p in response.diagrams[0].points("NS")
        if p.period_multiple == 2
    ]
    assert min(abs(ratio - 2.538) for ratio in torus) < 0.05  # the paper's Neimark-Sacker point


def test_the_clamped_plate_has_no_lock_below_three_times_f01(demos):
    """With 410 GPa the resonance with f21 moves to 3.35 ... 3.43 f01."""
    fig3, _ = demos
    full = fig3.reduced("plate", 11)
    model = full.select(["f01", "f21c", "f02", "f41c"])
    sweep = nanorom.Sweep("1.98 f1", "2.02 f1", tolerance=fig3.TOLERANCE)
    response = nanorom.respond(model, fig3.levels(model, [LEVEL]), sweep, processes=1)
    branch = fig3.of_first_mode(response.diagrams[0], model)
    assert branch.omega.max() / tau > 3.0 * model.frequency[0]
    below = branch.omega / tau < 3.0 * model.frequency[0]
    assert branch.amplitude[below, 1].max() < 0.05 * branch.amplitude[below, 0].max()


def test_linear_response_peaks_at_the_frequencies_with_height_j_over_c_omega(membrane):
    model, _, _ = membrane
    force = np.zeros(model.size)
    force[0] = 1e-12
    f1 = model.frequency[0]
    amplitude = linear_response(model, force, [0.0, f1])
    assert amplitude[0, 0] == pytest.approx(1e-12 / model.stiffness[0, 0])
    expected = 1e-12 / (1j * tau * f1 * model.damping[0, 0])
    assert amplitude[1, 0] == pytest.approx(expected)
    assert np.abs(amplitude[:, 1:]).max() < 1e-6 * abs(amplitude[0, 0])


def test_figures_are_written(membrane, directory):
    for name in ("linear.png", "nonlinear.png"):
        assert (directory / name).stat().st_size > 20_000


def test_motion_is_rebuilt_from_the_files_alone(membrane):
    model, _, branch = membrane
    orbit = branch.orbit(len(branch.omega) // 3)
    shares = motion.energy_shares(model, orbit)
    assert shares.sum() == pytest.approx(1)
    t = motion.time_of_largest(model, orbit)
    largest = np.abs(motion.deflection(model, orbit, t)).max()
    q = orbit(t)
    assert largest == pytest.approx(np.abs(q @ model.shapes.values).max())
    assert largest >= 0.9 * branch.amplitude[len(branch.omega) // 3, 0]
    again = motion.deflection(model, orbit, t + orbit.period)
    assert again == pytest.approx(motion.deflection(model, orbit, t), abs=1e-9 * largest)


def test_fig4_draws_everything(membrane, demos, directory, monkeypatch):
    """With the eleven modes' files in the place of those with f03, to save time."""
    _, fig4 = demos
    folder = directory / "membrane"
    (folder / "rom-f03.h5").symlink_to(folder / "rom.h5")
    (folder / "response-f03.h5").symlink_to(folder / "response.h5")
    monkeypatch.setattr(pictures, "FRAMES", 3)
    model, orbit = fig4.main(directory / "fig4", directory)
    found = {path.name for path in (directory / "fig4").iterdir()}
    assert found == {"branch.png", "time.png", "shapes.png", "snapshots.png", "motion.gif"}
    assert (directory / "fig4" / "motion.gif").read_bytes()[:3] == b"GIF"
    shares = motion.energy_shares(model, orbit)
    most = {model.number[r] for r in np.argsort(shares)[::-1][:4]}
    assert {1, 4, 6} <= most  # the paper: modes 4 and 6 beside f01 (15 is not among these)


def test_motion_needs_shapes(make_model, membrane):
    _, _, branch = membrane
    with pytest.raises(ModelError, match="no"):
        motion.deflection(make_model(11, shapes=None), branch.orbit(0), 0.0)
    with pytest.raises(ModelError, match="no"):
        pictures.animate(make_model(11, shapes=None), branch.orbit(0), "never.gif")
