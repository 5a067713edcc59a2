"""The benchmark runs from end to end, and its exact solutions are exact."""

import csv
import json
import resource
from pathlib import Path

import numpy as np
import pytest

from nanorom.bench import (
    curves,
    measure,
    report,
    skips,
)
from nanorom.cli.main import main
from nanorom.exact import cases, polar
from nanorom.exact import drum as spectral
from nanorom.scene.scene import Modes
from tests.fem.exact import clamped_disc, drum_tensor

SPECTRAL = 1e-11  # of both spectral solutions
TABLE_1 = 1e-12  # digits to which the membrane's coefficients are known
SKIPPED = 1e-6  # of skips, at the tolerance of their scenes
QUICK_ERROR = 1e-5  # of the quick benchmark's drum at tolerance 1e-6
UNCOUNTED = (
    1e-3  # pages that Linux has not yet added to a process' peak, which it counts in batches
)


def test_spectral_drum_is_the_reference():
    drum = spectral.isotropic(100.0, 15)
    expected = drum_tensor()
    assert np.abs(drum.tensor(0.16) - expected).max() < SPECTRAL * np.abs(expected).max()
    assert drum.omega == pytest.approx(clamped_disc(100.0, 15), rel=SPECTRAL)


def test_spectral_membrane_has_table_1():
    """b111 of f01, in E h/R^2: sum over Bessel functions, 25-digit quadrature."""
    cubic = spectral.isotropic(np.inf, 6).tensor(0.16)
    assert cubic[0, 0, 0, 0] == pytest.approx(2.839702975852, rel=TABLE_1)
    assert cubic[5, 5, 5, 5] == pytest.approx(22.944139015372, rel=TABLE_1)


def test_ritz_drum_becomes_the_isotropic_one():
    """Modes f01, f11c, f11s and f02 do not depend on how f21's pair is ordered."""
    nearly = spectral.anisotropic(100.0 * (1 - 1e-9), 100.0, 6)
    expected = drum_tensor()
    known = np.ix_(*[[0, 1, 2, 5]] * 4)
    difference = nearly.tensor(0.16)[known] - expected[known]
    assert np.abs(difference).max() < 1e-8 * np.abs(expected).max()


def test_ritz_drum_has_the_papers_frequencies():
    """Provenance: spectral solution in another basis, ten digits, MHz."""
    found = cases.paper_drum(15).frequency() / 1e6
    known = [21.15119357, 35.43957465, 36.72212759, 51.91279396, 52.14308452, 57.68114750]
    assert found[:6] == pytest.approx(known, rel=2e-10)
    assert found[14] == pytest.approx(110.27634740, rel=2e-10)


def test_pinned_string_stretches_as_its_sines():
    """B_1111 = E A/(2 L^3) (pi^2/2)^2, B_1133 = 9/3 of it."""
    case = cases.string(3, ends="simply_supported")
    geometry = case.scene.geometry
    stretch = case.scene.material.youngs_modulus * case.scene.plate.thickness * geometry.width
    expected = stretch / (2 * geometry.length**3) * (np.pi**2 / 2) ** 2
    assert case.cubic()[0, 0, 0, 0] == pytest.approx(expected, rel=1e-12)
    assert case.cubic()[0, 0, 2, 2] == pytest.approx(3 * expected, rel=1e-12)


def test_rotated_shapes_are_made_unique():
    """Pairs in any rotation, scale and sign come back as cos and sin with maximum one."""
    rng = np.random.default_rng(1)
    turn = np.linalg.qr(rng.standard_normal((2, 2)))[0]
    mixing = np.zeros((3, 3))
    mixing[0, 0], mixing[1:, 1:] = -2.0, 3 * turn

    def true_shapes(x):
        r, theta = np.linalg.norm(x, axis=1), np.arctan2(x[:, 1], x[:, 0])
        radial = r * (1 - r**2) * 1.5 * np.sqrt(3)
        return np.array([1 - r**2, radial * np.cos(theta), radial * np.sin(theta)])

    found = polar.unique([0, 1, 1], lambda x: mixing @ true_shapes(x))
    assert np.abs(np.abs(found.T @ mixing) - np.eye(3)).max() < 1e-8


