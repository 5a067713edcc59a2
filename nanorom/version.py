"""The installed version of the package, the one place that knows it."""

from __future__ import annotations

from functools import cache
from importlib import metadata


@cache
def version() -> str:
    """Version from the package's metadata; "unknown (not installed)" in a bare checkout."""
    try:
        return metadata.version("nanorom")
    except metadata.PackageNotFoundError:
        return "unknown (not installed)"
