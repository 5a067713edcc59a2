"""What the launcher of a process tells: its rank, and whether finite elements are at hand."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

from nanorom.errors import NanoromError


@contextmanager
def finite_elements() -> Iterator[None]:
    """Turn a missing finite-element library into one line with the remedy."""
    try:
        yield
    except ImportError as error:
        cause: BaseException | None = error
        while cause is not None:  # C++ modules make an import error of Ctrl-C
            if isinstance(cause, KeyboardInterrupt):
                raise KeyboardInterrupt from error
            cause = cause.__cause__ or cause.__context__
        raise NanoromError(
            f"this needs DOLFINx, petsc4py, slepc4py and gmsh ({error}); "
            "use ./run, pip install 'nanorom[fem]' (Linux) or the container image"
        ) from error


def mpi_rank() -> int:
    """Rank of this process as its launcher gives it, without loading MPI; 0 when run alone."""
    for name in ("OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK"):
        if name in os.environ:
            return int(os.environ[name])
    return 0
