"""Responses and load curves, and their files."""
