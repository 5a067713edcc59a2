"""Families of orbits, followed by power series."""
