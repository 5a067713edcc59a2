"""Tables of many devices: exact frequencies, failures in their rows, runs that go on."""

import numpy as np
import pytest
from scipy.special import jn_zeros

import nanorom
from nanorom.devices import study as room
from nanorom.errors import NanoromError
from nanorom.report.study import study_text
from nanorom.results.study import Study
from tests.devices.membranes import MEMBRANE

VARY = {"tension.value": ["0.2 N/m", "-0.1 N/m", "0.4 N/m"], "geometry.radius": ["2 um", "3 um"]}
TOLERANCE = 1e-4  # of the scene


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    path = tmp_path_factory.mktemp("study") / "membrane.toml"
    path.write_text(MEMBRANE)
    return path


@pytest.fixture(scope="module")
def found(scene):
    return nanorom.study(scene, VARY, ["f1", "m1"], processes=1)


def test_frequencies_of_membranes_are_exact(found):
    tension, radius = found["tension.value"], found["geometry.radius"]
    good = tension > 0
    exact = jn_zeros(0, 1)[0] / (2 * np.pi * radius[good]) * np.sqrt(tension[good] / 2.267e-5)
    np.testing.assert_allclose(found["f1"][good], exact, rtol=TOLERANCE)
    assert found.of_unit == ("Hz", "kg")


def test_a_device_that_fails_is_a_row_with_its_reason(found):
    failed = found["tension.value"] < 0
    assert np.array_equal(found.failed, failed)
    assert np.array_equal(np.isnan(found["f1"]), failed)
    assert all(found.remark[row] for row in np.flatnonzero(failed))
    assert "2 failed" in study_text(found)


class Enough(BaseException):
    pass


def test_a_study_that_was_stopped_goes_on_with_the_same_table(found, scene, tmp_path, monkeypatch):
    path = tmp_path / "study.h5"

    def stop(_, done, __):
        if done == 3:
            raise Enough

    with pytest.raises(Enough):
        nanorom.study(scene, VARY, ["f1", "m1"], processes=1, path=path, progress=stop)
    assert not path.exists()
    asked = []
    each = room.each
    counted = lambda jobs, *rest: each((asked.append(job[0]) or job for job in jobs), *rest)  # noqa: E731
    monkeypatch.setattr(room, "each", counted)
    again = nanorom.study(scene, VARY, ["f1", "m1"], processes=1, path=path)
    assert sorted(asked) == [2, 3, 4, 5]  # the third has failed
    np.testing.assert_array_equal(again.value, found.value)
    assert [file.name for file in tmp_path.iterdir()] == ["study.h5"]
    loaded = Study.load(path)
    np.testing.assert_array_equal(loaded.value, found.value)
    assert (loaded.by, loaded.of, loaded.remark) == (found.by, found.of, found.remark)


def test_a_launcher_of_ranks_is_refused(scene, monkeypatch):
    monkeypatch.setenv("OMPI_COMM_WORLD_SIZE", "2")
    with pytest.raises(NanoromError, match="without mpirun"):
        nanorom.study(scene, VARY, ["f1"])
