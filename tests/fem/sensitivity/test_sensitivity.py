"""Derivatives of models by the numbers of their scenes are those of accurate runs."""

import attrs
import numpy as np
import pytest

import nanorom
from nanorom.cli.main import main
from nanorom.errors import ModelError, SceneError
from nanorom.exact import cases
from nanorom.fem.reduce import reduce_scene
from nanorom.fem.sensitivity.model import model_slopes

STEP = 2e-3  # of a logarithm, extrapolated from two: h^4 counts 1e-10
TOLERANCE = 1e-6  # of the largest entry of an array: what issue and scene ask for
COARSE = 1e-3  # of a mesh that takes no time, on which peaks are as far off
AFFINE = 1e-9  # frequencies follow from modes alone, without a peak
DRUM = cases.paper_drum().scene


def changed(scene, key, factor):
    """The scene with one number by a factor."""
    section, name = key.split(".") if "." in key else (key, None)
    old = getattr(scene, section)
    if name is None or name == "value":
        return scene.with_(tension=nanorom.Tension(factor * old.x, factor * old.y))
    return attrs.evolve(
        scene, **{section: attrs.evolve(old, **{name: factor * getattr(old, name)})}
    )


def differences(scene, key):
    """Derivatives by ln(key) of the arrays of accurate runs."""

    def of(step):
        models = [reduce_scene(changed(scene, key, np.exp(s * step))) for s in (1, -1)]
        return [(a - b) / (2 * step) for a, b in zip(*map(arrays, models))]

    return [(4 * near - far) / 3 for near, far in zip(of(STEP), of(2 * STEP))]


def arrays(model):
    aimed = [model.drive[name] for name in sorted(model.drive)]
    tuned = [model.parametric[name] for name in sorted(model.parametric)]
    return [model.frequency, model.mass, model.stiffness, model.cubic, *aimed, *tuned]


def check(scene, keys, tolerance=TOLERANCE):
    found = model_slopes(scene, keys)
    for value, model in zip(arrays(found.value), arrays(reduce_scene(scene))):
        assert value == pytest.approx(model, rel=1e-9, abs=1e-12 * np.abs(model).max())
    for key in keys:
        expected = differences(scene, key)
        for n, (slope, difference) in enumerate(zip(arrays(found.slope[key]), expected)):
            scale = np.abs(arrays(found.value)[n]).max()
            most = AFFINE if n == 0 else tolerance
            assert np.abs(slope - difference).max() < most * scale, (key, n)


@pytest.mark.parametrize(
    "key",
    ["plate.thickness", "material.poisson_ratio", "tension.x", "geometry.radius"],
)
def test_arrays_of_the_papers_drum_change_as_accurate_runs_do(key):
    """The other numbers act through the same quantities: T, D, nu, E h, rho h, L."""
    asked = {"drive": spot(), "sweep": nanorom.Sweep("0.9 f1", "1.1 f1")}
    drum = attrs.evolve(DRUM, damping=nanorom.Damping(180.0), **asked)
    check(drum.with_(modes=3) if key == "geometry.radius" else DRUM.with_(modes=4), [key])


def spot():
    return nanorom.Drive(1.0, direct_pattern="spot", position=["0.4 um", "0.9 um"], radius="0.5 um")


def test_rectangles_and_membranes_have_derivatives_too():
    plate = nanorom.Scene(
        geometry=nanorom.Rectangle("4 um", "3 um"),
        plate=nanorom.Plate("20 nm", model="plate"),
        material=nanorom.Material("250 GPa", 0.23, 3100),
        tension=nanorom.Tension(0.5, 0.8),
        modes=nanorom.Modes(3),
    )
    coarse = plate.with_(tolerance=COARSE)
    check(coarse, ["plate.thickness"], COARSE)
    check(coarse.with_(plate=nanorom.Plate("20 nm", model="membrane")), ["tension.x"], COARSE)


def test_table_has_names_units_and_relative_changes():
    table = nanorom.sensitivity(
        DRUM.with_(modes=4), of=["f1", "b111", "f2/f1", "b(f01,f01,f11c)@1", "m1"],
        by=["plate.thickness", "material.density", "material.youngs_modulus"],
    )  # fmt: skip
    assert table["f1", "material.density"] == pytest.approx(-0.5)
    assert table["f2/f1", "material.density"] == pytest.approx(0, abs=1e-12)
    assert table["m1", "material.density"] == pytest.approx(1)
    assert table.unit[:3] == ("Hz", "N/m^3", "1")
    assert table.value[0] == pytest.approx(cases.paper_drum().frequency()[0], rel=1e-6)
    with pytest.raises(ModelError, match="allowed: f1, b111"):
        table["f9", "plate.thickness"]


def test_what_has_no_derivative_is_refused_in_one_line():
    with pytest.raises(SceneError, match="by: found 'plate.colour'; allowed: geometry.radius"):
        nanorom.sensitivity(DRUM, by=["plate.colour"])
    with pytest.raises(ModelError, match="of: found 'q1'; allowed: f1, m1"):
        nanorom.sensitivity(DRUM.with_(modes=2), of=["q1"])
    with pytest.raises(ModelError, match="allowed: 1 to 2"):
        nanorom.sensitivity(DRUM.with_(modes=2), of=["f3"])
    loaded = DRUM.with_(load=nanorom.Load(pressure="1 kPa"))
    with pytest.raises(SceneError, match="derivatives are those of a flat film"):
        nanorom.sensitivity(loaded, exact=True)


def test_command_prints_the_table_and_draws_it(tmp_path, capsys):
    path = tmp_path / "table.csv"
    command = ["sensitivity", "demos/drum.toml", "--modes", "3", "--of", "f1,b111,f2/f1"]
    assert main([*command, "--by", "plate.thickness,tension", "-o", str(path)]) == 0
    text = capsys.readouterr().out
    assert "plate.thickness" in text and "per cent" in text
    assert path.read_text().startswith("quantity,value,unit,plate.thickness,tension\nf1,")
    assert path.with_suffix(".png").stat().st_size > 5000
