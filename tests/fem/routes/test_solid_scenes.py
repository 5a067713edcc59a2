"""Scenes with plate.model = "solid": beams, plates, strings, what is refused."""

import attrs
import numpy as np
import pytest
from numpy.polynomial import Polynomial, legendre
from scipy.linalg import eigh

from nanorom.errors import SceneError
from nanorom.fem.mesh.gmsh import MESHES
from nanorom.fem.plan import Plan
from nanorom.fem.reduce import reduce_scene
from nanorom.fem.routes.registry import route_of
from nanorom.rom.manifold.reduced import manifold
from nanorom.scene.excitation import Damping
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Disc, MeshFile, Rectangle, String
from nanorom.scene.load import Load
from nanorom.scene.material import Gas, Material
from nanorom.scene.scene import Accuracy, Modes, Reduction, Scene
from nanorom.scene.support import Support

ROUGH = Accuracy(tolerance=5e-3)  # told; the errors are a tenth of that
SECOND_ORDER = 0.1  # of the exponent 2 of h/L in what a beam leaves out
SHEAR = 0.05  # of what shear and rotary inertia lower a frequency by: Timoshenko's theory
MINDLIN = 0.01  # what Mindlin's theory leaves out, and these meshes
MESHED = 0.4  # of the exponent of h/a, on these meshes
PRINTED = 1e-4  # of a published backbone


def beam(model, ratio=0.02, nu=0.0, count=1, **changes):
    """A clamped beam of width 2.4 thicknesses."""
    given = {
        "geometry": String(1e-3, 2.4e-3 * ratio),
        "plate": Plate(1e-3 * ratio, model),
        "material": Material(160e9, nu, 2320.0),
        "modes": Modes(count=count),
        "accuracy": ROUGH if model == "solid" else Accuracy(),
    }
    return Scene(**{**given, **changes})


def timoshenko(ratio):
    """First frequency of a clamped beam without Poisson's ratio, E = rho = L = 1, in 1/s.

    Ritz, deflection and rotation in 30 polynomials each; shear factor 5/6.
    """
    x, weights = legendre.leggauss(50)
    basis = [legendre.Legendre.basis(n) - legendre.Legendre.basis(n + 2) for n in range(30)]
    w = np.array([b(x) for b in basis])
    slope = 2 * np.array([b.deriv()(x) for b in basis])
    weights, inertia, shear = weights / 2, ratio**3 / 12, 5 / 6 * ratio / 2
    ww, ss, sw = (w * weights) @ w.T, (slope * weights) @ slope.T, (slope * weights) @ w.T
    stiffness = np.block([[shear * ss, -shear * sw], [-shear * sw.T, inertia * ss + shear * ww]])
    mass = np.block([[ratio * ww, 0 * ww], [0 * ww, inertia * ww]])
    return np.sqrt(eigh(stiffness, mass, eigvals_only=True)[0]) / (2 * np.pi)


def test_slender_solids_tend_to_the_beam_at_the_rate_of_its_theory():
    found = []
    for ratio in (0.04, 0.02):
        solid, slender = (reduce_scene(beam(model, ratio)) for model in ("solid", "beam"))
        lower = solid.frequency[0] / slender.frequency[0] - 1
        unit = 1e3 * np.sqrt(160e9 / 2320.0)
        theory = unit * timoshenko(ratio) / slender.frequency[0] - 1
        assert lower == pytest.approx(theory, rel=SHEAR)
        stiffer = solid.cubic[0, 0, 0, 0] / slender.cubic[0, 0, 0, 0] - 1
        pushed = solid.drive["pressure"] / slender.drive["pressure"] - 1
        heavier = solid.mass[0] / slender.mass[0] - 1
        found.append(np.abs([lower, stiffer, heavier, *pushed]))
    rates = np.log2(found[0] / found[1])
    assert rates == pytest.approx(np.full(len(rates), 2.0), abs=SECOND_ORDER)
    assert np.all(found[1] < 0.02)


def test_published_backbone_of_a_clamped_beam_by_its_effective_cubic():
    """1000 x 10 x 24 um, E 160 GPa, nu .22: 1.018217 at .25756 thicknesses, order 3, in 3D.

    Vizzaccaro et al. 2021, doi:10.1007/s00466-021-02049-1, from tetrahedra of another code.
    """
    scene = beam("solid", 0.01, nu=0.22, accuracy=Accuracy(tolerance=4e-3))
    model = reduce_scene(attrs.evolve(scene, geometry=String("1000 um", "24 um")))
    reduced = manifold(model, masters=[1], order=3)
    omega, _ = reduced.backbone(np.array([0.25756 * 10e-6]))
    found = omega[0] / (2 * np.pi * model.frequency[0])
    assert found == pytest.approx(1.018217, abs=PRINTED)


