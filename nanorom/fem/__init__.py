"""The finite-element half: from a scene to its reduced model, on DOLFINx, PETSc and SLEPc."""

# Before DOLFINx: as installed from the Python index, it finds the MPI library through mpi4py only.
from mpi4py import MPI as MPI
