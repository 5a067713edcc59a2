"""Measured data, and what can be identified from them."""
