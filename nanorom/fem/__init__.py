"""The finite-element half: from a scene to its reduced model, on DOLFINx, PETSc and SLEPc."""

from nanorom.fem.reduce import reduce_scene

__all__ = ["reduce_scene"]
