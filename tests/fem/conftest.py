"""What all tests with finite elements need."""

# Before DOLFINx: as installed from the Python index, it finds the MPI library through mpi4py only.
from mpi4py import MPI  # noqa: F401
