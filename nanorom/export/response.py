"""Responses handed to other programs: tables (.csv) and MATLAB (.mat)."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from nanorom.files.whole import atomic_path
from nanorom.results import table
from nanorom.results.response import Response


def write_csv(response: Response, path: Path) -> None:
    """Write `nanorom.results.table.columns`, a row per point; raises FileError."""
    columns, names = table.columns(response), table.headings(response)
    with atomic_path(path) as temporary, open(temporary, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names[name] for name in columns)
        writer.writerows(zip(*(column.tolist() for column in columns.values())))


def write_matlab(response: Response, path: Path) -> None:
    """Write the same columns (n, 1) for MATLAB; raises FileError.

    ``amplitude`` (n, L) in m is in the order of ``label`` {L, 1}; ``natural_frequency`` (L, 1) in
    Hz; ``special`` and ``unit_direct``, ``unit_parametric`` are text.
    """
    from scipy.io import savemat

    columns = table.columns(response)
    contents = {name: columns[name] for name in table.COLUMNS if name != "special"}
    contents["special"] = np.array(columns["special"].tolist(), dtype=object)
    amplitude = [columns[f"amplitude of {name}"] for name in response.label]
    contents["amplitude"] = np.transpose(amplitude)
    contents["label"] = np.array(list(response.label), dtype=object)
    contents["natural_frequency"] = response.frequency
    contents["unit_direct"], contents["unit_parametric"] = response.drive.units
    with atomic_path(path) as temporary:
        savemat(temporary, contents, oned_as="column", appendmat=False)
