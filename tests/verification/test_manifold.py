"""Manifolds from the film's own forms against its condensed force, closed forms and its modes."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.sparse.linalg import eigsh, splu

import nanorom
from nanorom.cli.main import main
from nanorom.continuation import explore
from nanorom.errors import ModelError, SceneError
from nanorom.results.effective import effective
from nanorom.verification.assemble import assemble
from nanorom.verification.system import FilmSystem
from tests.verification.conftest import SPOT, drum

ROUND_OFF = 1e-9  # relative to the largest force
SLIDING = nanorom.Edge("free", in_plane="normal")  # holds the tension across the string
CLOSED = 1e-4  # relative, of coefficients read from a backbone at a finite amplitude


LENGTH, DENSITY, BENDING = 1e-4, 2000.0, 0.02  # the last, of a string's stiffness: detunes mode 3


def strip(strain):
    """A film that is bent to a sine between two hinges, as a string; its tension of 1 N/m strains
    it by `strain`.
    """
    thickness = np.sqrt(12 * BENDING * strain) * LENGTH / np.pi
    hinge = nanorom.Edge("simply_supported", in_plane="fixed")
    return nanorom.Scene(
        geometry=nanorom.Rectangle(LENGTH, LENGTH / 2),
        plate=nanorom.Plate(thickness, model="plate"),
        material=nanorom.Material(
            youngs_modulus=1.0 / (strain * thickness), poisson_ratio=0.0, density=DENSITY
        ),
        tension=nanorom.Tension(1.0, 1.0),
        support=nanorom.Support({"left": hinge, "right": hinge, "bottom": SLIDING, "top": SLIDING}),
        modes=nanorom.Modes(count=1),
        damping=nanorom.Damping(1000.0),
        accuracy=nanorom.Accuracy(tolerance=1e-6),
    )


@pytest.mark.parametrize(
    "sections",
    [
        {},
        {"load": nanorom.Load(pressure=5000.0)},
        {"reduction": nanorom.Reduction(in_plane="fixed")},
        {"regions": [nanorom.DiscRegion(radius=0.8e-6, thickness=14e-9, density=4000.0)]},
    ],
    ids=["flat", "loaded", "held", "parted"],
)
def test_without_inertia_in_plane_the_force_is_the_condensed_one(sections):
    film = assemble(drum(4, model="plate", **sections), 0)
    system = FilmSystem.of(film, [0, 1])
    classes, discrete = system.classes, film.discrete
    assert classes.count == 2
    free = [len(discrete.free[parity]) for parity in classes.deflections]
    ends = np.cumsum(free)
    random = np.random.default_rng(4)
    shapes = [film.shapes(parity)[:, :1] for parity in classes.deflections]
    parts = [shape * random.uniform(0.3, 0.6) for shape in shapes]
    y = np.zeros((system.size, 1))
    for part, end in zip(parts, ends):
        y[end - len(part) : end] = part
    n = ends[-1]
    inner = system.stiffness[n:, n:]
    if inner.shape[0]:
        # what it does to itself is linear, and it hangs on the deflection by the rest
        push = (system.stiffness @ y + system.quadratic(y, y))[n:]
        y[n:] = -splu(inner.tocsc()).solve(push)
    found = system.stiffness @ y + system.quadratic(y, y) + system.cubic(y, y, y)
    assert np.abs(found[n:]).max(initial=0.0) < ROUND_OFF * np.abs(found[:n]).max()
    known = discrete.force(classes, parts)[0]
    for place, (parity, part) in enumerate(zip(classes.deflections, parts)):
        linear = film.pieces.of_deflections(parity, discrete.free[parity]) @ part
        expected = known[place] + linear
        here = slice(ends[place] - len(part), ends[place])
        assert np.abs(found[here] - expected).max() < 1e-7 * np.abs(expected).max()


@pytest.mark.parametrize("pressure", [0.0, 4000.0])
def test_forces_have_a_potential(pressure):
    load = {"load": nanorom.Load(pressure=pressure)} if pressure else {}
    film = assemble(drum(3, **load), 0)
    system = FilmSystem.of(film, [0, 1])
    u, v, w, x = np.random.default_rng(2).standard_normal((4, system.size, 2))
    one, other = (x * system.quadratic(u, v)).sum(), (u * system.quadratic(x, v)).sum()
    assert one == pytest.approx(other, rel=1e-9)
    one, other = (x * system.cubic(u, v, w)).sum(), (w * system.cubic(u, x, v)).sum()
    assert one == pytest.approx(other, rel=1e-9)


def test_longitudinal_motion_is_that_of_a_rod():
    scene = strip(0.3)
    film = assemble(scene, 0)
    system = FilmSystem.of(film, [0])
    n = len(film.discrete.free[system.classes.deflections[0]])
    stiffness, mass = system.stiffness[n:, n:], system.mass[n:, n:]
    speed = np.sqrt(scene.material.youngs_modulus / DENSITY)
    values, shapes = eigsh(stiffness, 8, mass, sigma=0.0)
    rates = np.sqrt(values) / film.units.time
    # displacement odd about the middle as the strain is even: sin(2 pi x / L) is the first
    assert np.abs(rates / (2 * np.pi / LENGTH * speed) - 1).min() < 1e-7


@pytest.mark.parametrize("strain", [1e-3, 0.1, 0.2])
def test_inertia_in_plane_weakens_a_string_s_stiffening_as_by_hand(strain):
    """w = q sin(pi x / L) stretches uniformly, and as cos(2 pi x / L), which u = sin(2 pi x / L)
    undoes at rest.  At twice the frequency u is larger by 1 / (1 - r), r = (2 w1 / wL)^2.
    """
    scene = strip(strain)
    reduced = nanorom.manifold(scene, [1], 3)
    x = 1e-3 * reduced.equations.amplitude
    stiffening = (reduced.backbone([x])[0][0] / reduced.equations.frequency - 1) / x**2
    still = np.pi / LENGTH * np.sqrt((1 + BENDING) / (DENSITY * scene.plate.thickness))
    assert reduced.equations.frequency == pytest.approx(still, rel=1e-6)
    cubic = np.pi**2 / (4 * LENGTH**2 * strain * (1 + BENDING))  # by the linear stiffness, at rest
    r = strain * (1 + BENDING)
    assert stiffening == pytest.approx(3 / 8 * cubic * (1 - r / (1 - r) / 6), rel=CLOSED)


def test_manifolds_of_more_and_more_modes_go_to_that_of_the_film():
    whole = nanorom.manifold(drum(1, model="plate"), [1], 7)
    x = 0.3 * whole.equations.amplitude
    known = whole.backbone([x])[0][0] / whole.equations.frequency
    errors = []
    for count in (1, 6, 15):
        modal = nanorom.manifold(nanorom.reduce(drum(count, model="plate")), [1], 7)
        errors.append(abs(modal.backbone([x])[0][0] / modal.equations.frequency - known))
    assert errors[2] < errors[1] / 2 < errors[0] / 8
    assert errors[2] < 1e-5


def test_what_is_no_manifold_is_refused_in_one_line():
    with pytest.raises(ModelError, match="masters: found 'f99'"):
        nanorom.manifold(drum(1), ["f99"])
    with pytest.raises(ModelError, match="order: found 50"):
        nanorom.manifold(drum(1), [1], 50)
    viscous = drum(1).with_(damping=nanorom.Damping(100.0, material_time=1e-12))
    with pytest.raises(SceneError, match="damping: found a viscoelastic material"):
        nanorom.manifold(viscous)
    squeezing = drum(1).with_(gas=nanorom.Gas(pressure=1e3, gap=1e-6))
    with pytest.raises(SceneError, match="gas.gap: found; manifolds know"):
        nanorom.manifold(squeezing)
    tones = nanorom.Drive(1.0, harmonics=[nanorom.Harmonic(2, direct=1.0)])
    with pytest.raises(SceneError, match="drive.harmonics: found some; manifolds are driven"):
        nanorom.manifold(drum(1, drive=tones, sweep=nanorom.Sweep("0.9 f1", "1.1 f1")))
    strip = nanorom.Scene(
        geometry=nanorom.String(1e-4, 1e-5),
        plate=nanorom.Plate(1e-7, "beam"),
        material=nanorom.Material(250e9, 0.23, 3000),
        tension=nanorom.Tension(1.0),
        modes=nanorom.Modes(1),
        damping=nanorom.Damping(100.0),
    )
    with pytest.raises(SceneError, match="plate.model: found beam; allowed for manifolds of all"):
        nanorom.manifold(strip)
    with pytest.raises(ModelError, match="products of fields of 3 masters"):
        nanorom.manifold(drum(3), [1, 2, 3], 9)


SWEPT = 0.97, 1.04  # by the first frequency
LARGEST = 0.2  # of the displacement at which cubic and linear force are equal


@pytest.fixture(scope="module")
def driven():
    """A drum under a spot and its tension, and its manifold."""
    drive = nanorom.Drive(1.0, direct_pattern="spot", **SPOT)
    scene = drum(6, model="plate", drive=drive, sweep=nanorom.Sweep("0.9 f1", "1.2 f1"))
    return scene, nanorom.manifold(scene, [1], 7)


def test_drives_act_on_the_modes_of_a_film_s_manifold_as_on_those_of_its_model(driven):
    scene, whole = driven
    model = nanorom.reduce(scene)
    places = [whole.label.index(name) for name in ("f01", "f21c", "f02")]
    modes = [model.label.index(whole.label[place]) for place in places]
    for name, pattern in whole.model.drive.items():
        assert pattern[places] == pytest.approx(model.drive[name][modes], rel=1e-6)
    tension = whole.model.parametric["tension"][np.ix_(places, places)]
    known = model.parametric["tension"][np.ix_(modes, modes)]
    assert tension == pytest.approx(known, rel=1e-6, abs=1e-6 * np.abs(known).max())


def test_driven_motions_on_a_film_s_manifold_are_the_film_s_own(driven):
    """Amplitudes of all modes against a periodic orbit of all degrees of freedom."""
    scene, whole = driven
    model = nanorom.reduce(scene)
    first = 2 * np.pi * model.frequency[0]
    push = model.stiffness[0, 0] / (180 * abs(model.drive["spot"][0]))
    level = LARGEST * whole.equations.amplitude * push
    omega = SWEPT[0] * first, SWEPT[1] * first
    modal = explore(model.system("spot", "tension"), omega=omega, direct=level)
    branch = modal.branches[0]
    orbit = branch.orbit(int(np.argmax(branch.amplitude[:, 0])) - 3)
    known = nanorom.full_orbit(scene, orbit, level, 0.0)
    names = [name for name in model.label if name in whole.label]
    places = [whole.label.index(name) for name in names]
    amplitude = known.amplitude[[model.label.index(name) for name in names]]

    response = whole.response(omega, direct=level, largest_step=0.003)
    own = _at(response.omega, response.amplitude[:, places], known.omega)
    assert own[0] == pytest.approx(amplitude[0], rel=1e-4)
    assert own == pytest.approx(amplitude, rel=0.05)

    small = explore(whole.system(), omega=omega, direct=level)
    lifted = [
        np.abs(whole.lifted(small.branches[0].orbit(i), direct=level)).max(axis=0)[places]
        for i in range(len(small.branches[0].omega))
    ]
    own = _at(small.branches[0].omega, np.array(lifted), known.omega)
    # drives act on the masters alone there, and few points are between these
    assert own[0] == pytest.approx(amplitude[0], rel=3e-3)
    assert own == pytest.approx(amplitude, rel=0.1)

    q = response.motion(int(response.amplitude[:, 0].argmax()))
    top = np.abs(whole.deflection(q)).max()
    assert top == pytest.approx(response.amplitude[:, 0].max(), rel=0.01)


def _at(omega, values, there):
    """Values where a branch first reaches a frequency, on its way up to its fold."""
    rising = np.flatnonzero(np.diff(omega) <= 0)
    end = rising[0] + 1 if len(rising) else len(omega)
    return CubicSpline(omega[:end], values[:end])(there)


def test_a_film_s_manifold_is_found_again_in_its_file(driven, tmp_path):
    _, whole = driven
    whole.model.save(tmp_path / "rom.h5")
    model = nanorom.ReducedModel.load(tmp_path / "rom.h5")
    again = nanorom.manifold(model, ["f01"], 7)
    x = [0.2 * whole.equations.amplitude]
    assert again.backbone(x)[0] == pytest.approx(whole.backbone(x)[0], rel=1e-12)
    with pytest.raises(ModelError, match="order: found 9; allowed: up to 7"):
        nanorom.manifold(model, ["f01"], 9)
    with pytest.raises(ModelError, match="masters: found f02; allowed: f01"):
        nanorom.manifold(model, ["f02"], 5)
    odd = nanorom.manifold(drum(2), ["f11s"], 3)
    with pytest.raises(ModelError, match="direct: found 1; allowed: 0"):
        odd.response((1e8, 2e8), direct=1.0)
    with pytest.raises(ModelError, match="direct: found 1; allowed: 0"):
        explore(odd.system(), omega=(1e8, 2e8), direct=1.0)


def test_coefficients_of_a_film_are_what_those_of_more_and_more_modes_go_to(driven):
    _, whole = driven
    film = effective(whole.model, "f01", 7)
    few, many = (effective(nanorom.reduce(drum(n, model="plate")), "f01", 7) for n in (6, 15))
    # in-plane inertia, which a model of modes lacks, is 1.4e-5 of it
    assert film.cubic == pytest.approx(many.cubic, rel=3e-5)
    left = abs(many.quintic / film.quintic - 1), abs(few.quintic / film.quintic - 1)
    assert left[0] < left[1] / 2 < 0.1
    for name in ("f02", "f21c"):
        place, known = film.label.index(name), many.label.index(name)
        assert film.kerr[place] == pytest.approx(many.kerr[known], rel=2e-3)
        part, other = film.part.index(name), many.part.index(name)
        assert film.part_quintic[part] == pytest.approx(many.part_quintic[other], rel=1e-3)
    assert film.part_quintic.sum() == pytest.approx(film.quintic, rel=1e-9)
    assert np.isnan(film.kerr[film.label.index("field 1")])


def test_the_command_takes_a_scene_and_its_film(tmp_path, capsys):
    scene = tmp_path / "drum.toml"
    scene.write_text(drum(1, model="plate").to_toml(), encoding="utf-8")
    assert main(["effective", str(scene), "--order", "3"]) == 0
    modes = capsys.readouterr().out
    assert main(["effective", str(scene), "--order", "3", "--film"]) == 0
    film = capsys.readouterr().out
    assert "what has no name" in film and "what has no name" not in modes
    assert main(["effective", str(scene), "--order", "99", "--film"]) == 1
    assert "order: found 99; allowed: 1 to 21" in capsys.readouterr().err
    assert main(["effective", str(tmp_path / "rom.h5"), "--film"]) == 1
    assert "allowed with a scene (.toml)" in capsys.readouterr().err
