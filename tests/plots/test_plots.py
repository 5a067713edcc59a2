"""Pictures of models and responses show what their numbers say."""

import attrs
import matplotlib
import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.image import imread

from nanorom.continuation import Branch, Diagram, SpecialPoint
from nanorom.continuation.orbits.bifurcations import KINDS
from nanorom.errors import FileError, ModelError
from nanorom.plots import amplitude_panels, mode_gallery, response_figure
from nanorom.plots.curves import smooth
from nanorom.plots.style import COLUMN, axis_unit, scaled, with_unit
from nanorom.results.response import Response
from nanorom.rom.shapes import Shapes
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Sweep

COLUMN_PIXELS = 1003  # 85 mm at 300 dots per inch


def branch(omega, amplitude, stable):
    count, size = amplitude.shape
    return Branch(
        omega=omega,
        amplitude=amplitude,
        stable=stable,
        multipliers=np.zeros((count, 2 * size), dtype=complex),
        period_multiple=1,
        parent=None,
        origin=None,
        coefficients=[np.ones((3, size))] * count,
    )


def special_point(kind, omega, amplitude):
    size = len(amplitude)
    return SpecialPoint(
        type=kind,
        omega=omega,
        amplitude=amplitude,
        multipliers=np.ones(2 * size, dtype=complex),
        state=np.zeros(2 * size),
        branch=0,
        period_multiple=1,
        coefficients=np.ones((3, size)),
    )


@pytest.fixture
def response():
    """Two levels of a made-up resonance; mode 3 hardly moves, points 40 ... 59 are unstable."""
    angle = np.linspace(0, np.pi, 100)
    omega = 2 * np.pi * np.linspace(19e6, 25e6, 100)
    stable = np.ones(100, dtype=bool)
    stable[40:60] = False
    diagrams = []
    for height in (5e-9, 20e-9):
        shares = np.array([1.0, 0.1, 1e-6])
        amplitude = height * np.sin(angle)[:, None] * shares
        points = [special_point(kind, 2 * np.pi * 22e6, height * shares) for kind in ("LP", "PD")]
        diagrams.append(Diagram([branch(omega, amplitude, stable)], points, height, 0.0))
    return Response(
        diagrams=tuple(diagrams),
        drive=Drive(["5 Pa", "20 Pa"]),
        sweep=Sweep("0.95 f1", "1.2 f1"),
        frequency=np.array([20e6, 30e6, 40e6]),
        label=("f01", "f11c", "f11s"),
    )


def curves(axes):
    return [line for line in axes.lines if line.get_marker() == "None"]


def marks(axes):
    return [line for line in axes.lines if line.get_marker() != "None"]


def test_curve_is_solid_where_stable_and_dashed_where_not(response):
    axes = response_figure(response).axes[0]
    low = [line for line in curves(axes) if line.get_ydata().max() < 6]
    assert [line.is_dashed() for line in low] == [False, True, False]
    dashed = low[1]
    # the unstable stretch reaches to its neighbours, so that no gap shows
    assert dashed.get_xdata()[0] == low[0].get_xdata()[-1]
    assert dashed.get_xdata()[-1] == low[2].get_xdata()[0]
    computed = np.linspace(19, 25, 100)[[39, 60]]  # last stable point, first stable point
    assert dashed.get_xdata()[[0, -1]] == pytest.approx(computed, rel=1e-12)


def test_drawn_curve_is_smooth_passes_the_computed_points_and_does_not_overshoot():
    angle = np.linspace(0, 2 * np.pi, 25)
    omega, amplitude = np.cos(angle), (1 + np.sin(angle))[:, None]
    fine_omega, fine_amplitude, position = smooth(omega, amplitude)
    assert np.allclose(fine_omega[position], omega, rtol=0, atol=1e-12)
    assert np.allclose(fine_amplitude[position], amplitude, rtol=0, atol=1e-12)
    radius = np.hypot(fine_omega, fine_amplitude[:, 0] - 1)
    assert np.abs(radius - 1).max() < 2e-3  # straight lines between the points are 9e-3 off
    assert fine_amplitude.min() > -2e-3
    assert fine_amplitude.max() < 2 + 2e-3


