"""Devices of a study share meshes and factors, and are what each is alone."""

import numpy as np
import pytest

import nanorom
from nanorom.devices import worker
from nanorom.fem.mesh import kept
from nanorom.rom import quantities

OF = ["f1", "f2", "b111", "b122@1"]
SAME = 1e-9  # relative, of a device beside others and alone
THICKNESSES, RATIOS = (9.7e-9, 10e-9, 10.3e-9), (0.16, 0.3, 0.16)


def drum(thickness, ratio):
    return {
        "geometry": {"shape": "disc", "radius": "2.5 um"},
        "plate": {"thickness": thickness},
        "material": {"youngs_modulus": "410 GPa", "poisson_ratio": ratio, "density": 2267.0},
        "tension": {"x": "0.321 N/m", "y": "0.257 N/m"},
        "modes": {"count": 2},
        "accuracy": {"tolerance": 1e-4},
    }


def test_devices_on_one_mesh_are_what_each_is_alone():
    before = len(kept._meshes)
    scenes = [drum(*numbers) for numbers in zip(THICKNESSES, RATIOS)]
    jobs = [{"scene": scene, "directory": ".", "of": OF} for scene in scenes]
    found = [worker.answer(job) for job in jobs]
    assert len(kept._meshes) == before + 1
    for scene, answer in zip(scenes, found):
        model = nanorom.reduce(nanorom.Scene.from_dict(scene))
        alone = [quantities.value(name, model, model.label)[0] for name in OF]
        np.testing.assert_allclose(answer["values"], alone, rtol=SAME)
    assert found[0]["values"] != pytest.approx(found[2]["values"], rel=1e-3)


def test_the_last_meshes_alone_are_kept():
    with kept.for_more():
        meshes = [kept.found(("a mesh", number), lambda made: made) for number in range(20)]
        assert all(made == {} for made in meshes)
        assert len(kept._meshes) == kept.MOST
        assert kept.found(("a mesh", 19), lambda made: made) is meshes[19]
        assert kept.found(("a mesh", 0), lambda made: made) is not meshes[0]
    assert kept.found(("a mesh", 19), lambda made: made) is None
