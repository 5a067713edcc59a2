"""Pictures of diagrams from plain arrays show every branch, point and jump, and the spectrum."""

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.image import imread

from nanorom.continuation import ModalSystem, PeriodicOrbit, explore, sweep
from nanorom.continuation.orbits.bifurcations import KINDS
from nanorom.plots import diagram_figure, motion_figure

COLUMN_PIXELS = 1003  # 85 mm at 300 dots per inch
STEP = 0.01  # of the sweep


@pytest.fixture(scope="module")
def system():
    """A driven mode with a Duffing fold and a parametric resonance, and one that follows it."""
    cubic = np.zeros((2, 2, 2, 2))
    cubic[0, 0, 0, 0], cubic[1, 0, 0, 0] = 1.0, 0.3
    return ModalSystem(
        damping=[0.05, 0.05], stiffness=[1.0, 6.0], cubic=cubic, direct=[1, 0], parametric=[1, 0]
    )


@pytest.fixture(scope="module")
def diagram(system):
    return explore(system, (0.8, 2.2), direct=0.1, parametric=0.2)


def test_every_branch_and_special_point_is_drawn_in_the_panel_of_each_mode(diagram, tmp_path):
    figure = diagram_figure(diagram, tmp_path / "diagram.png", labels=("f01", "f02"))
    assert [axes.get_ylabel().split()[-1] for axes in figure.axes] == ["f01", "f02"]
    assert {p.type for p in diagram.special_points} == {"LP", "PD"}
    for mode, axes in enumerate(figure.axes):
        drawn = {
            (line.get_marker(), float(line.get_xdata()[0]), float(line.get_ydata()[0]))
            for line in axes.lines
            if line.get_marker() != "None"
        }
        low, high = axes.get_xlim()
        points = [p for p in diagram.special_points if low <= p.omega <= high]
        assert len(points) >= 4
        assert drawn == {(KINDS[p.type].marker, p.omega, p.amplitude[mode]) for p in points}
        colours = {to_hex(line.get_color()) for line in axes.lines if line.get_marker() == "None"}
        assert len(colours) == len({b.period_multiple for b in diagram.branches}) == 2
    assert imread(tmp_path / "diagram.png").shape[1] == pytest.approx(COLUMN_PIXELS, abs=2)


def test_sweep_jumps_at_the_fold_of_the_branch_under_it(system, diagram):
    branch, fold = diagram.branches[0], max(p.omega for p in diagram.points("LP", branch=0))
    high = branch.stable & (branch.omega < fold) & (branch.amplitude[:, 0] > 0.8)
    orbit = branch.orbit(np.flatnonzero(high)[branch.omega[high].argmax()])
    state = np.concatenate([orbit(0.0), orbit.velocity(0.0)])
    frequencies = np.arange(orbit.omega, fold + 2 * STEP, STEP)
    up = sweep(system, frequencies, direct=0.1, parametric=0.2, state=state)
    figure = diagram_figure(diagram, sweeps={"sweep up": up})
    (line,) = (line for line in figure.axes[0].lines if line.get_label() == "sweep up")
    jump = int(np.argmin(np.diff(line.get_ydata())))
    assert line.get_ydata()[jump + 1] < 0.3 * line.get_ydata()[jump]
    assert line.get_xdata()[jump] == pytest.approx(fold, abs=1.01 * STEP)


def test_spectrum_shows_the_lines_of_the_motion(tmp_path):
    coefficients = np.zeros((7, 1))
    coefficients[1], coefficients[6] = 1.0, 1e-3  # half the drive frequency, and three times that
    figure = motion_figure(PeriodicOrbit(coefficients, 2.0, 2), tmp_path / "motion.png")
    above, below = figure.axes
    assert np.ptp(above.lines[0].get_ydata()) == pytest.approx(2.0, rel=1e-2)
    (lines,) = below.collections
    tops = {(round(x, 12), round(y, 12)) for _, (x, y) in lines.get_segments()}
    assert tops == {(0.5, 1.0), (1.5, 1e-3)}
