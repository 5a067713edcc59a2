"""The table of a study: columns by name, files that give it back, words, what is damaged."""

import csv
import sys

import numpy as np
import pytest

from nanorom.errors import ModelError, NanoromError
from nanorom.files import stored
from nanorom.plots import study_figure
from nanorom.report.study import study_text
from nanorom.results.study import Study


@pytest.fixture
def study():
    return Study(
        scene="",
        by=("plate.thickness", "plate.model"),
        by_unit=("m", ""),
        words={"plate.model": ["membrane", "plate"]},
        setting=np.array([[5e-9, 0.0], [5e-9, 1.0], [1e-8, 1.0]]),
        of=("f1", "f2/f1"),
        of_unit=("Hz", "1"),
        value=np.array([[1e6, 1.5], [1.1e6, 1.6], [np.nan, np.nan]]),
        failed=np.array([False, False, True]),
        remark=("", "", "it buckles, say"),
    )


def test_columns_have_the_names_of_keys_and_quantities(study):
    assert study["plate.model"].tolist() == ["membrane", "plate", "plate"]
    assert study["f2/f1"][:2].tolist() == [1.5, 1.6]
    assert list(study.columns()) == [*study.by, *study.of, "failed", "remark"]
    with pytest.raises(ModelError, match="f3"):
        study["f3"]


def test_a_table_for_other_programs_has_units_and_empty_cells(study, tmp_path):
    study.save_csv(tmp_path / "study.csv")
    rows = list(csv.reader((tmp_path / "study.csv").open(encoding="utf-8")))
    head = ["plate.thickness (m)", "plate.model", "f1 (Hz)", "f2/f1", "failed", "remark"]
    assert rows[0] == head
    assert rows[2] == ["5e-09", "plate", "1100000.0", "1.6", "0", ""]
    assert rows[3] == ["1e-08", "plate", "", "", "1", "it buckles, say"]


def test_a_file_gives_the_study_back(study, tmp_path):
    study.save(tmp_path / "study.h5")
    again = stored.load(tmp_path / "study.h5")
    np.testing.assert_array_equal(again.value, study.value)
    assert (again.words, again.remark) == (study.words, study.remark)
    assert study_text(again) == study_text(study)


def test_text_and_picture_leave_out_what_failed(study, tmp_path):
    assert "1 device: it buckles, say" in study_text(study)
    figure = study_figure(study, tmp_path / "study.png")
    drawn = figure.axes[0].lines[0].get_xydata()
    np.testing.assert_allclose(drawn, [[5.0, 1.0], [5.0, 1.1]])
    shown = [axes.get_xlabel() for axes in figure.axes]
    assert shown == ["", "", "plate.thickness (nm)", "plate.model"]
    words = [label.get_text() for label in figure.axes[-1].get_xticklabels()]
    assert words == list(study.words["plate.model"])


def test_places_beyond_the_words_are_refused(study):
    with pytest.raises(ModelError, match="plate.model"):
        Study(**{name: getattr(study, name) for name in STUDY} | {"setting": study.setting + 1})


STUDY = ("scene", "by", "by_unit", "words", "of", "of_unit", "value", "failed", "remark")


def test_pandas_is_asked_for_only_where_it_is_needed(study, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(NanoromError, match="pip install pandas"):
        study.to_pandas()
