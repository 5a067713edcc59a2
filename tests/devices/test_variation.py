"""What a study varies is read as it is meant, and drawn from the distributions that are named."""

from pathlib import Path

import numpy as np
import pytest

from nanorom.devices.request import Request
from nanorom.devices.sampling import Sampling
from nanorom.devices.variation import variations
from nanorom.errors import NanoromError
from nanorom.scene.scene import Scene
from tests.conftest import DRUM

DEMOS = Path(__file__).parents[2] / "demos"
SCENE = Scene.from_toml(DRUM)


def asked(vary, **more):
    return Request.of_table(SCENE, vary, ["f1"], Sampling(**more))


def test_grids_are_products_whose_last_key_is_fastest():
    found = asked(
        {"plate.thickness": ["5 nm", 1e-8], "tension.x": {"from": 1, "to": 3, "count": 3}}
    )
    expected = [[5e-9, 1], [5e-9, 2], [5e-9, 3], [1e-8, 1], [1e-8, 2], [1e-8, 3]]
    assert found.settings.tolist() == expected


def test_tables_within_tables_are_keys():
    nested = variations({"plate": {"thickness": ["5 nm"]}, "tension.x": ["1 N/m"]})
    assert [each.key for each in nested] == ["plate.thickness", "tension.x"]
    assert [each.unit for each in nested] == ["m", "N/m"]


def test_spacing_by_logarithms_has_equal_ratios():
    span = {"from": "1 nm", "to": "100 nm", "count": 5, "spacing": "log"}
    values = asked({"plate.thickness": span}).settings[:, 0]
    np.testing.assert_allclose(values[1:] / values[:-1], 10**0.5, rtol=1e-12)
    assert (values[0], values[-1]) == (1e-9, 1e-7)


@pytest.mark.parametrize("method", ["sobol", "latin", "random"])
def test_samples_have_the_moments_of_their_distributions(method):
    count, away = 1024, 4.0  # standard errors of plain sampling
    drawn = {"tension.x": {"from": 1.0, "to": 3.0}, "plate.thickness": "10 nm +- 3 %"}
    even, normal = asked(drawn, samples=count, method=method, seed=3).settings.T
    assert abs(even.mean() - 2) < away * 3**-0.5 / count**0.5
    assert abs(normal.mean() / 1e-8 - 1) < away * 0.03 / count**0.5
    assert abs(normal.std() / 3e-10 - 1) < away / (2 * count) ** 0.5
    again = asked(drawn, samples=count, method=method, seed=3).settings
    assert np.array_equal(again, np.column_stack([even, normal]))


def test_strata_of_a_latin_hypercube_hold_one_sample_each():
    drawn = {"tension.x": {"from": 0.0, "to": 1.0}}
    found = asked(drawn, samples=50, method="latin").settings[:, 0]
    assert sorted((50 * found).astype(int)) == list(range(50))


def test_words_are_kept_as_places_among_them():
    found = asked({"plate.model": ["membrane", "plate"], "modes.count": [3, 4]})
    assert found.settings.tolist() == [[0, 3], [0, 4], [1, 3], [1, 4]]
    assert found.words == {"plate.model": ["membrane", "plate"]}
    assert Scene.from_dict(found.tables(3)).modes.numbers == (1, 2, 3, 4)


def test_one_way_to_say_a_tension_takes_the_place_of_another():
    scene = Scene.from_dict(asked({"tension.stress": ["30 MPa"]}).tables(0))
    assert scene.tension.x == scene.tension.y == pytest.approx(0.3, rel=1e-15)


@pytest.mark.parametrize(
    ("vary", "more", "told"),
    [
        ({"plate.thicknes": ["5 nm"]}, {}, "plate.thicknes: unknown key"),
        ({"plate.thickness": ["5 kg"]}, {}, "another dimension"),
        ({"plate.thickness": ["5 nm", "5 kg"]}, {}, "one dimension"),
        ({"plate.thickness": []}, {}, "at least one"),
        ({"plate.thickness": "5 nm"}, {}, "a list of values"),
        ({"plate.thickness": {"from": "5 nm"}}, {}, "a list of values"),
        ({"plate.thickness": {"from": 0, "to": 1, "spacing": "log"}}, {}, "greater than 0"),
        ({"plate.thickness": "5 nm +- 0 %"}, {}, "greater than 0"),
        ({"plate.thickness": "5 nm +- 1 %"}, {}, "samples: missing"),
        ({"plate.thickness": ["5 nm"]}, {"samples": 3}, "samples: found beside grids"),
        ({"tension.x": {"from": 1, "to": 2}}, {"samples": 10**9}, "samples: found"),
        ({"tension.x": {"from": 1, "to": 2}}, {"samples": 3, "method": "sobl"}, "sobol"),
        ({"thickness": ["5 nm"]}, {}, "no section"),
        ({"mass.3.value": ["1 fg"]}, {}, "mass"),
        ({}, {}, "vary"),
    ],
)
def test_what_makes_no_sense_is_told_in_one_line(vary, more, told):
    with pytest.raises(NanoromError, match=told) as error:
        asked(vary, **more)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("names", [["g1"], ["f99"], "f1", [], ["f1", 3]])
def test_quantities_that_no_model_has_are_told_before_anything_runs(names):
    with pytest.raises(NanoromError, match="of: "):
        Request.of_table(SCENE, {"tension.x": [0.3]}, names)


def test_the_demo_asks_for_what_the_drum_has():
    found = Request.read(DEMOS / "drum.toml", DEMOS / "spread.toml")
    assert found.settings.shape == (64, 4)
    assert found.of == ("f1", "f3/f1", "b111")


@pytest.mark.parametrize("text", ["off = 3", "of = 3", "[vary]", "vary = [", "samples = 1.5"])
def test_a_bad_study_file_is_told_by_its_name(tmp_path, text):
    path = tmp_path / "study.toml"
    path.write_text(text if "vary" in text else f'{text}\n[vary]\n"tension.x" = [0.3]')
    with pytest.raises(NanoromError) as error:
        Request.read(DEMOS / "drum.toml", path)
    assert "\n" not in str(error.value)
