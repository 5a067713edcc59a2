"""Reduced-order models of nanomechanical resonators from first principles."""
