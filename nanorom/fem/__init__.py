"""The finite-element half: from a scene to its reduced model, on DOLFINx, PETSc and SLEPc."""
