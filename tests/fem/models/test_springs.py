"""Elastic edges against characteristic equations and their rigid limits."""

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import iv, ivp, jv, jvp

from nanorom.errors import SceneError
from nanorom.fem.models.beam import Beam
from nanorom.fem.models.beam import modes as beam_modes
from nanorom.fem.reduce import reduce_scene
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Disc, Rectangle, String
from nanorom.scene.load import Load
from nanorom.scene.material import Material
from nanorom.scene.scene import (
    Accuracy,
    Modes,
    Reduction,
    Scene,
)
from nanorom.scene.support import Spring, Support

EXACT = 1e-8  # frequencies
ROUTES = 1e-7  # direct against STEP
ROUGH = Accuracy(degree=5, mesh_size=1e-6)
RADIUS, MODULUS, THICKNESS, DENSITY, NU, TENSION = 2e-6, 300e9, 2e-8, 2600.0, 0.25, 0.8
RIGIDITY = MODULUS * THICKNESS**3 / (12 * (1 - NU**2))
# force per length and displacement as stiff as the film, moment per angle as stiff as the plate
SPRING = Spring(3 * TENSION / RADIUS, 5 * RIGIDITY / RADIUS)


def drum(support=SPRING, **changes):
    given = {
        "geometry": Disc(RADIUS),
        "plate": Plate(THICKNESS, "plate"),
        "material": Material(MODULUS, NU, DENSITY),
        "tension": Tension.isotropic(TENSION),
        "support": Support(support),
        "modes": Modes(count=4),
    }
    return Scene(**{**given, **changes})


def edge_residual(omega, p, spring, stiffness):
    """Determinant of the edge conditions of a disc of radius and tension 1, scaled.

    w = A J_p(b r) + B I_p(g r); at r = 1 the moment D (w'' + nu (w' - p^2 w)) = -k_t w' and the
    force T w' - D ((lap w)' - (1 - nu) p^2 (w' - w)) = -k w (Leissa, Vibration of Plates, 1969,
    section 2.1.5, with tension).
    """
    turning = stiffness * spring[1]
    half = 1 / (2 * stiffness)
    s = np.sqrt(half**2 + omega**2 / stiffness)
    columns = []
    for k, sign, value, slope in (
        (np.sqrt(s - half), -1, jv, jvp),
        (np.sqrt(s + half), 1, iv, ivp),
    ):
        w, d1, d2 = value(p, k), k * slope(p, k), k**2 * slope(p, k, 2)
        moment = stiffness * (d2 + NU * (d1 - p**2 * w)) + turning * d1
        shear = sign * k**2 * d1 - (1 - NU) * p**2 * (d1 - w)
        force = d1 - stiffness * shear + spring[0] * w
        columns.append(np.array([moment, force]) / abs(w))
    return np.linalg.det(np.column_stack(columns))


def exact_frequency(p, spring, stiffness):
    """Lowest root of the characteristic equation for p nodal diameters."""
    grid = np.linspace(0.05, 8, 400)
    values = [edge_residual(x, p, spring, stiffness) for x in grid]
    first = np.flatnonzero(np.diff(np.sign(values)))[0]
    return brentq(
        lambda x: edge_residual(x, p, spring, stiffness), *grid[[first, first + 1]], xtol=1e-14
    )


def test_drum_on_springs_meets_its_characteristic_equation():
    model = reduce_scene(drum())
    assert model.label[:4] == ("f01", "f11c", "f11s", "f21c")
    unit = np.sqrt(TENSION / (DENSITY * THICKNESS)) / RADIUS / (2 * np.pi)
    stiffness = RIGIDITY / (TENSION * RADIUS**2)
    exact = [exact_frequency(p, (3.0, 5.0), stiffness) for p in (0, 1, 1, 2)]
    assert model.frequency / unit == pytest.approx(exact, rel=EXACT)


def test_stiff_springs_are_rigid_supports():
    stiff = reduce_scene(drum(Spring(1e7 * TENSION / RADIUS, 1e7 * RIGIDITY / RADIUS)))
    clamped = reduce_scene(drum("clamped"))
    assert stiff.frequency == pytest.approx(clamped.frequency, rel=1e-6)
    assert stiff.cubic == pytest.approx(clamped.cubic, abs=1e-5 * clamped.cubic.max())
    hinged = reduce_scene(drum(Spring(rotational=0.0)))
    supported = reduce_scene(drum("simply_supported"))
    assert hinged.frequency == pytest.approx(supported.frequency, rel=1e-12)