def mindlin(h, nu=0.3, n=8):
    """First frequency of a clamped square plate of side 1, E = rho = 1, in 1/s.

    Ritz, deflection and rotations in n x n polynomials each; shear factor 5/6.  As omega a^2/pi^2
    sqrt(rho h/D) it is 3.2954 at h = .1 (Dawe and Roufaeil 1980, doi:10.1016/0022-460X(80)90650-3).
    """
    x, weights = legendre.leggauss(n + 6)
    basis = [legendre.Legendre.basis(k) - legendre.Legendre.basis(k + 2) for k in range(n)]
    f, d = (np.array([g(x) for g in which]) for which in (basis, [2 * b.deriv() for b in basis]))
    ff, dd, df = ((p * weights / 2) @ q.T for p, q in ((f, f), (d, d), (d, f)))
    mass, xx, yy = np.kron(ff, ff), np.kron(dd, ff), np.kron(ff, dd)
    # products of slopes of the first with values of the second, and of its slopes along y
    x_, _y, xy = np.kron(df, ff), np.kron(ff, df), np.kron(df, df.T)
    rigidity, shear = h**3 / (12 * (1 - nu**2)), 5 / 6 * h / (2 * (1 + nu))
    twist = (1 - nu) / 2
    zero = np.zeros_like(mass)
    cross = rigidity * (nu * xy + twist * xy.T)
    stiffness = np.block(
        [
            [shear * (xx + yy), shear * x_, shear * _y],
            [shear * x_.T, rigidity * (xx + twist * yy) + shear * mass, cross],
            [shear * _y.T, cross.T, rigidity * (yy + twist * xx) + shear * mass],
        ]
    )
    inertia = h**3 / 12 * mass
    whole = np.block([[h * mass, zero, zero], [zero, inertia, zero], [zero, zero, inertia]])
    return np.sqrt(eigh(stiffness, whole, eigvals_only=True)[0]) / (2 * np.pi)


def test_a_wide_clamped_solid_is_mindlins_plate_and_tends_to_kirchhoffs():
    found = []
    for h in (0.1, 0.05):
        scene = Scene(
            geometry=Rectangle(1.0, 1.0),
            plate=Plate(h, "solid"),
            material=Material(1.0, 0.3, 1.0),
            modes=Modes(count=1),
            accuracy=Accuracy(degree=4, mesh_size=0.17),
        )
        solid = reduce_scene(scene)
        plate = reduce_scene(attrs.evolve(scene, plate=Plate(h, "plate"), accuracy=Accuracy()))
        assert solid.frequency[0] == pytest.approx(mindlin(h), rel=MINDLIN)
        softer = 1 - solid.frequency[0] / plate.frequency[0]
        slacker = 1 - solid.cubic[0, 0, 0, 0] / plate.cubic[0, 0, 0, 0]
        found.append([softer, slacker])
    assert np.log2(np.divide(*found)) == pytest.approx([2.0, 2.0], abs=MESHED)
    unit = np.pi / 2 * np.sqrt(1 / (12 * (1 - 0.09)) * 0.1**2)
    assert mindlin(0.1) / unit == pytest.approx(3.2954, abs=2e-4)


def shallow_arch(h, rise, n=24):
    """Frequency, stiffness, quadratic and cubic coefficient, all but the mode condensed.

    Of a parabolic arch of span, modulus, density and width 1, without Poisson's ratio, clamped;
    Ritz in n polynomials: Marguerre's kinematics, uniform axial force.
    """
    x, weights = legendre.leggauss(60)
    x, weights = x / 2, weights / 2
    held = Polynomial([-0.25, 0, 1]) ** 2
    series = (legendre.Legendre.basis(k).convert(kind=Polynomial) for k in range(n))
    basis = [held * one(Polynomial([0, 2])) for one in series]
    value, slope, bent = (np.array([b.deriv(k)(x) for b in basis]) for k in range(3))
    along = slope @ (weights * -8 * rise * x)
    stretch = (slope * weights) @ slope.T
    stiffness = h**3 / 12 * (bent * weights) @ bent.T + h * np.outer(along, along)
    squares, shapes = eigh(stiffness, h * (value * weights) @ value.T)
    mode, fine = shapes[:, 0], np.linspace(-0.5, 0.5, 2001)
    drawn = np.array([b(fine) for b in basis]).T @ mode
    mode = mode / drawn[np.abs(drawn).argmax()]
    own = mode @ stretch @ mode
    pull = h * (along * own / 2 + (along @ mode) * (stretch @ mode))
    k, quadratic = mode @ stiffness @ mode, mode @ pull
    rest = pull - stiffness @ mode * (quadratic / k)
    cubic = h / 2 * own**2 - 2 * rest @ np.linalg.solve(stiffness, rest)
    return np.array([np.sqrt(squares[0]) / (2 * np.pi), k, quadratic, cubic])


