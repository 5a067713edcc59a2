"""Whole diagrams: branches, special points, isolas, several levels."""
