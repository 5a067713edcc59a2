"""A viscoelastic material damps bending and stretching: Kelvin-Voigt, stress C:(1 + tau d/dt)E."""

import numpy as np
import pytest

from nanorom.errors import SceneError
from nanorom.fem.reduce import reduce_scene
from nanorom.scene.excitation import Damping
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Rectangle
from nanorom.scene.material import Material
from nanorom.scene.scene import Accuracy, Modes, Scene
from nanorom.scene.support import Edge, Support
from nanorom.workflow import plan

TIME = 2e-10  # s
SAME = 1e-9
ROUND_OFF = 1e-12
VISCOUS = f"quality_factor = 180\nmaterial_time = {TIME}"


@pytest.fixture(scope="module")
def scene(drum_toml):
    text = drum_toml.replace("quality_factor = 180", VISCOUS)
    return Scene.from_toml(text).with_(degree=6, mesh_size="1.2 um", tolerance=None)


@pytest.fixture(scope="module")
def model(scene):
    return reduce_scene(scene)


def test_stress_of_pairs_makes_up_the_cubic_force(model):
    q = np.array([3e-9, -2e-9, 5e-9])
    force = np.einsum("rjkl,j,k,l->r", model.stretching, q, q, q)
    np.testing.assert_allclose(force, model.nonlinear_forces(q), rtol=SAME)
    s = model.stretching
    scale = np.abs(s).max()
    assert np.abs(s - s.transpose(0, 2, 1, 3)).max() < ROUND_OFF * scale  # stress of jk and kj
    assert np.abs(s - s.transpose(3, 1, 2, 0)).max() < ROUND_OFF * scale  # slopes r and l
    # which the symmetric tensor does not know: modes 1 and 2 stretch and shear differently
    assert np.abs(s[0, 0, 1, 1] / s[0, 1, 1, 0] - 1) > 0.1


def test_stretching_dissipates(model):
    random = np.random.default_rng(0)
    for _ in range(20):
        q, v = random.standard_normal((2, 3))
        rate = 2 * np.einsum("rjkl,j,k,l->r", model.cubic_damping, q, v, q) @ v
        assert rate > 0


def test_damping_is_that_of_quality_factor_bending_and_stretching(model, scene):
    viscous = np.diag(2 * np.pi * model.frequency * model.mass / 180) + TIME * model.bending
    np.testing.assert_allclose(model.damping, viscous, rtol=SAME)
    np.testing.assert_allclose(model.system().cubic_damping, TIME * model.stretching)


def test_bending_is_what_is_left_of_the_stiffness_without_tension(model, scene):
    """Without tension f01 of the clamped disc is that of beta = 3.19622062 (Leissa 1969)."""
    loose = reduce_scene(scene.with_(tension=Tension(0.0, 0.0)))
    np.testing.assert_allclose(loose.bending, loose.stiffness, atol=SAME * loose.stiffness.max())
    flexural = 410e9 * 10e-9**3 / (12 * (1 - 0.16**2))
    exact = 3.19622062**4 / 2.5e-6**4 * flexural / (2267 * 10e-9)
    assert loose.bending[0, 0] / loose.mass[0] == pytest.approx(exact, rel=1e-5)
    assert 0 < model.bending[0, 0] < 0.5 * model.stiffness[0, 0]


def test_other_routes_and_files_keep_it(scene, model, tmp_path):
    other = reduce_scene(scene.with_(method="tangent"))
    other.save(tmp_path / "rom.h5")
    other = type(other).load(tmp_path / "rom.h5")
    np.testing.assert_allclose(other.cubic_damping[0, 0, 0, 0], TIME * model.cubic[0, 0, 0, 0])


def test_film_that_is_not_flat_is_refused(scene):
    loaded = Scene.from_toml(scene.to_toml() + '[load]\npressure = "100 Pa"\n')
    for tried in (plan, reduce_scene):  # before anything is computed
        with pytest.raises(SceneError, match="damping.material_time: only for a film that neither"):
            tried(loaded)


def test_bending_of_a_film_that_relaxes_is_that_of_the_tension_it_relaxes_to():
    """Free to contract between its ends it keeps T_x - nu T_y alone, exactly (plane stress)."""
    nu, along, across, h = 0.3, 40.0, 60.0, 1e-3
    rigidity = h**3 / (12 * (1 - nu**2))
    ends = Edge("simply_supported", in_plane="normal")
    relaxing = Scene(
        geometry=Rectangle(length=1.0, width=0.4),
        plate=Plate(thickness=h, model="plate"),
        material=Material(youngs_modulus=1.0, poisson_ratio=nu, density=1.0),
        tension=Tension(along * rigidity, across * rigidity),
        support=Support({"left": ends, "right": ends, "default": "free"}),
        damping=Damping(quality_factor=100, material_time=1e-3),
        modes=Modes(count=3),
        accuracy=Accuracy(tolerance=1e-6),
    )
    constant = relaxing.with_(tension=Tension((along - nu * across) * rigidity, 0.0))
    found, expected = reduce_scene(relaxing), reduce_scene(constant)
    np.testing.assert_allclose(found.frequency, expected.frequency, rtol=1e-6)
    largest = np.abs(expected.bending).max()
    np.testing.assert_allclose(found.bending, expected.bending, atol=1e-6 * largest)
    assert np.linalg.eigvalsh(found.bending).min() > 0
