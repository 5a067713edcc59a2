"""Every demo runs in a short form and shows the physics that its docstring promises."""

import runpy
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import j1, jn_zeros

import nanorom
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Sweep
from nanorom.workflow import FILES

DEMOS = Path(__file__).parents[2] / "demos"

SCENE_TOLERANCE = 1e-6  # what the demos' scenes ask for
STRING_TOLERANCE = 2e-5  # of a beam model: the ends are neither beams nor plates
STRING_STIFFENING_TOLERANCE = 2e-4  # clamping straightens the ends of the sine
TONGUE_TOLERANCE = 2e-5  # first-order perturbation, and the direct drive beside it
BACKBONE_TOLERANCE = 2e-5
ONSET_MARGIN = 0.01  # the closed form is the leading order in 1/Q

# PHYSICS of the paper's device: spectral solution with T_x = 0.321, T_y = 0.257 N/m, in MHz
PAPER = {
    "f01": 21.15119357,
    "f11s": 35.43957465,
    "f11c": 36.72212759,
    "f21c": 51.91279396,
    "f21s": 52.14308452,
    "f02": 57.68114750,
}


class Outcome:
    """A demo's scene, results and what its main() returns."""

    def __init__(self, name: str, script: str, directory: Path, **changes) -> None:
        self.scene = nanorom.Scene.from_file(DEMOS / f"{name}.toml")
        self.value = runpy.run_path(str(DEMOS / script))["main"](directory, **changes)
        self.directory = directory
        self.model = nanorom.ReducedModel.load(directory / "rom.h5")
        self.response = nanorom.Response.load(directory / "response.h5")

    def folds(self, level: int, branch: int | None = None) -> list[float]:
        """Drive frequencies of the folds at a level, in Hz, rising."""
        points = self.response.diagrams[level].points("LP", branch)
        return sorted(point.omega / (2 * np.pi) for point in points)


@pytest.fixture(scope="module")
def drum(tmp_path_factory):
    drive = Drive(direct="20 Pa", parametric="5 mN/m")
    return Outcome("drum", "drum.py", tmp_path_factory.mktemp("drum"), modes=6, drive=drive)


@pytest.fixture(scope="module")
def string(tmp_path_factory):
    return Outcome("string", "nitride_string.py", tmp_path_factory.mktemp("string"))


@pytest.fixture(scope="module")
def rectangle(tmp_path_factory):
    return Outcome("rectangle", "rectangle.py", tmp_path_factory.mktemp("rectangle"))


@pytest.mark.parametrize("name", ["drum", "string", "rectangle"])
def test_demo_leaves_every_file(name, request):
    outcome = request.getfixturevalue(name)
    assert {path.name for path in outcome.directory.iterdir()} == set(FILES)


def test_scene_of_the_drum_is_the_papers():
    scene = nanorom.Scene.from_file(DEMOS / "drum.toml")
    assert scene.modes.numbers == tuple(range(1, 12))
    assert scene.damping.quality_factor == (180.0,)
    assert scene.material.youngs_modulus == pytest.approx(410e9)


def test_drum_has_the_frequencies_of_the_papers_device(drum):
    assert drum.model.label == tuple(PAPER)
    exact = 1e6 * np.array(list(PAPER.values()))
    assert drum.model.frequency == pytest.approx(exact, rel=SCENE_TOLERANCE)


def test_drum_is_bistable_at_f01(drum):
    f1 = drum.model.frequency[0]
    folds = [f for f in drum.folds(0, branch=0) if f < 1.5 * f1]
    assert len(folds) == 2
    assert f1 < folds[0] < folds[1] < 1.2 * f1


def test_parametric_tongue_of_the_drum_opens_where_mathieu_says(drum):
    """Edges 2 f1 (1 +- sqrt(h^2 - 4/Q^2)/4) with h = t |P_11|/k_1; it ends in a fold above."""
    model, level = drum.model, drum.response.drive.parametric[0]
    depth = level * abs(model.parametric["tension"][0, 0]) / model.stiffness[0, 0]
    half = np.sqrt(depth**2 - (2 / 180) ** 2) / 4
    doublings = drum.response.diagrams[0].points("PD")
    edges = sorted(point.omega / (2 * np.pi) for point in doublings)
    expected = 2 * model.frequency[0] * np.array([1 - half, 1 + half])
    assert edges == pytest.approx(expected, rel=TONGUE_TOLERANCE)
    end = drum.folds(0, branch=1)[-1]
    assert edges[1] < end < 2.9 * model.frequency[0]


def test_drum_demo_finds_how_much_free_in_plane_displacement_softens(tmp_path, capsys):
    """A uniform membrane, where both are known: fixed from an integral of J1, free from Table 1.

    Fixed: B = 1/2 E h/(1 - nu^2) int |grad J0(j r)|^4 dA.  Free: 2.839702975852 E h/R^2, from the
    membrane's Bessel series (25-digit quadrature).
    """
    scene = nanorom.Scene.from_file(DEMOS / "drum.toml")
    changes = {
        "plate": nanorom.Plate(thickness=scene.plate.thickness, model="membrane"),
        "tension": nanorom.Tension(x=0.3, y=0.3),
        "drive": Drive(direct="5 Pa"),
        "sweep": Sweep("0.9 f1", "1.1 f1"),
    }
    outcome = Outcome("drum", "drum.py", tmp_path, modes=1, **changes)
    zero, nu = jn_zeros(0, 1)[0], scene.material.poisson_ratio
    integral = quad(lambda r: 2 * np.pi * r * (zero * j1(zero * r)) ** 4, 0, 1)[0]
    exact = 0.5 * integral / (1 - nu**2) / 2.839702975852
    assert outcome.value == pytest.approx(exact, rel=SCENE_TOLERANCE)
    assert f"by a factor {exact:.4f}" in capsys.readouterr().out


