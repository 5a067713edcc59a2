"""Load curves of scenes: gates up to their pull-in, snap-through, indentation."""

import re

import attrs
import numpy as np
import pytest

from nanorom.cli.main import main
from nanorom.errors import SceneError
from nanorom.fem.reduce import reduce_scene
from nanorom.fem.statics.chords import chord_errors
from nanorom.fem.tuning import follow
from nanorom.plots import load_curve
from nanorom.results.loadcurve import LoadCurve
from nanorom.rom.manifold.coefficients import oscillator
from nanorom.scene.film import Plate, Tension
from nanorom.scene.load import VACUUM_PERMITTIVITY, Load
from nanorom.scene.scene import Accuracy, Modes
from nanorom.workflow import tune
from tests.fem.routes.test_loaded_scenes import MODULUS, RADIUS, TENSION, THICKNESS, UNIT, drum

ROUGH = Accuracy(degree=5, mesh_size=RADIUS / 2)
EXACT_PULL_IN = 0.7892  # V^2 eps0 R^2/(2 T g^3): Pelesko and Bernstein 2002, table 7.1
LUMPED_PULL_IN = 32 / 27  # the same of a rigid plate on a spring of the mean stiffness 8 T/R^2


def gated(gap, share, **changes):
    """A membrane above a gate, with a multiple of the pull-in voltage of a stiff one."""
    pull_in = np.sqrt(EXACT_PULL_IN * 2 * TENSION * gap**3 / (VACUUM_PERMITTIVITY * RADIUS**2))
    load = Load(voltage=share * pull_in, gap=gap)
    return drum(load, **{"plate": Plate(THICKNESS, "membrane"), "accuracy": ROUGH, **changes})


def test_pull_in_lies_below_the_lumped_estimate_by_its_bowed_shape():
    """A film bows: its middle comes closer than the mean, where the attraction grows fastest.

    Without stretching, that lowers the voltage by sqrt(0.7892/(32/27)) = 0.816.
    """
    curve = follow(gated(0.01 * UNIT, 1.5, modes=Modes(count=1)), points=6)
    assert curve.pull_in / curve.lumped == pytest.approx(
        np.sqrt(EXACT_PULL_IN / LUMPED_PULL_IN), rel=1e-3
    )
    frequency = curve.frequency[curve.stable, 0]
    assert np.all(np.diff(frequency) < 0)  # only softening
    assert curve.load[-1] == curve.pull_in
    assert not curve.stable[-1]


def test_stretching_turns_softening_into_stiffening_and_raises_the_pull_in():
    """Across a wide gap the film stiffens before it is pulled in, beyond the lumped estimate."""
    curve = follow(gated(3 * UNIT, 3.0, modes=Modes(count=1)), points=8)
    frequency = curve.frequency[curve.stable, 0]
    lowest, highest = frequency.argmin(), frequency.argmax()
    assert 0 < lowest < highest < len(frequency) - 1  # softer, stiffer, and soft at the end
    assert curve.pull_in > 1.2 * curve.lumped
    told = curve.text()
    assert "pulled in at" in told and "mean stiffness" in told


def test_states_left_of_those_asked_for_go_where_the_curves_bend():
    """Up to the pull-in, where the frequency falls to nothing; each is one that loads lead to."""
    scene = gated(3 * UNIT, 3.0, modes=Modes(count=1))
    curve = follow(scene, points=20)
    assert len(curve.load) == 20
    frequency = curve.frequency[curve.stable, 0]
    assert np.all(np.diff(curve.load) > 0) and np.all(np.diff(curve.centre) > 0)
    assert frequency[-1] < 0.7 * frequency.max()
    assert np.abs(np.diff(frequency)).max() < 0.2 * frequency.max()
    volts = curve.load[[8, -2]]
    stepped = tune(scene, at=volts.tolist())
    assert stepped.frequency[:, 0] == pytest.approx(curve.frequency[[8, -2], 0], rel=1e-6)
    # Newton's method from rest finds the state beyond the pull-in, which is refused
    model = reduce_scene(attrs.evolve(scene, load=Load(voltage=volts[1], gap=3 * UNIT)))
    assert model.frequency[0] == pytest.approx(curve.frequency[-2, 0], rel=1e-6)


def test_chord_errors_are_heights_of_arcs():
    angle = np.linspace(0, np.pi / 2, 9)
    curves = np.column_stack([np.sin(angle), np.where(angle > 1, np.nan, 0.0)])
    height = 1 - np.cos(np.pi / 32)
    assert chord_errors(np.cos(angle), curves) == pytest.approx(np.full(8, height), rel=2e-3)
    assert not chord_errors(np.arange(4.0), np.ones((4, 1))).any()