@pytest.mark.parametrize("load", [None, Load(pressure=2e4)])
def test_direct_and_step_agree_on_springs(load):
    direct = reduce_scene(drum(load=load, modes=Modes(count=2), accuracy=ROUGH))
    stepped = reduce_scene(
        drum(
            load=load,
            modes=Modes(count=2),
            accuracy=ROUGH,
            reduction=Reduction("step", amplitude="1 nm"),
        )
    )
    for name in ("quadratic", "cubic"):
        exact = getattr(direct, name)
        assert getattr(stepped, name) == pytest.approx(exact, abs=ROUTES * np.abs(exact).max())
    assert stepped.diagnostics["asymmetry"] < 1e-6


def test_beam_on_springs_meets_its_characteristic_equation():
    """Even modes w = A cosh(a x) + B cos(b x) of a beam of length 2 on equal ends."""
    tension, bending, spring, turning = 3.0, 0.2, 7.0, 0.4

    def residual(omega):
        half = tension / (2 * bending)
        s = np.sqrt(half**2 + omega**2 / bending)
        a, b = np.sqrt(s + half), np.sqrt(s - half)
        rows = []
        for w, d1, d2, d3 in (
            (1.0, a * np.tanh(a), a**2, a**3 * np.tanh(a)),
            (np.cos(b), -b * np.sin(b), -(b**2) * np.cos(b), b**3 * np.sin(b)),
        ):
            rows.append([bending * d2 + turning * d1, tension * d1 - bending * d3 + spring * w])
        return np.linalg.det(np.array(rows))

    end = Spring(spring, turning)
    found = 2 * np.pi * beam_modes(Beam(2.0, 1.0, bending, tension, 1.0, (end, end)), 3).frequency
    for omega in found[[0, 2]]:
        root = brentq(residual, 0.99 * omega, 1.01 * omega, xtol=1e-14)
        assert omega == pytest.approx(root, rel=EXACT)


def test_plate_strip_on_springs_tends_to_the_beam():
    ends = Spring(1e5, 1e-7)
    narrow = {
        "geometry": String("60 um", "1 um"),
        "material": Material(MODULUS, 0.0, DENSITY),
        "tension": Tension(TENSION, 0.0),
        "modes": Modes(count=1),
        "support": {"left": ends, "right": ends},
    }
    beam, strip = (
        reduce_scene(drum(plate=Plate(1e-7, model), **narrow)) for model in ("beam", "plate")
    )
    held = reduce_scene(drum(plate=Plate(1e-7, "beam"), **{**narrow, "support": RIGID}))
    assert beam.frequency[0] < 0.99 * held.frequency[0]
    assert strip.frequency == pytest.approx(beam.frequency, rel=1e-6)
    assert strip.cubic == pytest.approx(beam.cubic, rel=1e-5)


RIGID = {"left": "clamped", "right": "clamped"}


def test_springs_survive_the_scene_file():
    springs = {"left": Spring(1e6), "right": Spring(None, 1e-9), "top": "clamped"}
    scene = drum(geometry=Rectangle("4 um", "2 um"), support=springs)
    assert Scene.from_toml(scene.to_toml()) == scene
    text = 'edge = { spring = "1 MN/m^2", rotational = "2 nN" }'
    around = Scene.from_toml(drum("clamped").to_toml().replace('edge = "clamped"', text))
    assert around.supports == {"edge": Spring(1e6, 2e-9)}


@pytest.mark.parametrize(
    "spring, key",
    [
        ({"spring": "1 N/m"}, "support.spring"),
        ({"spring": -1.0}, "support.spring"),
        ({"rotational": "1 Pa"}, "support.rotational"),
        ({"edge": {"stiffness": 1.0}}, "support.edge.stiffness"),
    ],
)
def test_bad_springs_name_the_key(spring, key):
    with pytest.raises(SceneError, match=key):
        Support(spring)


def test_rotational_spring_needs_a_plate():
    with pytest.raises(SceneError, match=r"support\.rotational"):
        drum(plate=Plate(THICKNESS, "membrane"))


def test_soft_edges_keep_modes_apart_that_are_nearest_to_one_harmonic():
    """Modes 6 and 17 have no nodal diameter, and are both nearest to the membrane's f02.

    Provenance: determinant of the edge's conditions on J_0 and I_0, as in `edge_residual`.
    """
    scene = Scene(
        geometry=Disc("2.5 um"),
        plate=Plate("10 nm"),
        material=Material("410 GPa", 0.16, 2267),
        tension=Tension.isotropic(0.1),
        support=Support(Spring(1e4)),
        modes=Modes(select=[6, 17]),
        accuracy=Accuracy(1e-6),
    )
    model = reduce_scene(scene)
    assert model.frequency == pytest.approx([20.016728e6, 50.030931e6], rel=3e-8)
    assert np.sqrt(np.diag(model.stiffness) / model.mass) == pytest.approx(
        2 * np.pi * model.frequency, rel=1e-8
    )