def test_drawn_curve_runs_into_a_fold_that_steps_pass_over(response):
    along = np.concatenate([np.linspace(-1, -0.08, 15), np.linspace(0.05, 1, 15)])
    omega = 2 * np.pi * (22e6 - 1e6 * along**2)  # folds over where along = 0
    amplitude = 1e-9 * (3 + along)[:, None] * [1.0, 0.1, 1e-6]
    fold = special_point("LP", 2 * np.pi * 22e6, np.array([3e-9, 0.3e-9, 3e-15]))
    diagram = Diagram([branch(omega, amplitude, along < 0)], [fold], 5e-9, 0.0)
    axes = response_figure(attrs.evolve(response, diagrams=(diagram,))).axes[0]
    stable, unstable = curves(axes)
    fold_drawn = marks(axes)[0].get_xydata()[0]
    assert stable.get_xydata()[-1] == pytest.approx(fold_drawn)
    assert unstable.get_xydata()[0] == pytest.approx(fold_drawn)
    assert len(unstable.get_xdata()) > 15


def test_axes_are_in_prefixed_units_of_the_data(response):
    axes = response_figure(response).axes[0]
    assert axes.get_xlabel() == "drive frequency (MHz)"
    assert axes.get_ylabel() == "amplitude |q| of all modes (nm)"
    assert axes.get_xlim() == pytest.approx((19, 24))
    top = max(line.get_ydata().max() for line in curves(axes))
    assert top == pytest.approx(20 * np.sqrt(1.01), rel=1e-3)


def test_special_points_have_the_marker_of_their_type_and_the_colour_of_their_level(response):
    axes = response_figure(response).axes[0]
    found = {(line.get_marker(), to_hex(line.get_color())) for line in marks(axes)}
    colours = {to_hex(line.get_color()) for line in curves(axes)}
    assert len(colours) == 2
    assert found == {(KINDS[kind].marker, colour) for kind in ("LP", "PD") for colour in colours}
    assert marks(axes)[0].get_xdata()[0] == pytest.approx(22)


def test_legend_names_levels_styles_and_the_types_that_occur(response):
    legend = response_figure(response).axes[0].get_legend()
    texts = [text.get_text() for text in legend.get_texts()]
    assert texts == ["5 Pa", "20 Pa", "stable", "unstable", "fold", "period doubling"]


def test_amplitude_of_a_mode_alone_has_its_name(response):
    for diagram in response.diagrams:
        for branch in diagram.branches:
            branch.amplitude[:, 1:] = 0
    assert response_figure(response).axes[0].get_ylabel() == "amplitude of f01 (nm)"


def test_legend_leaves_out_what_lies_outside_the_sweep(response):
    response.diagrams[1].special_points[0].type = "NS"
    response.diagrams[1].special_points[0].omega *= 2
    legend = response_figure(response).axes[0].get_legend()
    assert "Neimark-Sacker" not in [text.get_text() for text in legend.get_texts()]


def test_marks_on_the_edge_of_the_range_are_whole_and_those_outside_are_left_out(response):
    first, second = response.diagrams
    first.special_points[0].omega = 2 * np.pi * 19e6  # where the axis begins
    second.special_points[0].omega = 2 * np.pi * 18.9e6
    axes = response_figure(response).axes[0]
    drawn = marks(axes)
    assert sorted(float(line.get_xdata()[0]) for line in drawn) == pytest.approx([19, 22, 22])
    assert not any(line.get_clip_on() for line in drawn)


def test_arrows_point_to_what_the_range_cuts(response):
    cut = [
        attrs.evolve(
            diagram, branches=[attrs.evolve(b, omega=b.omega * 24 / b.frequency[49] * 1e6)]
        )
        for diagram in response.diagrams
        for b in diagram.branches
    ]  # the top is at 24 MHz, where the range ends
    for diagram in cut:
        (own,) = diagram.branches
        diagram.branches[0] = attrs.evolve(
            own, omega=own.omega[:50], amplitude=own.amplitude[:50], stable=own.stable[:50]
        )
        diagram.special_points.clear()
    axes = response_figure(attrs.evolve(response, diagrams=tuple(cut))).axes[0]
    arrows = marks(axes)
    assert [line.get_marker() for line in arrows] == [5, 5]
    tops = [d.branches[0].amplitude[-1] for d in cut]
    assert [float(line.get_ydata()[0]) for line in arrows] == pytest.approx(
        [1e9 * np.linalg.norm(top) for top in tops]
    )
    names = [text.get_text() for text in axes.get_legend().get_texts()]
    assert "still rises where the range ends" in names
    assert not marks(response_figure(response).axes[0])[4:]


