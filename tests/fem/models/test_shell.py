"""The shell against published nonlinear benchmarks and against the flat plate."""

import numpy as np
import pytest

from nanorom.fem.statics import path
from tests.fem.models import sze_cases

PUBLISHED = 0.01  # of the published load-deflection tables
EXACT = 1e-3  # of the elastica under a moment; a shell of this thickness stretches a little


def deviations(name, loads, *mesh):
    """Our displacements relative to the published ones, one row per load."""
    shell, problem, largest, observed = sze_cases.CASES[name](*mesh)
    table = sze_cases.table(name)
    rows = [table[np.abs(table[:, 0] - load).argmin()] for load in loads]
    ours = []
    for point in path.load_steps(problem, [row[0] * largest for row in rows]):
        ours.append(sze_cases.observe(shell, observed))
        assert point.stable
    return np.array(ours) / np.array(rows)[:, 1:] - 1


@pytest.mark.parametrize(
    "name, loads, mesh",
    [
        ("end_shear", [0.25, 0.5, 1.0], (4, 4)),
        ("slit_annulus", [0.1, 0.4], (6, 8)),
        ("hemisphere", [0.05, 0.2], (6, 4)),
        ("cylinder_pull_out", [0.05, 0.3], (6, 4)),
    ],
)
def test_displacements_are_those_of_the_published_tables(name, loads, mesh):
    assert np.abs(deviations(name, loads, *mesh)).max() < PUBLISHED


def test_end_moment_rolls_a_cantilever_into_a_circle():
    """The elastica: curvature M/(E I), tip at L (sin a/a, (1 - cos a)/a) with a = M L/(E I)."""
    shell, problem, largest, observed = sze_cases.end_moment(4, 6)
    for share, _ in zip(
        (0.25, 0.5, 0.75, 1.0),
        path.load_steps(problem, largest * np.array([0.25, 0.5, 0.75, 1.0])),
    ):
        angle = 2 * np.pi * share
        exact = 12 * np.array([1 - np.sin(angle) / angle, (1 - np.cos(angle)) / angle])
        assert sze_cases.observe(shell, observed) == pytest.approx(exact, abs=EXACT * 12)


@pytest.mark.parametrize("degree, expected", [(2, 3.0), (4, 7.0)])
def test_refinement_converges(degree, expected):
    """Error of the tip's deflection under end shear falls at least as cells^-(2 (k - 1) + 1)."""
    fine = tip(6, 8)
    errors = [abs(tip(degree, n) - fine) for n in (2, 4)]
    assert np.log2(errors[0] / errors[1]) > expected - 2.0


def tip(degree, n):
    shell, problem, largest, observed = sze_cases.end_shear(degree, n)
    for _ in path.load_steps(problem, [0.1 * largest]):
        return sze_cases.observe(shell, observed)[1]