def test_shallow_dome_snaps_through_from_its_scene(tmp_path):
    axis = np.linspace(-1.01, 1.01, 41) * RADIUS
    x, y = (each.ravel() for each in np.meshgrid(axis, axis))
    file = tmp_path / "dome.txt"
    height = 2.5 * THICKNESS * (1 - (x**2 + y**2) / RADIUS**2)
    np.savetxt(file, np.column_stack([x, y, height]))
    scene = drum(
        Load(pressure=-6e3),
        plate=Plate(THICKNESS, "plate", file),
        tension=Tension(0.0, 0.0),
        accuracy=ROUGH,
        modes=Modes(count=1),
    )
    curve = follow(scene, points=8)
    first, second = curve.limits
    assert first < second < 0  # pressed down to the first, released to the second
    at = [int(np.flatnonzero(curve.load == limit)[0]) for limit in curve.limits]
    assert not curve.stable[at[0] : at[1] + 1].any()
    assert curve.stable[0] and curve.stable[-1]
    assert curve.centre[-1] < -2.5 * THICKNESS  # turned inside out
    assert curve.load[-1] == -6e3


def test_cubic_coefficients_are_those_of_models_about_the_states(tmp_path):
    """At rest that of table 1 (a membrane's f01), under load that of a reduced model."""
    scene = gated(3 * UNIT, 1.0, modes=Modes(count=1))
    volts = scene.load.voltage * np.array([0.02, 0.7, 1.2])
    curve = tune(scene, at=volts.tolist())
    unit = MODULUS * THICKNESS / RADIUS**2
    assert curve.cubic[0, 0] == pytest.approx(2.839702975852 * unit, rel=3e-3)
    loaded = attrs.evolve(scene, load=Load(voltage=volts[2], gap=3 * UNIT))
    model = reduce_scene(loaded)
    assert curve.cubic[2, 0] == pytest.approx(oscillator(model, 0).cubic, rel=1e-6)
    assert curve.frequency[2, 0] == pytest.approx(model.frequency[0], rel=1e-9)
    assert curve.tension[2] == pytest.approx(float(model.static["mean_tension"]), rel=1e-9)
    (at,) = curve.turns["f01"]
    assert volts[0] < at < volts[2] and curve.cubic[2, 0] < 0
    assert "the cubic coefficient of f01 changes its sign at" in curve.text()
    curve.save(tmp_path / "curve.h5")
    assert LoadCurve.load_file(tmp_path / "curve.h5").turns == curve.turns
    load_curve(curve, tmp_path / "curve.png")


def test_chosen_loads_that_do_not_rise_or_are_no_loads_are_told():
    scene = gated(3 * UNIT, 1.0, modes=Modes(count=1))
    with pytest.raises(SceneError, match="at: found 2, 1 V; allowed: values that rise"):
        tune(scene, at=["2 V", "1 V"])
    with pytest.raises(SceneError, match=r"at\[1\]: found '2 Pa'"):
        tune(scene, at=["2 Pa"])


SCENE = """
[geometry]
shape = "disc"
radius = "1 um"
[plate]
thickness = "2 nm"
[material]
youngs_modulus = "300 GPa"
poisson_ratio = 0.25
density = "3000 kg/m^3"
[tension]
value = "0.1 N/m"
[modes]
count = 1
[load]
force = "300 nN"
radius = "50 nm"
[accuracy]
degree = 5
mesh_size = "0.4 um"
"""


def test_indentation_curve_is_a_table_a_file_and_a_picture(tmp_path, capsys):
    scene = tmp_path / "afm.toml"
    scene.write_text(SCENE)
    assert main(["tune", str(scene), "-o", str(tmp_path / "afm.h5"), "--points", "6"]) == 0
    printed = capsys.readouterr().out
    curve = LoadCurve.load_file(tmp_path / "afm.h5")
    assert printed == curve.text() + "\n"
    assert curve.label == ("f01",)
    assert re.search(r"force \(nN\) +centre \(nm\) +largest \(nm\) +f01 \(MHz\)", printed)
    table = np.loadtxt(tmp_path / "afm.csv", delimiter=",", skiprows=1)
    assert table[:, 1] == pytest.approx(curve.centre, rel=1e-8)
    slope = np.diff(np.log(curve.load[1:])) / np.diff(np.log(curve.centre[1:]))
    assert np.all(np.diff(slope) > -0.05)
    assert slope[-1] > 2.5  # towards F ~ w^3
    assert main(["info", str(tmp_path / "afm.h5")]) == 0
    assert capsys.readouterr().out == printed
    (tmp_path / "afm.png").unlink()
    assert main(["plot", str(tmp_path / "afm.h5")]) == 0
    assert (tmp_path / "afm.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    "scene, key",
    [
        (drum(None), "load"),
        (drum(Load(stress=1e6)), "load"),
        (drum(Load(pressure=1.0), plate=Plate(THICKNESS, "shell")), r"plate\.model"),
    ],
)
def test_curves_that_cannot_be_followed_name_the_key(scene, key):
    with pytest.raises(SceneError, match=key):
        follow(scene)
