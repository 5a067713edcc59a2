"""A design as text: the best device, what holds of it, what spreads make of it, all searches."""

from __future__ import annotations

import numpy as np

from nanorom.report.sensitivity import NOTHING
from nanorom.report.text import counted, table
from nanorom.results.design import NONE, Design
from nanorom.scene.units import tabulated, with_unit

DIGITS = 7
MOST = 20  # searches that are listed


def design_text(design: Design) -> str:
    """What was asked, the best device, its derivatives, its spread, and where searches ended."""
    devices = f"{counted(len(design.search), 'device')} in "
    devices += counted(len(design.remark), "search", "searches")
    parts = ["\n".join([*design.asked, devices])]
    if design.chosen == NONE:
        parts.append("no device meets the conditions; each search ended nearest to that at")
    else:
        parts += [_best(design), _slopes(design)]
    if len(design.source):
        parts += [_spread(design), _made(design)]
    return "\n\n".join(filter(None, [*parts, _searches(design), design.told]))


def _best(design: Design) -> str:
    """Keys with their bounds, and formulas with what a finer run and spreads say."""
    rows = [("best", "value", "unit", "from", "to", "finer run", "deviation")]
    ends = design.ended_setting[design.chosen], design.low, design.high
    for name, unit, *numbers in zip(design.by, design.by_unit, *ends):
        told, shown = tabulated(numbers, unit, DIGITS)
        rows.append((name, told[0], shown, told[1], told[2], "", ""))
    values = design.ended_value[design.chosen], design.finer, design.deviation
    for name, unit, value, finer, wide in zip(design.of, design.of_unit, *values):
        told, shown = tabulated([value, finer, wide], unit, DIGITS)
        deviation = tabulated([wide], "1", 3)[0][0] if not unit else told[2]
        rows.append((name, told[0], shown, "", "", told[1], deviation if wide else ""))
    return table(rows)


def _slopes(design: Design) -> str:
    """Per cent of each formula for each per cent of each key."""
    head = [f"{key}{'' if own else ' *'}" for key, own in zip(design.by, design.exact)]
    rows = [("per cent by per cent", *head)]
    setting, value = design.ended_setting[design.chosen], design.ended_value[design.chosen]
    for name, own, slopes in zip(design.of, value, design.slope):
        cells = [f"{s * x / own:+.4f}" if own else "-" for s, x in zip(slopes, setting)]
        rows.append((name, *cells))
    star = "" if design.exact.all() else "\n* differences of devices, not exact"
    return table(rows) + star


def _spread(design: Design) -> str:
    """What one deviation of each key does to each formula."""
    heads = []
    for key, wide, unit in zip(design.source, design.spread, design.source_unit):
        heads.append(f"{key} +- {with_unit(float(wide), unit, 3)}")
    rows = [("change by one deviation of", "unit", *heads, "together")]
    for name, unit, row, wide in zip(design.of, design.of_unit, design.share, design.deviation):
        row = np.where(np.abs(row) < NOTHING * wide, 0.0, row)
        told, shown = tabulated([*row, wide], unit, 4)
        rows.append((name, shown, *told))
    return table(rows)


def _made(design: Design) -> str:
    """Which part of devices meets the conditions."""
    if not design.made:
        return ""
    text = f"of devices that are made, {100 * design.made['linear']:.1f} % meet the conditions"
    if "sampled" in design.made:
        share, count = float(design.made["sampled"]), int(design.made["samples"])
        off = 100 * np.sqrt(max(share * (1 - share), 1 / count) / count)
        text += (
            f" (to first order); of {count} that were computed, {100 * share:.1f} +- {off:.1f} %"
        )
    return text


def _searches(design: Design) -> str:
    """Where each search ended, those of the front, or the best, marked."""
    rows = [("search", "", *design.by, *design.of, "violation", "")]
    units = ["", "", *design.by_unit, *design.of_unit, "", ""]
    columns = [*design.ended_setting.T, *design.ended_value.T]
    cells = [tabulated(c, unit, 6) for c, unit in zip(columns, units[2:])]
    rows.append(("", "", *(shown for _, shown in cells), "", ""))
    order = np.argsort(~design.front, kind="stable")[:MOST]
    for n in order:
        mark = "*" if design.front[n] else ""
        missed = f"{design.ended_violation[n]:.1e}"
        values = [told[n] for told, _ in cells]
        rows.append((str(n + 1), mark, *values, missed, design.remark[n]))
    left = len(design.remark) - len(order)
    more = f"\nand {counted(left, 'search', 'searches')} more" if left else ""
    return table(rows) + more
