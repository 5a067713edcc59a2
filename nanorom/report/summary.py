"""Models and responses as plain numbers, for summary.json."""

from __future__ import annotations

from typing import Any

import numpy as np

from nanorom.report import estimates
from nanorom.report.text import asymmetry_text
from nanorom.results.response import Response
from nanorom.rom.model import ReducedModel


def of_model(model: ReducedModel) -> dict[str, Any]:
    """The modes and diagnostics of a model, ready for JSON."""
    modes = [
        {
            "number": int(model.number[r]),
            "label": model.label[r],
            "frequency_Hz": float(model.frequency[r]),
            "mass_kg": float(model.mass[r]),
            "stiffness_N_per_m": float(model.stiffness[r, r]),
            "quadratic_N_per_m2": float(model.quadratic[r, r, r]),
            "cubic_N_per_m3": float(model.cubic[r, r, r, r]),
        }
        for r in range(model.size)
    ]
    return {
        "modes": modes,
        "method": model.method,
        "in_plane": model.in_plane,
        "asymmetry": asymmetry_text(model),
        "diagnostics": {name: _plain(value) for name, value in model.diagnostics.items()},
        "versions": model.versions,
    }


def of_response(response: Response) -> dict[str, Any]:
    """The levels of a response with their special points, ready for JSON."""
    units = response.drive.units
    levels = []
    both = zip(response.drive.levels, response.diagrams)
    for level, ((direct, parametric), diagram) in enumerate(both):
        points = [
            {
                "type": point.type,
                "frequency_Hz": float(point.omega / (2 * np.pi)),
                "amplitude_m": point.amplitude.tolist(),
                "period_multiple": point.period_multiple,
                "branch": point.branch,
                **estimates.data(response, level, response.estimated(level, point)),
            }
            for point in diagram.special_points
        ]
        levels.append(
            {
                "direct": {"level": direct, "unit": units[0]},
                "parametric": {"level": parametric, "unit": units[1]},
                "largest_amplitude_m": max(float(b.amplitude.max()) for b in diagram.branches),
                "branches": len(diagram.branches),
                "special_points": points,
                "unexplored": [
                    {"kind": u.kind, "frequency_Hz": u.omega / (2 * np.pi), "why": u.why}
                    for u in diagram.unexplored
                ],
            }
        )
    return {"response": levels}


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value
