"""From nonlinear sweeps of a device to the numbers of its scene and of its instruments."""
