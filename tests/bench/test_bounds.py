"""A benchmark's scenes are ended at bounds of time and memory."""

import time

import pytest

from nanorom.bench import bounded
from nanorom.errors import NanoromError

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
