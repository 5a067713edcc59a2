"""Figures 3 and 4: the phenomena that the paper names, in a short form of the demos."""

import subprocess
import sys
from math import tau
from pathlib import Path

import numpy as np
import pytest

import nanorom
from nanorom.errors import ModelError
from nanorom.plots import motion as pictures
from nanorom.rom import motion
from nanorom.rom.linear import linear_response

DEMOS = Path(__file__).parents[2] / "demos"
LEVEL = 1.6  # gamma by the threshold of f01
OPENING_TOLERANCE = 1e-4  # the weak direct drive beside it
ALONE_TOLERANCE = 2e-3  # two harmonics against all
EDGE_TOLERANCE = 2e-4  # of the tongue: first-order perturbation beside a weak direct drive


@pytest.fixture(scope="module")
def demos():
    sys.path.insert(0, str(DEMOS))
    import fig3
    import fig4
    import phenomena

    yield fig3, fig4, phenomena
    sys.path.remove(str(DEMOS))


@pytest.fixture(scope="module")
def directory(tmp_path_factory):
    return tmp_path_factory.mktemp("figures")


@pytest.fixture(scope="module")
def membrane(demos, directory):
    """The drum without bending at one level: its model, response and doubled branch."""
    fig3, _, phenomena = demos
    responses = fig3.main(
        directory, ladder=(LEVEL,), sweep=("1.95 f1", "2.05 f1"), variants=("membrane",), f03=False
    )
    folder = directory / "membrane"
    (folder / "rom-f03.h5").symlink_to(folder / "rom.h5")  # eleven modes do, to save time
    (folder / "response-f03.h5").symlink_to(folder / "response.h5")
    model = nanorom.ReducedModel.load(folder / "rom.h5")
    (response,) = responses.values()
    return model, response, phenomena.first_branch(response.diagrams[0], model)


def test_period_doubles_where_gamma_exceeds_the_threshold(membrane):
    """Edges of the tongue 2 f1 (1 +- sqrt(g^2 - 1)/(2 Q)), g: gamma by its threshold."""
    model, response, _ = membrane
    edges = sorted(p.omega / tau / model.frequency[0] for p in response.diagrams[0].points("PD"))
    half = np.sqrt(LEVEL**2 - 1) / (2 * 180)
    assert edges[:2] == pytest.approx([2 - 2 * half, 2 + 2 * half], rel=EDGE_TOLERANCE)


def test_without_bending_the_branch_locks_to_f21_where_the_paper_has_it(membrane):
    model, response, branch = membrane
    top = branch.omega[np.where(branch.stable, branch.omega, 0).argmax()] / tau
    assert 2.4 < top / model.frequency[0] < 2.75
    assert branch.amplitude[:, model.label.index("f21c")].max() > 5e-9
    torus = [
        p.omega / tau / model.frequency[0]
        for p in response.diagrams[0].points("NS")
        if p.period_multiple == 2
    ]
    assert min(abs(ratio - 2.538) for ratio in torus) < 0.05  # the paper's Neimark-Sacker point


def test_the_clamped_plate_has_no_lock_below_three_times_f01(demos):
    """With 410 GPa the resonance with f21 moves to 3.35 ... 3.43 f01."""
    fig3, _, phenomena = demos
    full = fig3.reduced("plate", 11)
    model = full.select(["f01", "f21c", "f02", "f41c"])
    sweep = nanorom.Sweep("1.98 f1", "2.02 f1", tolerance=fig3.TOLERANCE)
    response = nanorom.respond(model, fig3.levels(model, [LEVEL]), sweep, processes=1)
    branch = phenomena.first_branch(response.diagrams[0], model)
    assert branch.omega.max() / tau > 3.0 * model.frequency[0]
    below = branch.omega / tau < 3.0 * model.frequency[0]
    assert branch.amplitude[below, 1].max() < 0.05 * branch.amplitude[below, 0].max()


def test_every_period_doubling_opens_where_one_mode_alone_would(membrane, demos):
    """2 k/(Q |J|), found from the curve of period doublings with all eleven modes."""
    fig3, _, phenomena = demos
    model = membrane[0]
    drive = fig3.levels(model, [1.0])
    for label in ("f01", "f11c"):
        level, ratio = phenomena.opening(model, drive, label)
        assert level == pytest.approx(1, abs=OPENING_TOLERANCE)
        assert ratio == pytest.approx(1, abs=OPENING_TOLERANCE)