def tensioned_beam(n: int, tension: float, rigidity: float, mass: float, length: float) -> float:
    """Frequency n in Hz of a clamped beam under tension, all per unit of width; exact."""
    ratio = rigidity / (tension * length**2)

    def characteristic(x: float) -> float:
        root = np.sqrt(1 + 4 * ratio * x**2)
        g, k = np.sqrt((root + 1) / 2 / ratio), np.sqrt((root - 1) / 2 / ratio)
        return 2 * g * k * (1 / np.cosh(min(g, 700)) - np.cos(k)) + (g**2 - k**2) * np.sin(k)

    x = brentq(characteristic, 1.0001 * n * np.pi, 1.02 * n * np.pi, xtol=1e-13)
    return x / length * np.sqrt(tension / mass) / (2 * np.pi)


@pytest.mark.parametrize("n", [1, 2])
def test_string_has_the_frequencies_of_a_tensioned_beam(string, n):
    """Clamped ends raise n/(2 L) sqrt(T/(rho h)) by 0.35 %."""
    scene = string.scene
    film, material, h = scene.geometry, scene.material, scene.plate.thickness
    tension, mass = scene.tension.x, material.density * h
    beam = material.youngs_modulus * h**3 / 12
    plate = beam / (1 - material.poisson_ratio**2)
    low, high = (tensioned_beam(n, tension, d, mass, film.length) for d in (beam, plate))
    found = string.model.frequency[string.model.label.index(f"({n},0)")]
    assert found > 1.003 * n / (2 * film.length) * np.sqrt(tension / mass)
    assert low < found < high
    assert found == pytest.approx(high, rel=STRING_TOLERANCE)


def test_string_stiffens_by_its_axial_stretch(string):
    film, h = string.scene.geometry, string.scene.plate.thickness
    area = film.width * h
    exact = string.scene.material.youngs_modulus * area * np.pi**4 / (8 * film.length**3)
    assert string.model.b(1)[1, 1, 1] == pytest.approx(exact, rel=STRING_STIFFENING_TOLERANCE)


@pytest.mark.parametrize("name", ["string", "rectangle"])
def test_bistability_begins_at_the_critical_drive(name, request):
    """F = (4/3)^(5/4) k sqrt(k/b) Q^(-3/2), Lifshitz and Cross, doi:10.1002/9783527626359.ch1."""
    outcome = request.getfixturevalue(name)
    model, quality = outcome.model, outcome.scene.damping.quality_factor[0]
    k, b, force = model.stiffness[0, 0], model.b(1)[1, 1, 1], model.drive["pressure"][0]
    critical = (4 / 3) ** 1.25 * k * np.sqrt(k / b) * quality**-1.5 / force
    levels = [critical * (1 - ONSET_MARGIN), critical * (1 + ONSET_MARGIN)]
    one = model.select([1])
    response = nanorom.respond(one, Drive(direct=levels), Sweep("0.9996 f1", "1.0014 f1"))
    assert [len(diagram.points("LP")) for diagram in response.diagrams] == [0, 2]
    for level, pressure in enumerate(outcome.response.drive.direct):
        assert len(outcome.folds(level)) == (2 if pressure > critical else 0)


@pytest.mark.parametrize("name", ["string", "rectangle"])
def test_upper_fold_lies_on_the_backbone(name, request):
    outcome = request.getfixturevalue(name)
    model = outcome.model
    stiffening = model.b(1)[1, 1, 1] / model.stiffness[0, 0]
    diagram = outcome.response.diagrams[-1]
    fold = max(diagram.points("LP"), key=lambda point: point.omega)
    backbone = model.frequency[0] * np.sqrt(1 + 0.75 * stiffening * fold.amplitude[0] ** 2)
    assert fold.omega / (2 * np.pi) == pytest.approx(backbone, rel=BACKBONE_TOLERANCE)
    assert backbone > model.frequency[0] * (1 + 20 * BACKBONE_TOLERANCE)


def test_rectangle_has_the_frequencies_of_a_membrane_with_clamped_edges(rectangle):
    """Without the edges' correction they would be 6e-4 too low."""
    scene = rectangle.scene
    film, material, h = scene.geometry, scene.material, scene.plate.thickness
    rigidity = material.youngs_modulus * h**3 / 12 / (1 - material.poisson_ratio**2)
    layer = np.sqrt(rigidity / scene.tension.x)
    speed = np.sqrt(scene.tension.y / (material.density * h))
    waves = np.array([[1, 1], [2, 1], [1, 2], [3, 1], [2, 2], [3, 2]])
    assert rectangle.model.label == tuple(f"({m},{n})" for m, n in waves)
    k = np.pi * np.hypot(*(waves / [film.length - 2 * layer, film.width - 2 * layer]).T)
    exact = speed * k / (2 * np.pi) * (1 + (k * layer) ** 2 / 2)
    assert rectangle.model.frequency == pytest.approx(exact, rel=SCENE_TOLERANCE)
