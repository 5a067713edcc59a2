"""Models whose nonlinear force is out of the range of the theory that it comes from."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from nanorom.errors import ModelError

# of the stretching of a mode: what its curvature alone adds, from where it is no small correction
OUT_OF_RANGE = 0.1


def check_range(diagnostics: Mapping[str, Any]) -> None:
    """Raise ModelError if a model's film bends without stretching: its response means nothing."""
    ratio = float(diagnostics.get("curvature_ratio", 0.0))
    if ratio > OUT_OF_RANGE:
        raise ModelError(
            f"the film bends without stretching: its curvature alone stiffens a mode {ratio:.2g} "
            "times as much as the stretching that the model has, and the inertia of its motion in "
            "the plane is missing: von Karman's theory is out of its range, and only frequencies "
            "hold; hold more of its edges"
        )