def test_bare_dolfinx_converges_to_the_exact_drum():
    case = cases.drum(curves.KAPPA, count=3)
    coarse, fine = curves.bare_dolfinx(case, {3: ((3, 6), (3,))})
    assert fine.error < 0.2 * coarse.error
    assert fine.error < 0.02


def test_quick_benchmark_leaves_table_and_picture(tmp_path, monkeypatch):
    monkeypatch.setattr(curves, "bare_dolfinx", lambda *_: iter(()))
    monkeypatch.setattr("nanorom.bench.targets.start_up", lambda: iter(()))
    assert main(["bench", "--quick", "-o", str(tmp_path)]) == 0
    with open(tmp_path / "speed.csv") as file:
        rows = list(csv.DictReader(file))
    best = [float(row["error_tensor"]) for row in rows if row["note"] == "tolerance 1e-06"]
    assert best and max(best) < QUICK_ERROR
    assert (tmp_path / "speed.png").read_bytes().startswith(b"\x89PNG")
    assert "| case | code |" in (tmp_path / "speed.md").read_text()


def test_refused_scene_is_a_row_with_the_reason():
    case = cases.with_tolerance(cases.drum(-20.0, count=1), 1e-3)
    row = measure.reduction(case, repeats=0)
    assert np.isnan(row.seconds) and "not stable" in row.note
    assert "-" in report.line(row)


def test_square_reference_tells_its_provenance():
    data = json.loads((Path(cases.DATA) / "square-membrane.json").read_text())
    assert "no finite elements" in data["provenance"]


def test_blocks_by_symmetry_save_load_cases_and_change_nothing():
    scene = cases.with_tolerance(cases.paper_drum(), 1e-3).scene
    saving = skips.opposite_cases(scene.with_(modes=Modes(count=3)))
    assert saving.difference < SKIPPED


def test_mirror_images_save_load_cases_and_change_nothing():
    scene = cases.with_tolerance(cases.paper_drum(4), 1e-3).scene
    assert skips.image_cases(scene).difference < SKIPPED


def test_beam_saves_the_plate_strip_and_changes_nothing():
    assert skips.beam().difference < SKIPPED


def test_mirrors_and_pairs_save_work_and_change_nothing():
    scene = cases.with_tolerance(cases.paper_drum(), 1e-3).scene.with_(modes=Modes(count=3))
    quarter = skips.plan(scene)
    for full in (skips.plan(scene, skips.WholePlan), skips.plan(scene.with_(method="step"))):
        # both meshes are right to the scene's tolerance; a quarter is that of the whole
        assert skips.compared("", quarter, full).difference < SKIPPED


def test_quick_sizes_leave_table_and_picture(tmp_path):
    """Time and memory by size, factors beside multigrid, on a drum of three modes."""
    assert main(["bench", "--size", "--quick", "-o", str(tmp_path)]) == 0
    with open(tmp_path / "size-1.csv") as file:
        rows = list(csv.DictReader(file))
    most = 1e-6 * 1.024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss  # GB, this process'
    most *= 1 + UNCOUNTED
    assert [row["solver"] for row in rows] == ["factors"] * 2 + ["multigrid"] * 2
    for row in rows:
        assert float(row["error_tensor"]) < QUICK_ERROR
        assert 0.1 < float(row["memory"]) <= most and float(row["cpu"]) > float(row["cpu_modes"])
    assert "exponent of memory, multigrid" in (tmp_path / "size-1.md").read_text()
    assert (tmp_path / "size-1.png").read_bytes().startswith(b"\x89PNG")


def test_errors_of_near_modes_are_those_of_their_names():
    """The drum's f31c is the higher of a pair 1.6e-8 apart, and is told before f31s."""
    case = cases.unequal_drum(1.25, 1.0, 8)
    order = [0, 1, 2, 3, 4, 5, 7, 6]
    frequency, cubic = case.frequency()[order], case.cubic()[np.ix_(order, order, order, order)]
    assert case.errors_of(frequency, cubic) == (0.0, 0.0)
