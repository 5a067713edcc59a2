"""One BLAS thread while small matrices are at work: more threads make them several times slower."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache

# names of the same functions in different builds of OpenBLAS
PREFIXES = ("", "scipy_")
SUFFIXES = ("", "64_", "_64_")


@contextmanager
def one_thread() -> Iterator[None]:
    """Run the body, or the decorated function, with OpenBLAS on one thread; restore it
    afterwards.
    """
    controls = _controls()
    before = [get() for get, _ in controls]
    for _, put in controls:
        put(1)
    try:
        yield
    finally:
        for (_, put), count in zip(controls, before):
            put(count)


@lru_cache(maxsize=1)
def _controls() -> list[tuple[Callable[[], int], Callable[[int], None]]]:
    """Get and set functions of the OpenBLAS libraries in this process (Linux; none elsewhere)."""
    try:
        with open("/proc/self/maps") as handle:
            paths = {line.split()[-1] for line in handle if "blas" in line and ".so" in line}
    except OSError:
        return []
    found = []
    for path in sorted(paths):
        try:
            library = ctypes.CDLL(path)
        except OSError:
            continue
        for prefix in PREFIXES:
            for suffix in SUFFIXES:
                get = getattr(library, f"{prefix}openblas_get_num_threads{suffix}", None)
                put = getattr(library, f"{prefix}openblas_set_num_threads{suffix}", None)
                if get is not None and put is not None:
                    found.append((get, put))
    return found
