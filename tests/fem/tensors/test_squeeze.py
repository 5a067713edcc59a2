"""Gas in a gap against closed forms: membranes, rigid discs and rectangles, sealed gaps."""

import numpy as np
import pytest
from mpi4py import MPI
from scipy.special import iv, jn_zeros, jv

from nanorom.errors import SceneError
from nanorom.fem.mesh import mesh
from nanorom.fem.mesh.shapes import Grid, Rings
from nanorom.fem.models.plate import Plate
from nanorom.fem.reduce import reduce_scene
from nanorom.fem.tensors.squeeze import Film
from nanorom.scene.scene import Scene

EXACT = 1e-8
CORNERS = 1e-6  # of uniform cells, at the corners of a rectangle
MEMBRANE = """
[geometry]
shape = "disc"
radius = "10 um"
[plate]
thickness = "50 nm"
model = "membrane"
[material]
youngs_modulus = "250 GPa"
poisson_ratio = 0.23
density = 3100
[tension]
value = "10 N/m"
[modes]
count = 1
[accuracy]
tolerance = 1e-5
"""
GAS = """
[gas]
pressure = "10 kPa"
gap = "300 nm"
"""


def test_a_membrane_over_an_open_gap_has_its_own_shape_of_pressure():
    """J0 is a shape of the Laplacian: p = i sigma phi/(j^2 + i sigma)."""
    scene, j, radius = Scene.from_toml(MEMBRANE + GAS), jn_zeros(0, 1)[0], 10e-6
    model = reduce_scene(scene)
    omega = 2 * np.pi * model.frequency[0]
    sigma = scene.gas.squeeze_number(omega, radius)
    square = np.pi * radius**2 * jv(1, j) ** 2
    force = 10e3 / 300e-9 * square * 1j * sigma / (j**2 + 1j * sigma)
    bare = model.mass[0] * (j / radius) ** 2 * 10.0 / (3100.0 * 50e-9)
    assert model.stiffness[0, 0] == pytest.approx(bare + force.real, rel=EXACT)
    assert omega == pytest.approx(np.sqrt(model.stiffness[0, 0] / model.mass[0]), rel=EXACT)
    assert model.losses["squeeze"][0] == pytest.approx(
        force.imag / model.stiffness[0, 0], rel=EXACT
    )


def film(source, order, vented):
    domain = mesh.build(MPI.COMM_SELF, source, order)
    return Film.of(Plate.on(domain, 8, list(domain.facets), bending=False), vented)


def rigid(gas, sigma):
    return gas.response(np.ones(len(gas.plate.w.x.array)), (), sigma)


@pytest.mark.parametrize("sigma", [0.1, 5.0, 100.0])
def test_a_rigid_disc_over_an_open_gap_meets_bessel_functions(sigma):
    """Griffin, Richardson and Yamanami 1966, J. Basic Eng. 88, 451."""
    found = rigid(film(Rings((0.4, 0.7, 0.85, 0.95, 1.0), (2, 3, 4, 4, 4), 4, 0.4), 8, True), sigma)
    s = np.sqrt(1j * sigma)
    assert found == pytest.approx(np.pi * (1 - 2 * iv(1, s) / (s * iv(0, s))), rel=EXACT)


@pytest.mark.parametrize("sigma", [0.1, 50.0])
def test_a_rigid_rectangle_over_an_open_gap_meets_blech_s_series(sigma):
    a, b = 1.0, 0.6
    lines = (tuple(a * np.linspace(-0.5, 0.5, 9)), tuple(b * np.linspace(-0.5, 0.5, 9)))
    found = rigid(film(Grid(*lines), 1, True), sigma)
    m, n = np.meshgrid(np.arange(1, 4000, 2), np.arange(1, 4000, 2))
    wave = np.pi**2 * ((m / a) ** 2 + (n / b) ** 2)
    series = 64 * a * b / np.pi**4 * (1j * sigma / (m * n) ** 2 / (wave + 1j * sigma)).sum()
    assert found == pytest.approx(series, rel=CORNERS)


def test_gas_sealed_under_a_piston_is_a_spring():
    found = rigid(film(Grid((0.0, 0.5, 1.0), (0.0, 1.0)), 1, False), 3.0)
    assert found == pytest.approx(1.0, rel=EXACT)


def test_rarefied_gas_flows_more_easily():
    dense, thin = (
        Scene.from_toml(MEMBRANE + GAS.replace("10 kPa", pressure)).gas
        for pressure in ("1 MPa", "1 Pa")
    )
    classical = [12 * 1.82e-5 / (gas.pressure * gas.gap**2) for gas in (dense, thin)]
    shares = [gas.squeeze_number(1.0, 1.0) / c for gas, c in zip((dense, thin), classical)]
    assert 0.8 < shares[0] < 1 and shares[1] < 1e-4


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("300 nm", "-3 nm", "gas.gap: found '-3 nm'"),
        ('gap = "300 nm"', 'gap = "300 nm"\nedge = "shut"', "gas.edge: found 'shut'"),
        ('gap = "300 nm"', 'gap = "300 nm"\nviscosity = "1 Pa"', "gas.viscosity: found '1 Pa'"),
    ],
)
def test_gaps_that_make_no_sense_are_refused(old, new, told):
    with pytest.raises(SceneError, match=told):
        Scene.from_toml(MEMBRANE + GAS.replace(old, new))