def test_first_mode_alone_reaches_about_twice_the_level(demos):
    """Its doubled branch closes where power in and out balance, the third harmonic included."""
    fig3, _, phenomena = demos
    model = fig3.reduced("membrane", 1)
    gamma = phenomena.threshold(model, nanorom.Drive(1.0))[0]
    for level in (1.2, 1.6):
        drive = nanorom.Drive(1e-3, level * gamma, parametric_pattern="paper")
        sweep = nanorom.Sweep("1.95 f1", "2.05 f1", tolerance=fig3.TOLERANCE)
        response = nanorom.respond(model, drive, sweep, processes=1)
        found = phenomena.reach(response.diagrams[0], model)
        assert found.lost == "LP"
        assert found.first == pytest.approx(phenomena.alone(level), rel=ALONE_TOLERANCE)


def test_the_branch_is_stable_up_to_a_special_point_and_held_back(membrane, demos):
    _, _, phenomena = demos
    model, response, branch = membrane
    stretches = phenomena.stable_stretches(response.diagrams[0], branch, model)
    assert stretches[0].opens == ""
    assert {s.closes for s in stretches} <= {"LP", "NS", "PD"}
    for s in stretches:
        inside = branch.omega / tau / model.frequency[0] > min(s.start, s.stop)
        assert inside.any()
    found = phenomena.reach(response.diagrams[0], model)
    assert found.first < 0.9 * phenomena.alone(LEVEL)
    assert not found.surged


def test_backbones_meet_where_the_physics_says(demos):
    """3.35 and 3.43 f01 for the plate, 2.57 for the ideal membrane of uniform tension."""
    fig3, _, phenomena = demos
    plate = fig3.reduced("plate", 11)
    meets = [phenomena.internal_resonance(plate, label) for label in ("f21c", "f21s")]
    assert sorted(meets) == pytest.approx([3.35, 3.43], abs=5e-3)
    scene = nanorom.Scene.from_toml(fig3.reduced("membrane", 1).scene)
    ideal = nanorom.reduce(scene.with_(tension=nanorom.Tension.isotropic(0.3), modes=6))
    assert phenomena.internal_resonance(ideal, "f21c") == pytest.approx(2.57, abs=5e-3)


def test_dependence_runs_its_cases_in_short(demos, directory):
    import dependence

    names = ("pressure, modes 1 4 6 15", "f01 alone")
    found, meets = dependence.main(directory / "dependence", names)
    held, free = (found[name][0] for name in names)
    assert free.first == pytest.approx(demos[2].alone(dependence.LEVELS[0]), rel=ALONE_TOLERANCE)
    assert held.first < 0.9 * free.first
    assert np.isfinite(meets[names[0]]) and np.isnan(meets[names[1]])
    assert (directory / "dependence" / "dependence.png").stat().st_size > 10_000


def test_a_fold_is_not_taken_for_another_one_near_it(demos):
    """Two branches of folds run close to each other; at a fold the frequency turns."""
    _, _, phenomena = demos

    class Points:
        def __init__(self, omega, amplitude, **rest):
            self.omega, self.amplitude = tau * np.asarray(omega), np.asarray(amplitude, dtype=float)
            self.__dict__.update(rest)

        def __len__(self):
            return len(self.omega)

    size = np.array([[1.0], [2.0], [3.0], [3.1], [2.9], [1.0]])
    branch = Points([2.0, 2.4, 2.66, 2.63, 2.5, 2.2], size, stable=np.arange(6) < 3)
    own, other = (Points(w, [a], type="LP") for w, a in ((2.6605, 3.08), (2.64, 3.06)))

    class Diagram:
        branches = [branch]

        def points(self, branch):
            return [other, own]

    class Model:
        frequency = [1.0]

    (stretch,) = phenomena.stable_stretches(Diagram(), branch, Model())
    assert stretch.top == pytest.approx(2.6605)


def test_a_detached_branch_lies_beyond_the_barrier(membrane, demos, directory):
    """demos/surge.py with a few steps of the sweep, below the first loss of stability: no fall."""
    import surge

    model, _, branch = membrane
    ((falls, stretches),) = surge.main(directory / "surge", directory, (LEVEL,), steps=3)
    assert falls[0] == pytest.approx(surge.RATIOS[2])  # none in so few
    low, high = min(s.start for s in stretches), max(s.top for s in stretches)
    assert 2.6 < low < 3.0 < 3.2 < high  # stable where the branch from 2 f01 is not
    stable = branch.omega[branch.stable] / tau / model.frequency[0]
    assert stable.max() < low
    assert (directory / "surge" / "surge.png").stat().st_size > 10_000


