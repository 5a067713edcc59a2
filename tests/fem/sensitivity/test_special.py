"""Derivatives of special points by numbers of a scene: scaling laws and accurate runs beside."""

import attrs
import numpy as np
import pytest

import nanorom
from nanorom.errors import ModelError, SceneError
from nanorom.scene.scene import Scene
from tests.conftest import DRUM

LAW = 1e-6  # the equations' own accuracy, beside the mesh's
DIFFERENCE = 1e-6  # relative
STEP = 2e-3


def drum(thickness="10 nm"):
    scene = Scene.from_toml(DRUM).with_(tolerance=1e-7)
    return scene.with_(plate=attrs.evolve(scene.plate, thickness=thickness), modes=[1])


@pytest.fixture(scope="module")
def table():
    keys = ["plate.thickness", "material.density", "geometry.radius"]
    return nanorom.sensitivity(drum(), of=["LP1", "LP2@2", "LP1.f01", "f1"], by=keys)


def test_density_scales_every_frequency_and_no_amplitude(table):
    assert table["LP1", "material.density"] == pytest.approx(-0.5, abs=LAW)
    assert table["LP2@2", "material.density"] == pytest.approx(-0.5, abs=LAW)
    assert abs(table["LP1.f01", "material.density"]) < LAW
    assert table.unit == ("Hz", "Hz", "m", "Hz")


def test_derivatives_are_those_of_accurate_runs(table):
    def there(step):
        scene = drum(10e-9 * float(np.exp(step)))
        model = nanorom.reduce(scene)
        response = nanorom.respond(model, scene.drive, scene.sweep, scene.damping, processes=1)
        folds = sorted(response.diagrams[-1].points("LP"), key=lambda point: point.omega)
        return np.log([folds[0].omega, folds[1].omega, folds[0].amplitude[0]])

    near, far = ((there(s) - there(-s)) / (2 * s) for s in (STEP, 2 * STEP))
    names = ("LP1", "LP2@2", "LP1.f01")
    found = [table[name, "plate.thickness"] for name in names]
    np.testing.assert_allclose(found, (4 * near - far) / 3, atol=DIFFERENCE)


@pytest.mark.parametrize("name", ["LP9", "LP0", "LP1@7", "LP1.f77", "NS1"])
def test_points_that_are_not_there_are_told(name):
    with pytest.raises(ModelError, match="of: found"):
        nanorom.sensitivity(drum(), of=[name], by=["material.density"])


def test_a_scene_without_a_drive_has_no_points():
    scene = attrs.evolve(drum(), drive=None, sweep=None)
    with pytest.raises(SceneError, match="drive"):
        nanorom.sensitivity(scene, of=["LP1"])
