"""Benchmarks: run time against error, estimates against true errors, numerical stability.

    nanorom bench               run time against error, beside bare DOLFINx and NGSolve
    nanorom bench --accuracy    true error against the estimate, tolerance by tolerance
    nanorom bench --stress      extreme parameters, each against an exact or a finer solution

Errors are always against solutions without finite elements (`exact`, `spectral`), speed is told as
ratios of times measured in one run.
"""
