"""One BLAS thread while small matrices are at work: more threads make them several times slower."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

from threadpoolctl import ThreadpoolController


@contextmanager
def one_thread() -> Iterator[None]:
    """Run the body, or the decorated function, with BLAS on one thread; restored afterwards."""
    with _blas().limit(limits=1, user_api="blas"):
        yield


@cache
def _blas() -> ThreadpoolController:
    """The BLAS libraries of this process, looked for once: SciPy has loaded its own by now."""
    return ThreadpoolController()
