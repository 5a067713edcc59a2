"""Exported problems: numbers survive, AUTO-07p runs them unchanged and finds the same points."""

from __future__ import annotations

import csv
import shutil
import subprocess

import numpy as np
import pytest
from scipy.io import loadmat

from nanorom.continuation import explore
from nanorom.errors import FileError
from nanorom.export.export import export
from tests.continuation.systems import from_monomials, random_potential

AUTO_AGREES = 1e-4
AUTO_TYPES = {2: "LP", 5: "LP", 7: "PD"}


def _force(system, q):
    return system.stiffness @ q + system.quadratic @ q @ q + system.cubic @ q @ q @ q


def test_csv_has_one_monomial_per_row(tmp_path) -> None:
    system = random_potential(3, 1)
    with open(export(system, "csv", tmp_path / "system.csv"), newline="") as handle:
        rows = list(csv.reader(handle))
    assert rows[0] == ["mode", "q1", "q2", "q3", "coefficient"]
    q = np.array([0.3, -0.7, 1.1])
    force = np.zeros(3)
    for row in rows[1:]:
        force[int(row[0]) - 1] += float(row[4]) * np.prod(q ** np.array(row[1:4], dtype=float))
    np.testing.assert_allclose(force, _force(system, q), rtol=1e-12)


def test_matlab_file_gives_the_force(tmp_path) -> None:
    system = random_potential(3, 2)
    contents = loadmat(export(system, "matlab", tmp_path / "system.mat"))
    q = np.array([0.3, -0.7, 1.1])
    monomials = np.prod(q ** contents["exponents"], axis=1)
    force = contents["K"] @ q + contents["coefficients"].T @ monomials
    np.testing.assert_allclose(force, _force(system, q), rtol=1e-12)


def test_unknown_format_and_target_are_refused(tmp_path) -> None:
    with pytest.raises(FileError, match="unknown format"):
        export(random_potential(1, 0), "excel", tmp_path / "x")
    with pytest.raises(FileError):
        export(random_potential(1, 0), "csv", tmp_path / "missing" / "x.csv")


@pytest.mark.skipif(not shutil.which("auto-07p"), reason="AUTO-07p is not installed")
def test_auto_runs_the_exported_problem_and_agrees(tmp_path) -> None:
    system, omega = from_monomials("p2"), (1.9, 2.1)
    levels = {"direct": 0.004, "parametric": 0.016}
    folder = export(system, "auto", tmp_path / "problem", omega=omega, **levels)
    done = subprocess.run([folder / "run.sh"], capture_output=True, text=True, check=True)
    assert "Total Time" in done.stdout
    diagram = explore(system, omega, **levels)
    found = []
    for file in ["b.base", *sorted(p.name for p in folder.glob("b.branch*"))]:
        rows = [line.split() for line in (folder / file).read_text().splitlines()]
        found += [
            (AUTO_TYPES[int(row[2])], float(row[4]))
            for row in rows
            if len(row) > 5 and row[0] != "0" and int(row[2]) in AUTO_TYPES
        ]
    assert {"LP", "PD"} <= {kind for kind, _ in found}
    for kind, frequency in found:
        nearest = min(abs(p.omega - frequency) for p in diagram.special_points if p.type == kind)
        ends = [abs(p.omega - frequency) for p in diagram.points("PD")]
        # AUTO lists the end of the doubled branch at its period doubling as a fold
        assert min([nearest, *ends]) < AUTO_AGREES
