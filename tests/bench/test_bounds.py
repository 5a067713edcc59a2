"""A benchmark's scenes are ended at bounds of time and memory, and go on where they were ended."""

import time

import attrs
import pytest

from nanorom.bench import bounded, kept
from nanorom.errors import FileError, NanoromError

SECONDS = 4  # of the processor, the start of a process among them
MEMORY = 2**29


def spin():
    while True:
        pass


def fill(much):
    held = bytearray(much)
    held[::4096] = b"1" * len(held[::4096])  # pages that are written are resident
    time.sleep(60)


def die():
    raise SystemExit(3)


def test_a_result_comes_from_another_process():
    assert bounded.bounded(divmod, 17, 5) == (3, 2)


def test_time_of_the_processor_is_bounded():
    start = time.monotonic()
    with pytest.raises(bounded.Bound, match="more than 4 s of the processor"):
        bounded.bounded(spin, seconds=SECONDS)
    assert time.monotonic() - start < 60  # other work may hold the processor


def test_memory_is_bounded():
    with pytest.raises(bounded.Bound, match=r"more than 0\.5 GB of memory"):
        bounded.bounded(fill, 2 * MEMORY, memory=MEMORY)


def test_a_process_that_dies_otherwise_is_an_error():
    with pytest.raises(NanoromError, match="its process ended with status 3"):
        bounded.bounded(die)


@attrs.frozen
class Row:
    number: int
    value: float
    word: str


def test_rows_of_an_interrupted_run_are_kept(tmp_path):
    path, solved = tmp_path / "rows.csv", []

    def solve(number):
        solved.append(number)
        return Row(number, number / 7, f'told, "{number}"')

    first = kept.rows(path, Row, range(4), solve)
    assert [next(first).number, next(first).number] == [0, 1]
    with open(path, "a") as file:
        file.write('2,0.28,"to')  # interrupted while a row is written
    rows = list(kept.rows(path, Row, range(4), solve))
    assert solved == [0, 1, 2, 3]
    assert rows == [Row(n, n / 7, f'told, "{n}"') for n in range(4)]
    assert list(kept.rows(path, Row, range(4), solve)) == rows
    assert solved == [0, 1, 2, 3]


def test_another_table_is_refused(tmp_path):
    path = tmp_path / "rows.csv"
    path.write_text("number,other\n0,1\n")
    with pytest.raises(FileError, match="found another table"):
        list(kept.rows(path, Row, range(2), lambda number: Row(number, 0.0, "")))
