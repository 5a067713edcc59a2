"""Exact derivatives of a reduced model by the numbers of its scene."""
