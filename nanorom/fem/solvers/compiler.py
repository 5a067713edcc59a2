"""The C compiler that DOLFINx's forms go through: its options, its silence, and its absence."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import cffi

from nanorom.errors import NanoromError

CPU_INFO = Path("/proc/cpuinfo")  # Linux'
VECTORS = {"avx2": "-mavx2", "fma": "-mfma"}  # names in it, and the compiler's options


def options() -> list[str]:
    """How forms are compiled."""
    return ["-O2", "-ftree-vectorize", *_instructions()]


def _instructions() -> list[str]:
    """Options for vectors of four numbers, where this processor has them.

    The cache of compiled forms tells options apart, so that other processors may share it.
    """
    try:
        told = set(CPU_INFO.read_text(encoding="ascii", errors="replace").split())
    except OSError:  # not Linux: forms are compiled for any processor
        return []
    return list(VECTORS.values()) if VECTORS.keys() <= told else []


@contextmanager
def at_work() -> Iterator[None]:
    """Silence what the form compiler tells of itself: C command lines, numbers of points.

    Raises NanoromError with the remedy where there is no C compiler.
    """
    level = logging.root.manager.disable
    logging.disable(logging.INFO)
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", module="ffcx")
            yield
    except cffi.VerificationError as error:
        raise NanoromError(
            f"the forms of DOLFINx cannot be compiled ({' '.join(str(error).split())}); they need "
            "a C compiler: install gcc, or name another in the variable CC, such as that of pip "
            "install ziglang, CC='python -m ziglang cc'"
        ) from error
    finally:
        logging.disable(level)