def test_sweeps_jump_at_the_folds_of_the_branches_they_are_drawn_over(demos, directory):
    """demos/measured.py at its lower level."""
    import measured

    ratios, level = np.linspace(0.98, 1.1, 10), measured.LEVELS[0]
    response, found = measured.main(directory / "measured", (level,), ratios)
    step = (ratios[1] - ratios[0]) * response.frequency[0] / 1e6
    folds = [p.omega / tau / 1e6 for p in response.diagrams[0].points("LP", 0)]
    for direction, fold in (("up", max(folds)), ("down", min(folds))):
        assert abs(measured.jump(found, level, direction) - fold) < 1.5 * step
    assert max(folds) - min(folds) > 4 * step
    assert (directory / "measured" / "response.png").stat().st_size > 10_000


def test_linear_response_peaks_at_the_frequencies_with_height_j_over_c_omega(membrane):
    model, _, _ = membrane
    force = np.zeros(model.size)
    force[0] = 1e-12
    f1 = model.frequency[0]
    amplitude = linear_response(model, force, [0.0, f1])
    assert amplitude[0, 0] == pytest.approx(1e-12 / model.stiffness[0, 0])
    expected = 1e-12 / (1j * tau * f1 * model.damping[0, 0])
    assert amplitude[1, 0] == pytest.approx(expected)
    assert np.abs(amplitude[:, 1:]).max() < 1e-6 * abs(amplitude[0, 0])


def test_figures_are_written(membrane, directory):
    for name in ("linear.png", "nonlinear.png"):
        assert (directory / name).stat().st_size > 10_000


def test_motion_is_rebuilt_from_the_files_alone(membrane):
    model, _, branch = membrane
    orbit = branch.orbit(len(branch.omega) // 3)
    shares = motion.energy_shares(model, orbit)
    assert shares.sum() == pytest.approx(1)
    t = motion.time_of_largest(model, orbit)
    largest = np.abs(motion.deflection(model, orbit, t)).max()
    q = orbit(t)
    assert largest == pytest.approx(np.abs(q @ model.shapes.values).max())
    assert largest >= 0.9 * branch.amplitude[len(branch.omega) // 3, 0]
    again = motion.deflection(model, orbit, t + orbit.period)
    assert again == pytest.approx(motion.deflection(model, orbit, t), abs=1e-9 * largest)


def test_fig4_draws_everything(membrane, demos, directory, monkeypatch):
    _, fig4, _ = demos
    monkeypatch.setattr(pictures, "FRAMES", 3)
    model, orbit = fig4.main(directory / "fig4", directory)
    found = {path.name for path in (directory / "fig4").iterdir()}
    assert found == {"branch.png", "time.png", "shapes.png", "snapshots.png", "motion.gif"}
    assert (directory / "fig4" / "motion.gif").read_bytes()[:3] == b"GIF"
    shares = motion.energy_shares(model, orbit)
    most = {model.number[r] for r in np.argsort(shares)[::-1][:4]}
    assert {1, 4, 6} <= most  # the paper: modes 4 and 6 beside f01 (15 is not among these)


def test_films_are_rebuilt_without_finite_elements(membrane, demos, directory):
    """fig4 in a fresh interpreter, from the files: DOLFINx and its libraries are never loaded."""
    code = (
        "import sys; sys.path.insert(0, sys.argv[1]); import fig4;"
        "fig4.main(sys.argv[2], sys.argv[3], frames=False);"
        "found = {name.split('.')[0] for name in sys.modules};"
        "assert not found & {'dolfinx', 'petsc4py', 'mpi4py', 'gmsh', 'ufl', 'basix'}, found"
    )
    places = [str(DEMOS), str(directory / "again"), str(directory)]
    subprocess.run([sys.executable, "-c", code, *places], check=True, capture_output=True)
    assert (directory / "again" / "snapshots.png").exists()


def test_motion_needs_shapes(make_model, membrane):
    _, _, branch = membrane
    with pytest.raises(ModelError, match="no"):
        motion.deflection(make_model(11, shapes=None), branch.orbit(0), 0.0)
    with pytest.raises(ModelError, match="no"):
        pictures.animate(make_model(11, shapes=None), branch.orbit(0), "never.gif")


def test_falls_are_counted(demos, tmp_path):
    """demos/falls.py with few sweeps and steps, in which the motion grows and none falls."""
    import falls

    (found,) = falls.main(tmp_path, 4, (2.0,), steps=3)
    assert len(found.last) == 4 and not found.fell.any()
    assert (tmp_path / "falls.png").stat().st_size > 10_000
