"""Quasi-periodic motion: tori as invariant curves of the return map, followed and judged."""
