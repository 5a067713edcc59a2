"""Rows that a killed run left are read as far as they are whole, and gone on from."""

import pytest

from nanorom.files.lines import Lines


def left(path):
    """The file of a run that was killed after three rows."""
    kept = Lines(path, "key")
    for row in (2, 0, 1):
        kept.keep(row, {"values": [0.1 * row]})
    return path.with_name(path.name + ".partial")


@pytest.mark.parametrize("lost", range(0, 40, 3))
def test_half_a_line_is_no_row(tmp_path, lost):
    partial = left(tmp_path / "study.h5")
    data = partial.read_bytes()
    partial.write_bytes(data[: len(data) - lost])
    again = Lines(tmp_path / "study.h5", "key")
    lines = data[: len(data) - lost].count(b"\n") - 1
    assert list(again.found) == [2, 0, 1][:lines]
    again.keep(5, {"values": [5.0]})
    assert list(Lines(tmp_path / "study.h5", "key").found) == [2, 0, 1][:lines] + [5]


@pytest.mark.parametrize("bad", [b"[]\n", b"{}\n", b"\xff\xfe\n", b'{"row": "x", "found": {}}\n'])
def test_damage_ends_what_is_gone_on_from(tmp_path, bad):
    partial = left(tmp_path / "study.h5")
    partial.write_bytes(partial.read_bytes() + bad + b'{"row": 7, "found": {}}\n')
    assert list(Lines(tmp_path / "study.h5", "key").found) == [2, 0, 1]


def test_rows_of_another_computation_are_not_used(tmp_path):
    left(tmp_path / "study.h5")
    assert Lines(tmp_path / "study.h5", "another").found == {}


def test_nothing_is_left_when_the_output_is_written(tmp_path):
    partial = left(tmp_path / "study.h5")
    Lines(tmp_path / "study.h5", "key").finished()
    assert not partial.exists()


def test_rows_that_are_kept_are_not_solved_again(tmp_path):
    solved = []

    def solve(row):
        solved.append(row)
        return {"value": row / 7, "word": f'told, "{row}"', "none": float("inf")}

    first = Lines(tmp_path / "rows.csv", "key").each(range(4), solve)
    assert [next(first)["value"], next(first)["value"]] == [0, 1 / 7]
    rows = list(Lines(tmp_path / "rows.csv", "key").each(range(4), solve))
    assert solved == [0, 1, 2, 3]
    assert rows == [solve(row) for row in range(4)]