def test_panels_show_the_modes_that_take_part(response):
    axes = amplitude_panels(response).axes
    assert [panel.get_ylabel() for panel in axes] == ["f01\n(nm)", "f11c\n(nm)"]
    assert max(line.get_ydata().max() for line in curves(axes[1])) == pytest.approx(2, rel=1e-3)
    assert axes[0].get_xlim() == axes[1].get_xlim()


def test_gallery_has_a_panel_per_mode_with_name_and_frequency(make_model):
    model = make_model(5)
    *panels, bar = mode_gallery(model).axes
    assert len(panels) == 5
    titles = [panel.get_title().split("\n") for panel in panels]
    assert [title[0] for title in titles] == list(model.label)
    for (_, text), frequency in zip(titles, model.frequency):
        number, unit = text.split()
        assert unit == "MHz"
        assert float(number) == pytest.approx(frequency / 1e6, rel=1e-3)
    assert bar.get_xlabel() == "mode shape φ"
    flat = np.where(np.arange(5)[:, None] == 3, 0.01, model.shapes.values)
    along = attrs.evolve(model, shapes=attrs.evolve(model.shapes, values=flat))
    titles = [panel.get_title().split("\n")[0] for panel in mode_gallery(along).axes[:-1]]
    assert [title.endswith(", in plane") for title in titles] == [False] * 3 + [True, False]


def test_films_keep_their_proportions_unless_they_are_very_narrow(make_model):
    model = make_model(2)
    figure = mode_gallery(model)
    assert figure.axes[0].get_aspect() == 1
    assert not figure.texts

    points = model.shapes.points * np.array([1.0, 0.02, 1.0])
    string = make_model(2, shapes=Shapes(points, model.shapes.cells, model.shapes.values))
    figure = mode_gallery(string)
    assert figure.axes[0].get_aspect() == pytest.approx(6.25)
    assert figure.texts[0].get_text() == "films drawn 6.25 times as wide as they are"


def test_model_without_shapes_cannot_be_drawn(make_model):
    with pytest.raises(ModelError, match="shapes"):
        mode_gallery(make_model(2, shapes=None))


def test_pictures_are_a_column_wide_and_written_whole(tmp_path, make_model, response):
    mode_gallery(make_model(3), tmp_path / "modes.png")
    response_figure(response, tmp_path / "response.png")
    amplitude_panels(response, tmp_path / "amplitudes.pdf")
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        "amplitudes.pdf",
        "modes.png",
        "response.png",
    ]
    for name in ("modes.png", "response.png"):
        image = imread(tmp_path / name)[..., :3]
        assert image.shape[1] == pytest.approx(COLUMN_PIXELS, abs=2)
        assert image.std() > 0.05  # something is drawn
        border = np.concatenate([image[0], image[-1], image[:, 0], image[:, -1]])
        assert (border == 1).all()  # and nothing is cut off at the edge
    with pytest.raises(FileError, match="there is no directory"):
        response_figure(response, tmp_path / "none" / "response.png")


def test_drawing_leaves_the_callers_settings_alone(response):
    before = dict(matplotlib.rcParams)
    response_figure(response)
    assert dict(matplotlib.rcParams) == before


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (21.15119e6, "Hz", "21.15 MHz"),
        (1e-9, "m", "1 nm"),
        (999e-12, "m", "999 pm"),
        (0.0, "m", "0 m"),
        (-0.002, "N/m", "-2 mN/m"),
    ],
)
def test_values_are_shown_with_the_prefix_that_fits(value, unit, text):
    assert with_unit(value, unit) == text


def test_units_beside_axes_have_no_prefix_where_their_metre_has_a_power():
    assert axis_unit([1.7e15, 2e12], "N/m^3") == (1e-15, "10$^{15}$ N/m$^{3}$")
    assert axis_unit([2e7], "Hz") == (1e-6, "MHz")
    assert axis_unit([3.0], "") == (1.0, "")


def test_prefix_of_an_axis_follows_its_largest_value():
    assert scaled([1e-12, 2e-8], "m")[1] == "nm"
    assert scaled([0.0], "m") == (1.0, "m")
    assert COLUMN == pytest.approx(85 / 25.4)
