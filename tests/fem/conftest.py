"""What all tests with finite elements need."""

from typing import Any


def pytest_pycollect_makemodule(module_path: Any, parent: Any) -> None:
    """Load MPI before DOLFINx, which as installed from the Python index finds the library so only.

    Where tests are collected and no earlier: MPI writes into the environment of its process, which
    that of its workers would have from it, and mpirun within them then takes itself for a rank.
    """
    from mpi4py import MPI  # noqa: F401
