"""Measured responses lie over the model's where their numbers say."""

import re

import numpy as np
import pytest
from matplotlib.colors import to_hex

from nanorom.errors import FileError, ScaleWarning
from nanorom.measurement.data import MeasuredResponse
from nanorom.plots import response_figure
from nanorom.results.respond import respond
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Sweep
from tests.conftest import random_model

ROUNDED = 5e-3  # factors are told with three digits
HEAD = "frequency (MHz),amplitude ({}),sweep,level"


def duffing():
    """A Duffing resonance at 20 MHz whose model is made up; amplitudes are some nm."""
    k = 1.6e-16 * (2 * np.pi * 20e6) ** 2
    model = random_model(
        1,
        frequency=[20e6],
        mass=[1.6e-16],
        stiffness=[[k]],
        damping=[[1.6e-16 * 2 * np.pi * 20e6 / 100]],
        quadratic=np.zeros((1, 1, 1)),
        cubic=np.full((1, 1, 1, 1), k / 1e-15),
        drive={"pressure": np.array([1e-11])},
    )
    return respond(model, Drive(["5 Pa", "10 Pa"]), Sweep("0.9 f1", "1.1 f1"), processes=1)


@pytest.fixture(scope="module")
def response():
    return duffing()


@pytest.fixture
def read(tmp_path):
    def read(unit, *rows):
        path = tmp_path / "measured.csv"
        path.write_text("\n".join([HEAD.format(unit), *rows]), encoding="utf-8")
        return MeasuredResponse.from_file(path)

    return read


def points(axes):
    """Markers of data: those without an edge."""
    return [line for line in axes.lines if line.get_markeredgewidth() == 0]


def texts(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


def test_lengths_are_drawn_to_scale_with_markers_by_direction_and_colours_by_level(response, read):
    measured = read("pm", "19,500,up,5 Pa", "20,700,up,5 Pa", "21,300,down,5 Pa", "19,900,up,x")
    assert measured.unit == "m"
    figure = response_figure(response, measured=measured)
    (axes,) = figure.axes
    up, down, other = points(axes)
    assert up.get_xydata() == pytest.approx(np.array([[19, 0.5], [20, 0.7]]))
    assert down.get_xydata() == pytest.approx(np.array([[21, 0.3]]))
    assert (up.get_marker(), down.get_marker()) == ("^", "v")
    assert to_hex(up.get_color()) == to_hex(down.get_color()) != to_hex(other.get_color())
    assert texts(axes)[-3:] == ["data 5 Pa up", "data 5 Pa down", "data x up"]


def test_axes_grow_with_the_data_and_are_otherwise_left_alone(response, read):
    plain = response_figure(response).axes[0].get_ylim()
    low = response_figure(response, measured=read("nm", "20,1e-3,,")).axes[0]
    high = response_figure(response, measured=read("nm", "20,1000,,")).axes[0]
    assert low.get_ylim() == plain
    assert high.get_ylim()[1] > 1000
    assert low.get_xlim() == high.get_xlim() == response_figure(response).axes[0].get_xlim()


def test_voltages_get_an_axis_of_their_own_with_the_same_zero_and_top(response, read):
    with pytest.warns(ScaleWarning, match="1 mV as") as told:
        left, right = response_figure(response, measured=read("mV", "19,1,,", "20,30,,")).axes
    factor = re.search(r"1 mV as (\S+) (\w+)", str(told[0].message))
    assert right.get_ylabel() == f"measured (mV), drawn with {factor[0]}"
    assert left.get_ylabel().endswith(f"({factor[2]})")
    drawn = 30 / right.get_ylim()[1] * left.get_ylim()[1]
    assert float(factor[1]) * 30 == pytest.approx(drawn, rel=ROUNDED)
    assert points(right)[0].get_ydata() == pytest.approx([1, 30])
    place = [axes.get_ylim()[0] / np.ptp(axes.get_ylim()) for axes in (left, right)]
    assert place[0] == pytest.approx(place[1])
    top = max(line.get_ydata().max() for line in left.lines)
    assert 30 / right.get_ylim()[1] == pytest.approx(top / left.get_ylim()[1], rel=1e-3)


def test_decibels_become_amplitudes_by_the_largest(response, read):
    with pytest.warns(ScaleWarning, match="1 a.u. as"):
        _, right = response_figure(response, measured=read("dBm", "19,-80,,", "20,-60,,")).axes
    assert points(right)[0].get_ydata() == pytest.approx([0.1, 1])
    assert right.get_ylabel().startswith("measured (a.u., from dBm)")


def test_data_outside_of_the_swept_range_are_refused(response, read):
    with pytest.raises(FileError, match="none of the frequencies is between 18 and 22 MHz"):
        response_figure(response, measured=read("nm", "50,1,,"))


def test_names_of_levels_do_not_leave_the_picture(response, read):
    """Beside a second axis the axes are no longer in the middle."""
    measured = read("dBm", "19,-80,up,20 Pa", "20,-60,down,20 Pa")
    with pytest.warns(ScaleWarning):
        figure = response_figure(response, measured=measured)
    figure.draw_without_rendering()
    box = figure.axes[0].get_legend().get_window_extent()
    assert box.x0 >= 0 and box.x1 <= figure.bbox.width