def test_arches_of_a_file_tend_to_shallow_arches_at_the_rate_of_their_theory():
    found = []
    for h in (0.02, 0.01):
        sizes = {"rise": h, "thickness": h, "width": 2 * h, "size": 0.06}
        scene = Scene(
            geometry=MeshFile(MESHES / "arch.geo", scale=1e-3, parameters=sizes),
            plate=Plate(1e-3 * h, "solid"),
            material=Material(160e9, 0.0, 2320.0),
            support=Support({"ends": "clamped"}),
            modes=Modes(count=1),
            accuracy=ROUGH,
        )
        model = reduce_scene(scene)
        frequency, *coefficients = shallow_arch(h, h)
        unit = 160e9 * 2 * h  # by the arch's width
        given = model.frequency, model.stiffness, model.quadratic, model.cubic
        units = 1e3 * np.sqrt(160e9 / 2320.0), 1e-3 * unit, unit, 1e3 * unit
        exact = np.multiply(units, [frequency, *coefficients])
        found.append(np.array([each.ravel()[0] for each in given]) / exact - 1)
    assert np.all(np.abs(found[1]) < 2e-3)
    assert np.log2(np.divide(*found)) == pytest.approx([2.0] * 4, abs=SECOND_ORDER)


def test_tension_and_its_dilution_of_loss_are_those_of_the_string():
    """The solid's own tension, with loss of the material, beside the beam's."""
    material = Material(160e9, 0.0, 2320.0, loss=1e-3)
    pull = Tension(20 * 160e9 * 1e-5 * 1e-4, 0.0)
    solid, slender = (
        reduce_scene(beam(model, 0.01, material=material, tension=pull))
        for model in ("solid", "beam")
    )
    assert solid.frequency == pytest.approx(slender.frequency, rel=1e-3)
    assert solid.losses["material"] == pytest.approx(slender.losses["material"], rel=0.01)
    modulated = solid.parametric["tension"] / slender.parametric["tension"]
    assert modulated == pytest.approx(1.0, rel=1e-3)
    free = reduce_scene(beam("solid", 0.04, material=material))
    assert free.losses["material"] == pytest.approx(1e-3, rel=1e-9)


@pytest.mark.parametrize(
    ("key", "changes"),
    [
        ("load", {"load": Load(pressure=10.0)}),
        ("gas", {"gas": Gas(100.0)}),
        ("support.left", {"support": Support({"left": "simply_supported", "right": "clamped"})}),
        ("reduction.method", {"reduction": Reduction(method="step")}),
        ("reduction.in_plane", {"reduction": Reduction(in_plane="fixed")}),
        ("reduction.outside", {"reduction": Reduction(outside="rest")}),
        ("accuracy.degree", {"accuracy": Accuracy(degree=5, mesh_size=1e-4)}),
        ("material.poisson_ratio", {"material": Material(1e9, 0.495, 1000.0)}),
        ("tension.y", {"tension": Tension(1.0, 1.0)}),
        ("accuracy.tolerance", {"accuracy": Accuracy(tolerance=1e-6)}),
        ("damping.material_time", {"damping": Damping(100, material_time=1e-9)}),
    ],
)
def test_what_a_solid_does_not_know_is_refused_in_one_line(key, changes):
    scene = beam("solid", **changes)
    with pytest.raises(SceneError, match=f"^{key}: found") as told:
        route_of(scene).check(scene)
    assert "\n" not in str(told.value)


def test_the_plan_tells_cells_and_unknowns():
    scene = beam("solid")
    told = route_of(scene).cost(Plan.of(scene))
    assert "tetrahedra of degree 4" in told and "unknowns" in told


def test_turned_pairs_do_not_count_as_errors():
    """The pairs of a coarse drum are turned by some degrees; its tensor is right to a few 1e-3."""
    drum = Scene(
        geometry=Disc(1e-5),
        plate=Plate(2e-6, "solid"),
        material=Material(160e9, 0.2, 2320.0),
        modes=Modes(count=5),
        accuracy=Accuracy(tolerance=0.1),
    )
    model = reduce_scene(drum)
    assert model.label[:3] == ("z1", "z2", "z3")
    assert model.frequency[1] == pytest.approx(model.frequency[2], rel=1e-4)
    assert model.diagnostics["error_tensor"] < 0.1
    pair = model.cubic[1, 1, 1, 1], 3 * model.cubic[1, 1, 2, 2]  # of a circle's two directions
    assert pair[0] == pytest.approx(pair[1], rel=0.01)


def test_a_mode_whose_companion_is_near_twice_its_frequency_is_told_of():
    """An arch's third mode answers the square of its first; risen, it comes near twice that."""
    sizes = {"rise": 0.02, "thickness": 0.01, "width": 0.03, "size": 0.06}
    scene = Scene(
        geometry=MeshFile(MESHES / "arch.geo", scale=1e-3, parameters=sizes),
        plate=Plate(1e-5, "solid"),
        material=Material(160e9, 0.0, 2320.0),
        support=Support({"ends": "clamped"}),
        modes=Modes(count=1),
        accuracy=Accuracy(tolerance=1e-2),
    )
    flat = {**sizes, "rise": 2e-3}
    told = [
        reduce_scene(attrs.evolve(scene, geometry=attrs.evolve(scene.geometry, parameters=each)))
        for each in (sizes, flat)
    ]
    risen, straight = (model.diagnostics["outside_dynamics"][0] for model in told)
    assert straight < 0.01
    assert risen > 4 * straight
