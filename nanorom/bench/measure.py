"""One line of the benchmark: what was solved, how long it took, how wrong it is."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from typing import Any, TypeVar

import attrs
import numpy as np
from numpy.typing import NDArray

from nanorom.errors import AccuracyWarning, NanoromError
from nanorom.exact.cases import Case
from nanorom.rom.model import ReducedModel
from nanorom.workflow import reduce

Result = TypeVar("Result")

REPEATS = 3  # timed runs; the fastest counts, it is disturbed least
LONG = 10.0  # seconds beyond which the first run counts: what it warms up is small beside them


@attrs.frozen
class Row:
    """A solution of a case by some code.

    seconds, cpu: wall and processor time of the fastest run; error_frequency, error_tensor: true
    ones; estimate_frequency, estimate_tensor: the code's own, where it has any; note: whatever the
    code had to say.
    """

    case: str
    code: str
    route: str
    degree: int
    dofs: int
    seconds: float
    cpu: float
    error_frequency: float
    error_tensor: float
    estimate_frequency: float = np.nan
    estimate_tensor: float = np.nan
    note: str = ""

    @property
    def error(self) -> float:
        """The larger of the two errors."""
        return max(self.error_frequency, self.error_tensor)

    @property
    def estimate(self) -> float:
        """The larger of the two estimates."""
        return max(self.estimate_frequency, self.estimate_tensor)


def timed(solve: Callable[[], Result], repeats: int = REPEATS) -> tuple[Result, float, float]:
    """Result, wall time and processor time of the fastest of some runs, after one to warm up.

    Without ``repeats`` the first run counts.
    """
    result, wall, cpu = _once(solve)
    if wall > LONG or not repeats:
        return result, wall, cpu
    runs = [_once(solve) for _ in range(repeats)]
    return runs[-1][0], min(run[1] for run in runs), min(run[2] for run in runs)


def _once(solve: Callable[[], Result]) -> tuple[Result, float, float]:
    wall, cpu = time.perf_counter(), time.process_time()
    result = solve()
    return result, time.perf_counter() - wall, time.process_time() - cpu


def reduction(case: Case, note: str = "", repeats: int = REPEATS) -> Row:
    """Reduce a case's scene with nanorom, warm; what it refuses to do is a row without numbers."""
    scene = case.scene
    route, by_hand = scene.reduction.method, scene.accuracy.degree
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", AccuracyWarning)
            model, seconds, cpu = timed(lambda: reduce(scene), repeats)
    except NanoromError as error:
        nan = float("nan")
        text = f"{note} {error}".strip()
        return Row(case.name, "nanorom", route, by_hand or 0, 0, nan, nan, nan, nan, note=text)
    if any(issubclass(w.category, AccuracyWarning) for w in caught):
        note = f"{note} not met".strip()
    return row_of(case, model, seconds, cpu, note)


def row_of(case: Case, model: ReducedModel, seconds: float, cpu: float, note: str) -> Row:
    """Row of a reduced model and its true errors."""
    found: dict[str, Any] = model.diagnostics
    return Row(
        case.name,
        "nanorom",
        model.method,
        int(found.get("degree", 0)),
        int(found.get("dofs", 0)),
        seconds,
        cpu,
        *case.errors(model),
        float(found["error_frequency"]),
        float(found["error_tensor"]),
        note,
    )


def baseline(
    case: Case,
    code: str,
    route: str,
    degree: int,
    solve: Callable[[], tuple[int, NDArray[np.float64], NDArray[np.float64]]],
) -> Row:
    """Row of another code: ``solve`` gives dofs, frequencies in Hz and the tensor in N/m^3."""
    (dofs, frequency, cubic), seconds, cpu = timed(solve)
    errors = case.errors_of(frequency, cubic)
    return Row(case.name, code, route, degree, dofs, seconds, cpu, *errors)
