"""Effective coefficients have exact derivatives; spreads are those of samples of devices."""

import attrs
import numpy as np
import pytest

import nanorom
from nanorom.cli.main import main
from nanorom.errors import ModelError, SceneError
from nanorom.exact import cases
from nanorom.fem.reduce import reduce_scene
from nanorom.rom import quantities

DRUM = cases.paper_drum().scene
STEP = 2e-3  # of ln h, extrapolated from two: h^4 counts 1e-10
TOLERANCE = 1e-6  # what issue and scene ask for
NAMES = ["beta1", "delta1", "chi11", "chi12", "onset1", "beta1/b111"]


def accurate(scene, change):
    moved = attrs.evolve(scene.plate, thickness=scene.plate.thickness * np.exp(change))
    found = reduce_scene(attrs.evolve(scene, plate=moved)).with_damping(scene.damping)
    return np.array([quantities.value(name, found, found.label)[0] for name in NAMES])


def test_effective_coefficients_and_backbones_change_as_accurate_runs_do():
    """chi11 is the curvature of the backbone, d f / d a^2."""
    scene = attrs.evolve(DRUM.with_(modes=[1, 2, 6]), damping=nanorom.Damping(180.0))
    table = nanorom.sensitivity(scene, of=NAMES, by=["plate.thickness"])
    near, far = (
        (accurate(scene, step) - accurate(scene, -step)) / (2 * step) for step in (STEP, 2 * STEP)
    )
    expected = (4 * near - far) / 3
    np.testing.assert_allclose(table.value, accurate(scene, 0.0), rtol=1e-9)
    assert np.abs(table.slope[:, 0] / table.value - expected / table.value).max() < TOLERANCE
    assert table.unit == ("N/m^3", "N/m^5", "Hz/m^2", "Hz/m^2", "m", "1")


def test_coefficients_of_one_mode_are_those_of_the_oscillator():
    """One Duffing mode: beta is b, f changes by 3/8 beta a^2/k, bistability from a_c on."""
    scene = attrs.evolve(DRUM.with_(modes=1), damping=nanorom.Damping(180.0))
    model = reduce_scene(scene).with_damping(scene.damping)
    f, b, k, beta, chi, onset, quality = (
        quantities.value(name, model, model.label)[0]
        for name in ("f1", "b111", "k1", "beta1", "chi11", "onset1", "Q1")
    )
    assert beta == pytest.approx(b, rel=1e-10) and quality == pytest.approx(180)
    assert chi == pytest.approx(3 / 8 * f * b / k, rel=1e-6)
    assert onset == pytest.approx(np.sqrt(8 * k / (3 * np.sqrt(3) * 180 * b)), rel=1e-6)


MEMBRANE = """
geometry = { shape = "disc", radius = "2.5 um +- 1 %" }
plate = { thickness = "10 nm +- 3 %", model = "membrane" }
material = { youngs_modulus = "410 GPa", poisson_ratio = 0.16, density = "2267 kg/m^3" }
tension = { stress = "30 MPa +- 5 %" }
modes = { count = 1 }
accuracy = { tolerance = 1e-4 }
"""


def test_spreads_of_a_scene_are_those_of_its_devices(tmp_path):
    """f goes with stress^1/2 / R, b with stress^0: a thickness moves the tension at a stress."""
    path = tmp_path / "membrane.toml"
    path.write_text(MEMBRANE)
    table = nanorom.sensitivity(path, of=["f1", "m1"])
    f, m = table.deviation / table.value
    assert f == pytest.approx(np.hypot(0.025, 0.01), rel=1e-6)
    assert m == pytest.approx(np.hypot(0.03, 0.02), rel=1e-6)
    assert abs(table.share[0, table.source.index("plate.thickness")]) < 1e-6 * table.value[0]
    vary = {
        "plate.thickness": "10 nm +- 3 %",
        "tension.stress": "30 MPa +- 5 %",
        "geometry.radius": "2.5 um +- 1 %",
    }
    count = 32
    study = nanorom.study(path, vary, ["f1", "m1"], samples=count, processes=1, method="latin")
    off = 4 / (2 * count) ** 0.5  # four standard errors of plain samples
    assert study["f1"].std() / study["f1"].mean() == pytest.approx(f, rel=off)
    assert study["m1"].std() / study["m1"].mean() == pytest.approx(m, rel=off)


def test_means_are_what_everybody_else_sees():
    plain = MEMBRANE
    for spread in (" +- 1 %", " +- 3 %", " +- 5 %"):
        plain = plain.replace(spread, "")
    spread, bare = nanorom.Scene.from_toml(MEMBRANE), nanorom.Scene.from_toml(plain)
    assert attrs.evolve(spread, spread=None) == bare
    assert nanorom.Scene.from_toml(spread.to_toml()) == spread
    moved = spread.spread.deviation["plate.thickness"]
    assert moved["plate.thickness"] == pytest.approx(3e-10, rel=1e-9)
    assert moved["tension.x"] == moved["tension.y"] == pytest.approx(0.009, rel=1e-9)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("10 nm +- 3 %", "10 nm +- 0 %", "greater than 0"),
        ("10 nm +- 3 %", "10 nm +- 3 kg", "one dimension"),
        ("10 nm +- 3 %", "10 kg +- 3 %", "another dimension"),
        ('"membrane"', '"membrane +- 3 %"', "plate.model"),
    ],
)
def test_spreads_that_make_no_sense_are_told_in_one_line(old, new, told):
    with pytest.raises(SceneError, match=told) as error:
        nanorom.Scene.from_toml(MEMBRANE.replace(old, new))
    assert "\n" not in str(error.value)


def test_command_prints_deviations(tmp_path, capsys):
    path = tmp_path / "membrane.toml"
    path.write_text(MEMBRANE)
    command = ["sensitivity", str(path), "--of", "f1", "--spread", "material.density=2%"]
    assert main([*command, "-o", str(tmp_path / "table.csv")]) == 0
    text = capsys.readouterr().out
    percent = 100 * np.sqrt(0.025**2 + 0.01**2 + 0.01**2)
    assert "standard deviations" in text and f"{percent:.3f}" in text
    head, row = (tmp_path / "table.csv").read_text().splitlines()[:2]
    cells = dict(zip(head.split(","), row.split(",")))
    assert float(cells["deviation"]) / float(cells["value"]) == pytest.approx(percent / 100, 1e-6)
    assert main([*command[:-1], "plate.colour=2%"]) == 1
    assert "spread: found 'plate.colour'" in capsys.readouterr().err


def test_quality_factors_by_losses_have_derivatives_by_reductions_alone():
    """A membrane's share of bending goes with the thickness; the loss with the material's."""
    lossy = attrs.evolve(DRUM.with_(modes=1).material, loss=1e-4)
    scene = attrs.evolve(DRUM.with_(modes=1), material=lossy, damping=nanorom.Damping())
    with pytest.raises((ModelError, SceneError), match="loss"):
        nanorom.sensitivity(scene, of=["Q1"], exact=True)
    table = nanorom.sensitivity(scene, of=["Q1"], by=["material.loss", "plate.thickness"])
    assert table["Q1", "material.loss"] == pytest.approx(-1, abs=1e-9)
    assert -3 < table["Q1", "plate.thickness"] < -1
