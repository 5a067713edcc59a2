"""Tension that varies over the film and relaxes in its plane, by Mathieu functions."""

import numpy as np
import pytest
from scipy.special import mathieu_a, mathieu_b

from nanorom.errors import SceneError
from nanorom.fem.reduce import reduce_scene
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Disc, Rectangle
from nanorom.scene.material import Material
from nanorom.scene.scene import Accuracy, Modes, Scene
from nanorom.scene.support import Edge, Support
from nanorom.scene.wrinkles import Unevenness

LENGTH, WIDTH, THICKNESS, DENSITY, POISSON = 2e-6, 1.3e-6, 2e-9, 2500.0, 0.25
TENSION, AMPLITUDE = 0.1, 0.06


def film(variation, **changes):
    parts = {
        "geometry": Rectangle(LENGTH, WIDTH),
        "plate": Plate(thickness=THICKNESS, model="membrane"),
        "material": Material(youngs_modulus="300 GPa", poisson_ratio=POISSON, density=DENSITY),
        "tension": Tension(TENSION, variation=variation),
        "modes": Modes(count=4),
    }
    return Scene(**parts | changes)


def mathieu(n, k):
    """Frequency in Hz of k + 1 half waves along x and n along y.

    Held across all sides, and along the left and right ones alone, the film relaxes to the tension
    x TENSION everywhere, and y TENSION + (1 - nu) AMPLITUDE cos(2 pi x/LENGTH), so that
    X'' + (a - 2 q cos 2z) X = 0 with z = pi x/LENGTH.
    """
    across = (n * np.pi / WIDTH) ** 2
    along = (np.pi / LENGTH) ** 2
    q = across * (1 - POISSON) * AMPLITUDE / (2 * along * TENSION)
    value = mathieu_a(k + 1, q) if k % 2 == 0 else mathieu_b(k + 1, q)
    return np.sqrt(TENSION * (along * value + across) / (DENSITY * THICKNESS)) / (2 * np.pi)


def test_a_rectangle_whose_tension_is_a_cosine_has_the_frequencies_of_mathieus_equation(tmp_path):
    x, y = np.meshgrid(*(np.linspace(-0.5, 0.5, n) * s for n, s in ((161, LENGTH), (9, WIDTH))))
    table = tmp_path / "tension.csv"
    pull = AMPLITUDE * np.cos(2 * np.pi * x / LENGTH)
    np.savetxt(table, np.column_stack([each.ravel() for each in (x, y, pull)]), delimiter=",")
    exact = sorted(mathieu(n, k) for n in (1, 2, 3) for k in range(4))[:4]
    even = sorted(
        np.sqrt((n / WIDTH) ** 2 + (k / LENGTH) ** 2) for n in (1, 2, 3) for k in (1, 2, 3, 4)
    )[:4]
    even = np.array(even) * np.sqrt(TENSION / (DENSITY * THICKNESS)) / 2
    assert np.abs(np.array(exact) / even - 1).max() > 0.02  # it is no small effect
    sides = Edge(w="clamped", in_plane="normal")
    support = Support({"default": "clamped", "bottom": sides, "top": sides})
    model = reduce_scene(film(table, support=support))
    assert model.frequency == pytest.approx(exact, rel=1e-6)
    assert model.static["mean_tension"] == pytest.approx(TENSION, rel=1e-6)


def test_a_table_of_a_random_tension_is_that_tension(tmp_path):
    uneven = Unevenness("0.01 N/m", "0.5 um", 3)
    x, y = (each.ravel() for each in np.meshgrid(*[np.linspace(-1e-6, 1e-6, 101)] * 2))
    table = tmp_path / "tension.txt"
    np.savetxt(table, np.column_stack([x, y, uneven.values(np.column_stack([x, y]))]))
    disc = {
        "geometry": Disc(1e-6),
        "modes": Modes(count=3),
        "accuracy": Accuracy(degree=4, mesh_size=0.4e-6),
    }
    drawn, read = (reduce_scene(film(each, **disc)) for each in (uneven, table))
    assert drawn.frequency == pytest.approx(read.frequency, rel=1e-6)
    assert drawn.frequency[2] - drawn.frequency[1] > 1e-3 * drawn.frequency[1]


def test_moments_of_a_random_tension_are_those_asked_for():
    points = np.array([[0.0, 0.0], [0.3e-6, 0.4e-6]])
    found = np.array([Unevenness(0.02, "0.5 um", seed).values(points) for seed in range(600)])
    assert found.mean(axis=0) == pytest.approx([0, 0], abs=0.003)
    variance, covariance = np.cov(found.T)[0]
    assert variance == pytest.approx(4e-4, rel=0.15)
    assert covariance == pytest.approx(4e-4 * np.exp(-0.5), rel=0.2)


def test_scene_with_a_random_tension_is_read_as_it_was_written():
    scene = film(Unevenness("0.01 N/m", "0.5 um", 3))
    assert Scene.from_toml(scene.to_toml()) == scene


@pytest.mark.parametrize(
    ("tension", "message"),
    [
        ('value = 0.1\nvariation = "no.csv"', "tension.variation: found '.*no.csv'; there is no"),
        ("value = 0.1\nvariation = 3", "tension.variation: found 3; allowed: the name of a table"),
        (
            'value = 0.1\nvariation = { amplitude = "-1 N/m", correlation = 1e-6 }',
            "tension.variation.amplitude: found '-1 N/m'; allowed: greater than 0",
        ),
        ("value = 0.1\nvariation = { amplitude = 0.01 }", "tension.variation.correlation: missing"),
        (
            "value = 0.1\nvariation = { amplitude = 0.2, correlation = 1e-6 }",
            "tension.variation.amplitude: found 200 mN/m; allowed: less than the tension, 100 mN/m",
        ),
    ],
)
def test_bad_variations_are_one_line_before_anything_runs(tension, message):
    head, _, tail = film(None).to_toml().partition("[tension]")
    rest = tail[tail.index("[support]") :]
    with pytest.raises(SceneError, match=message) as error:
        Scene.from_toml(f"{head}[tension]\n{tension}\n{rest}")
    assert "\n" not in str(error.value)


def test_a_table_that_does_not_cover_the_film_is_told(tmp_path):
    table = tmp_path / "small.csv"
    np.savetxt(table, [[0, 0, 0.01], [1e-7, 0, 0.01], [0, 1e-7, 0.02]], delimiter=",")
    with pytest.raises(SceneError, match="tension.variation: the points of .* do not cover"):
        reduce_scene(film(table, accuracy=Accuracy(degree=2, mesh_size=1e-6)))
