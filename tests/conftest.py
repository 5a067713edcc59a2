"""What several areas of tests share: any sound model, and the paper's drum as a scene."""

import itertools

import hypothesis
import numpy as np
import pytest

from nanorom.rom.model import ReducedModel
from nanorom.rom.shapes import Shapes

hypothesis.settings.register_profile("nanorom", deadline=None)  # a busy machine is no failure
hypothesis.settings.load_profile("nanorom")


def potential_tensor(rng, size, rank):
    """A tensor that is symmetric in all its indices, exactly."""
    tensor = rng.standard_normal((size,) * rank)
    indices = np.sort(np.indices(tensor.shape), axis=0)
    return tensor[tuple(indices)]


def random_model(size=3, seed=0, **changes):
    rng = np.random.default_rng(seed)
    frequency = np.sort(rng.uniform(2e7, 9e7, size))
    mass = rng.uniform(1e-16, 2e-16, size)
    stiffness = np.diag(mass * (2 * np.pi * frequency) ** 2)
    scale = 1e-8  # m
    given = {
        "frequency": frequency,
        "mass": mass,
        "label": [f"f{n}é" for n in range(size)],
        "number": np.arange(1, size + 1),
        "stiffness": stiffness,
        "damping": np.diag(mass * 2 * np.pi * frequency / 180),
        "quadratic": potential_tensor(rng, size, 3) * stiffness.max() / scale,
        "cubic": potential_tensor(rng, size, 4) * stiffness.max() / scale**2,
        "drive": {"pressure": rng.standard_normal(size) * 1e-11},
        "parametric": {
            "tension": -np.cov(rng.standard_normal((size, size + 2))).reshape(size, size)
        },
        "shapes": square_shapes(rng, size),
        "diagnostics": {"asymmetry": 0.0, "dofs": 845, "wall_time": {"mesh": 0.5}, "note": "text"},
        "scene": "[geometry]\n",
        "method": "direct",
        "in_plane": "free",
        "versions": {"dolfinx": "0.5.2"},
    }
    return ReducedModel(**{**given, **changes})


def square_shapes(rng, size, points=4):
    axis = np.linspace(0, 1e-6, points)
    xy = np.array(list(itertools.product(axis, axis)))
    corner = [i * points + j for i in range(points - 1) for j in range(points - 1)]
    cells = [[c, c + 1, c + points] for c in corner]
    cells += [[c + 1, c + points + 1, c + points] for c in corner]
    xyz = np.column_stack([xy, np.zeros(len(xy))])
    return Shapes(xyz, cells, rng.uniform(-1, 1, (size, len(xyz))))


DRUM = """
[geometry]
shape = "disc"
radius = "2.5 um"
[plate]
thickness = "10 nm"
[material]
youngs_modulus = "410 GPa"
poisson_ratio = 0.16
density = "2267 kg/m^3"
[tension]
x = "0.321 N/m"
y = "0.257 N/m"
[support]
edge = "clamped"
[modes]
count = 3
[damping]
quality_factor = 180
[drive]
direct = ["5 Pa", "20 Pa"]
[sweep]
from = "0.9 f1"
to = "1.2 f1"
"""


@pytest.fixture(scope="session")
def make_model():
    """A function (size, seed, **changes) that gives a reduced model of random numbers."""
    return random_model


@pytest.fixture(scope="session")
def drum_toml():
    """The paper's drum with three modes and a response at two drive levels."""
    return DRUM
