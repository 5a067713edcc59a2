"""A study as text: how each quantity is spread over its devices, and which devices failed."""

from __future__ import annotations

from collections import Counter

import numpy as np

from nanorom.report.text import counted, table
from nanorom.results.study import Study
from nanorom.scene.units import tabulated
from nanorom.types import Array

QUANTILES = (0.05, 0.5, 0.95)
HEAD = ("", "unit", "mean", "deviation", "least", "5 %", "median", "95 %", "largest")
MOST_REASONS = 5


def study_text(study: Study) -> str:
    """How keys and quantities are spread, and what failures say."""
    failed = int(study.failed.sum())
    lead = f"{counted(len(study), 'device')}, {failed} failed"
    rows: list[tuple[str, ...]] = [HEAD]
    for name, unit in zip((*study.by, *study.of), (*study.by_unit, *study.of_unit)):
        if name not in study.words:
            rows.append((name, *_spread(np.asarray(study[name], dtype=float), unit)))
    words = [f"{name}: {', '.join(values)}" for name, values in study.words.items()]
    remarks = Counter(filter(None, study.remark)).most_common(MOST_REASONS)
    told = [f"{counted(count, 'device')}: {remark}" for remark, count in remarks]
    return "\n\n".join(filter(None, [lead, table(rows), "\n".join(words), "\n".join(told)]))


def _spread(values: Array, unit: str) -> tuple[str, ...]:
    """Unit, and what a column comes to in it."""
    values = values[np.isfinite(values)]
    if not len(values):
        return (unit, *("-",) * (len(HEAD) - 2))
    found = [values.mean(), values.std(ddof=len(values) > 1), values.min()]
    found += [*np.quantile(values, QUANTILES), values.max()]
    told, shown = tabulated(found, unit, 6)
    return (shown, *told)
