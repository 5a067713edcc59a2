"""What a response says of its own errors, as text for people and as data for programs."""

from __future__ import annotations

from typing import Any

import numpy as np

from nanorom.continuation.diagrams.selection import PLAIN
from nanorom.results.estimates import Estimates
from nanorom.results.response import Response
from nanorom.scene.units import with_unit

TOLD = 1e-2  # error of a point from which a response says that modes are missing
MOST_NAMED = 3  # modes


def cells(response: Response, level: int, row: int | None) -> tuple[str, str]:
    """Estimated errors of a point's frequency and amplitude, and modes outside that make them."""
    if row is None:
        return "-", "-"
    known = response.estimates[level]
    omega, amplitude = known.omega_change[row], known.amplitude_change[row]
    text = f"{omega:+.0e}, {amplitude:+.0e}" if np.isfinite(omega) else "no such point"
    return text, ", ".join(_names(known.making(row, response.outside_label or ()))) or "-"


def facts(response: Response) -> list[tuple[str, str]]:
    """The worst point of every level, and what would grow there, by name."""
    found, labels = [], response.outside_label or ()
    for level, known in enumerate(response.estimates, 1):
        if len(known):
            found.append((f"error at level {level}", _worst(response, known)))
        for row in range(len(known.growth_omega)):
            shares = known.growth_share[row]
            grown = [(labels[k], shares[k]) for k in np.argsort(-shares)]
            names = [f"{name} {share:.0%}" for name, share in grown[:MOST_NAMED] if share > 0.05]
            at = f"{_frequency(known.growth_omega[row])} on branch"
            found.append(
                (
                    f"unstable at level {level}",
                    f"near {at} {known.growth_branch[row]}: {', '.join(names)}, at rest in the "
                    f"model, grow by {known.growth_multiplier[row]:.4g} a period",
                )
            )
    if response.estimates and response.error > TOLD:
        found.append(
            (
                "remark",
                "the model has too few modes for this response; "
                'take those that are named, or [modes] count = "auto"',
            )
        )
    return found


def _worst(response: Response, known: Estimates) -> str:
    row = int(known.error.argmax())
    kind = "" if known.type[row] == PLAIN else f"{known.type[row]} "
    made = ", ".join(_names(known.making(row, response.outside_label or ())))
    size = f"{known.error[row]:.1e}"
    if not np.isfinite(known.omega_change[row]):
        size = "no such point"
    text = f"{size} with more modes, {kind}at {_frequency(known.omega[row])}"
    return text + (f", by {made}" if made else "")


def _frequency(omega: float) -> str:
    return with_unit(float(omega / (2 * np.pi)), "Hz", 6)


def _names(shares: list[tuple[str, float]]) -> list[str]:
    return [f"{name} {share:.0e}" for name, share in shares[:MOST_NAMED]]


def data(response: Response, level: int, row: int | None) -> dict[str, Any]:
    """The same of a special point, ready for JSON; nothing where it is not estimated."""
    if row is None:
        return {}
    known = response.estimates[level]
    found = {"omega": known.omega_change[row], "amplitude": known.amplitude_change[row]}
    made = dict(known.making(row, response.outside_label or ())[:MOST_NAMED])
    changes = {name: float(v) if np.isfinite(v) else None for name, v in found.items()}
    return {"estimated_change": changes | {"by": made}}
