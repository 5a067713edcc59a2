"""Invariant manifolds of the modal equations: a few masters, all other modes following them."""
