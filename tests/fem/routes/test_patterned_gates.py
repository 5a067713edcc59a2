"""Gates below a part of the film: states, frequencies, tensors and drives, by closed forms."""

from functools import partial

import numpy as np
import pytest
from scipy.integrate import quad, solve_bvp, solve_ivp
from scipy.linalg import eigh
from scipy.optimize import brentq
from scipy.special import jn_zeros, jv, jvp, yv, yvp

from nanorom.errors import ModelError, SceneError
from nanorom.fem.reduce import reduce_scene
from nanorom.rom.patterns import aimed, driven
from nanorom.scene.drive import Drive
from nanorom.scene.film import Plate, Tension
from nanorom.scene.gate import Gate
from nanorom.scene.geometry import Disc, Rectangle
from nanorom.scene.load import VACUUM_PERMITTIVITY, Load
from nanorom.scene.material import Material
from nanorom.scene.outlines import DiscRegion, PolygonRegion, RectangleRegion, RingRegion
from nanorom.scene.scene import Accuracy, Modes, Scene

RADIUS, PATCH, THICKNESS, DENSITY, TENSION = 2e-6, 1e-6, 2e-9, 2500.0, 0.1
BELOW, ABOVE = 300e-9, -200e-9
POISSON = 0.2
VOLTAGE = 12.0  # below; above it is such that the flat film stays at rest
SOFT = 3e9  # Pa: gates matter beside the stretching


def drum(*gates, modulus=SOFT, **changes):
    parts = {
        "geometry": Disc(radius=RADIUS),
        "plate": Plate(thickness=THICKNESS, model="membrane"),
        "material": Material(youngs_modulus=modulus, poisson_ratio=POISSON, density=DENSITY),
        "tension": Tension.isotropic(TENSION),
        "modes": Modes(count=1),
        "load": Load(gates=gates) if gates else None,
        "accuracy": Accuracy(tolerance=1e-6),
    }
    return Scene(**parts | changes)


def balanced(patch):
    """Two gates on both sides of a patch that pull alike."""
    return Gate(BELOW, VOLTAGE, patch), Gate(ABOVE, VOLTAGE * -ABOVE / BELOW, patch)


def derivative(order):
    """Of the potential of both by the height, per area."""
    factor = {2: 1.0, 3: 3.0, 4: 12.0}[order]
    strengths = VACUUM_PERMITTIVITY * VOLTAGE**2 * np.array([1.0, (ABOVE / BELOW) ** 2])
    sides = np.array([1.0, -1.0])
    return factor * float(np.sum(sides * strengths / np.array([BELOW, ABOVE]) ** (order + 1)))


def matched(p=0):
    """Lowest k R of p diameters, and its mode as a function of r/R, for a disc at the centre."""
    soft, a = derivative(2) * RADIUS**2 / TENSION, PATCH / RADIUS

    def outside(k, r, d=0):
        of_j, of_y = (jvp(p, k * r, d), yvp(p, k * r, d)) if d else (jv(p, k * r), yv(p, k * r))
        return of_j * yv(p, k) - of_y * jv(p, k)

    def jump(k):
        inner = np.sqrt(k**2 + soft)
        return inner * jvp(p, inner * a) * outside(k, a) - k * jv(p, inner * a) * outside(k, a, 1)

    grid = np.linspace(0.3, 4.0, 200) + p
    low = next(x for x, y in zip(grid, grid[1:]) if jump(x) * jump(y) < 0)
    k = brentq(jump, low, low + grid[1] - grid[0], xtol=1e-14)
    inner = np.sqrt(k**2 + soft)
    scale = jv(p, inner * a) / outside(k, a)

    def shape(r, d=0):
        if r < a:
            return inner**d * jvp(p, inner * r, d)
        return scale * (k**d * outside(k, r, d) if d else outside(k, r))

    return k, shape


def stretched(shape):
    """Cubic coefficient in N/m^3 of the stretching of a round shape of r/R, its plane relaxed."""
    a, edge = PATCH / RADIUS, 1.0

    def rates(r, y):
        slope, curvature = shape(r, 1), shape(r, 2)
        load = slope * curvature + (1 - POISSON) / (2 * r) * slope**2
        return [y[1], -y[1] / r + y[0] / r**2 - load]

    inner = solve_ivp(rates, (1e-6, a), [0, 0], "DOP853", rtol=1e-11, atol=1e-14, dense_output=True)
    outer = solve_ivp(
        rates, (a, edge), inner.y[:, -1], "DOP853", rtol=1e-11, atol=1e-14, dense_output=True
    )
    turn = outer.y[0, -1]  # u = r is the other solution; the edge is held

    def density(r, solution):
        u, strain = solution.sol(r) - turn * np.array([r, 1.0])
        strain += shape(r, 1) ** 2 / 2
        around = u / r
        return np.pi * r * (strain**2 + around**2 + 2 * POISSON * strain * around)

    energy = sum(
        quad(density, *ends, args=(part,), epsabs=1e-13, limit=200)[0]
        for part, ends in ((inner, (1e-6, a)), (outer, (a, edge)))
    )
    return 4 * energy * SOFT * THICKNESS / (1 - POISSON**2) / RADIUS**2


def frequency(k):
    return np.sqrt(TENSION / (DENSITY * THICKNESS)) * k / (2 * np.pi * RADIUS)


@pytest.fixture(scope="module")
def centred():
    return reduce_scene(drum(*balanced(DiscRegion(radius=PATCH)), modes=Modes(count=2)))


def test_frequencies_of_a_drum_softened_in_a_disc_match_bessel_functions(centred):
    exact = [frequency(matched(p)[0]) for p in (0, 1)]
    assert exact[0] < 0.95 * frequency(jn_zeros(0, 1)[0])  # it is no small effect
    assert centred.frequency == pytest.approx(exact, rel=1e-8)


def test_tensors_are_the_integrals_of_the_potentials_derivatives_over_the_patch(centred):
    shape, a = matched()[1], PATCH / RADIUS

    def integral(power):
        found, _ = quad(lambda r: 2 * np.pi * r * shape(r) ** power, 0, a, epsabs=1e-14)
        return RADIUS**2 * found

    quadratic = -derivative(3) / 2 * integral(3)
    cubic = stretched(shape) - derivative(4) / 6 * integral(4)
    assert cubic < 0.9 * stretched(shape)  # the gates' part is no small one
    assert centred.quadratic[0, 0, 0] == pytest.approx(quadratic, rel=1e-7)
    assert centred.cubic[0, 0, 0, 0] == pytest.approx(cubic, rel=1e-6)


def test_force_and_softening_of_each_gate_are_those_of_its_patch(centred):
    shape, a = matched()[1], PATCH / RADIUS
    area, _ = quad(lambda r: 2 * np.pi * r * shape(r), 0, a, epsabs=1e-14)
    square, _ = quad(lambda r: 2 * np.pi * r * shape(r) ** 2, 0, a, epsabs=1e-14)
    unit = VACUUM_PERMITTIVITY * RADIUS**2
    assert centred.drive["gate"][0] == pytest.approx(unit / BELOW**2 * area, rel=1e-8)
    softening = 2 * unit / BELOW**3 * square
    assert centred.parametric["gate"][0, 0] == pytest.approx(softening, rel=1e-8)
    scene = Scene.from_toml(centred.scene)
    above = reduce_scene(
        Scene.from_toml(
            scene.to_toml() + "[drive]\nvoltage = 1\ngate = 2\n[damping]\n"
            "quality_factor = 100\n[sweep]\nfrom = 1e6\nto = 1e8\n"
        )
    )
    assert above.drive["gate"][0] == pytest.approx(-unit / ABOVE**2 * area, rel=1e-8)
    softening = 2 * unit / -(ABOVE**3) * square
    assert above.parametric["gate"][0, 0] == pytest.approx(softening, rel=1e-8)
    terms = driven(above, Drive(voltage=1.0, gate=2)).drives
    assert terms[1].direct[0] == pytest.approx(VOLTAGE * -ABOVE / BELOW * above.drive["gate"][0])
    with pytest.raises(ModelError, match="drive.gate: found 1, but the model was reduced with"):
        aimed(above, Drive(voltage=1.0))


def ritz(inside, soft, count=9):
    """Lowest k R of a drum softened where inside(x, y) of r/R < 1, by a drum's own modes."""
    zeros = [(p, z) for p in range(count) for z in jn_zeros(p, count)]
    centre, radius = inside
    s, weights = np.polynomial.legendre.leggauss(40)
    r, angle = radius * (s + 1) / 2, 2 * np.pi * np.arange(80) / 80
    x = centre[0] + np.outer(r, np.cos(angle))
    y = centre[1] + np.outer(r, np.sin(angle))
    measure = np.repeat(weights * radius / 2 * r, 80) * 2 * np.pi / 80
    rho, phi = np.hypot(x, y).ravel(), np.arctan2(y, x).ravel()
    modes = np.array([jv(p, z * rho) * np.cos(p * phi) for p, z in zeros])
    norm = np.array([np.pi * (2 if p == 0 else 1) * jv(p + 1, z) ** 2 / 2 for p, z in zeros])
    squares = np.diag(norm * [z**2 for _, z in zeros]) - soft * (modes * measure) @ modes.T
    return np.sqrt(eigh(squares, np.diag(norm), eigvals_only=True)[0])


def test_a_gate_beside_the_centre_softens_as_a_ritz_solution_tells():
    position = (0.7e-6, 0.0)
    patch = DiscRegion(position=position, radius=PATCH)
    model = reduce_scene(drum(*balanced(patch), accuracy=Accuracy(tolerance=1e-4)))
    soft = derivative(2) * RADIUS**2 / TENSION
    rough, fine = (ritz(((position[0] / RADIUS, 0.0), PATCH / RADIUS), soft, n) for n in (9, 18))
    assert abs(rough - fine) < 2e-5 * fine
    assert model.frequency[0] == pytest.approx(frequency(fine), rel=5e-6)


def hanging(first, second):
    """Centre deflection in m of a drum between a disc below and a gate above, by collocation.

    first, second: voltage and gap.  Foppl's equations in r/R: w' = Q/(r N), (r N w')' = -r p, with
    u and N the radial displacement and force; inside and outside of the patch side by side.
    """
    unit, a, inner = 1e-8, PATCH / RADIUS, 1e-5
    stretch = 300e9 * THICKNESS * unit**2 / RADIUS**2 / TENSION

    def rates(r, y, inside, share):
        w, q, u, n = y
        pressure = inside * (share * first[0]) ** 2 / (first[1] - w * unit) ** 2
        pressure = pressure - (share * second[0]) ** 2 / (second[1] + w * unit) ** 2
        slope = q / (r * n)
        load = VACUUM_PERMITTIVITY / 2 * pressure * RADIUS**2 / (TENSION * unit)
        strain = (n - 1) * (1 - POISSON**2) / stretch - slope**2 / 2 - POISSON * u / r
        return np.array([slope, -r * load, strain, (stretch * u / r - (1 - POISSON) * (n - 1)) / r])

    def both(t, y, share):
        spans = (inner, a), (a, 1.0)
        parts = [
            (high - low) * rates(low + (high - low) * t, y[4 * i : 4 * i + 4], 1 - i, share)
            for i, (low, high) in enumerate(spans)
        ]
        return np.vstack(parts)

    def ends(left, right):
        return np.array([*left[1:3], *(right[:4] - left[4:]), right[4], right[6]])

    t = np.linspace(0, 1, 100)
    y = np.zeros((8, len(t)))
    y[[3, 7]] = 1.0
    for share in (0.3, 0.6, 0.8, 1.0):
        found = solve_bvp(partial(both, share=share), ends, t, y, tol=1e-7, max_nodes=20000)
        assert found.success
        t, y = found.x, found.y
    return y[0, 0] * unit


def test_a_drum_between_gates_hangs_as_foppls_equations_tell():
    gates = Gate(220e-9, 10.0, DiscRegion(radius=PATCH)), Gate(-150e-9, 4.0)
    model = reduce_scene(drum(*gates, modulus=300e9))
    exact = hanging((10.0, 220e-9), (4.0, 150e-9))
    assert model.static["centre_deflection"] == pytest.approx(exact, rel=2e-6)


HELD = {"modulus": 300e9, "modes": Modes(select=[1, 6, 17, 30])}  # f01 to f04
DRIVEN = "voltage = 1\ngate = 2\n[damping]\nquality_factor = 100\n[sweep]\nfrom = 1e6\nto = 1e9\n"


def two(second, **changes):
    """A direct voltage on a disc in the middle, another one on the ring around it."""
    ring = RingRegion(inner_radius=1.2e-6, radius=RADIUS)
    return drum(Gate(BELOW, 5.0, DiscRegion(radius=PATCH)), Gate(250e-9, second, ring), **changes)


def test_states_at_voltages_near_by_follow_from_the_force_of_the_gate_that_changes():
    held = reduce_scene(Scene.from_toml(two(3.0, **HELD).to_toml() + "[drive]\n" + DRIVEN))
    step = 0.05
    near = {"modulus": 300e9}
    up, down = (reduce_scene(two(3.0 + s, **near)) for s in (step, -step))
    found = (up.static["centre_deflection"] - down.static["centre_deflection"]) / (2 * step)
    moved = np.linalg.solve(held.stiffness, 3.0 * held.drive["gate"])
    centre = np.array([held.shapes.at((0.0, 0.0))[r] for r in range(held.size)])
    sums = np.cumsum(moved * centre)
    assert sums[-1] == pytest.approx(float(found), rel=5e-2)
    squares = [(2 * np.pi * m.frequency[0]) ** 2 for m in (up, down)]
    slope = 2 * held.quadratic[0, 0] @ moved - 3.0 * held.parametric["gate"][0, 0]
    assert held.mass[0] * (squares[0] - squares[1]) / (2 * step) == pytest.approx(slope, rel=3e-2)


def test_static_load_cases_find_the_tensors_of_direct_condensation():
    patch = RectangleRegion(position=(-0.2e-6, 0.1e-6), length=0.8e-6, width=0.5e-6)
    film = {"geometry": Rectangle(2e-6, 1.5e-6), "modulus": 300e9}
    film["accuracy"] = Accuracy(degree=4, mesh_size=0.4e-6)
    scene = drum(Gate(150e-9, 6.0, patch), **film)
    direct, step = reduce_scene(scene), reduce_scene(scene.with_(method="step"))
    # of what is no polynomial of the amplitude, steps leave some
    assert step.quadratic == pytest.approx(direct.quadratic, rel=1e-4)
    assert step.cubic == pytest.approx(direct.cubic, rel=1e-4)


def test_gates_of_one_voltage_that_tile_a_film_are_one_gate():
    ring = RingRegion(inner_radius=PATCH, radius=RADIUS)
    tiled = reduce_scene(
        drum(Gate(BELOW, 4.0, DiscRegion(radius=PATCH)), Gate(BELOW, 4.0, ring), modulus=300e9)
    )
    whole = reduce_scene(drum(modulus=300e9, load=Load(voltage=4.0, gap=BELOW)))
    assert tiled.frequency == pytest.approx(whole.frequency, rel=1e-8)
    assert tiled.cubic == pytest.approx(whole.cubic, rel=1e-6)


def test_scene_with_gates_is_read_as_it_was_written():
    patches = (
        RectangleRegion(position=(0.5e-6, 0.0), length=0.2e-6, width=0.3e-6),
        PolygonRegion(points=[(0, 0), (0.2e-6, 0), (0, 0.2e-6)]),
        DiscRegion(position=(-0.8e-6, 0.0), radius=0.1e-6),
    )
    scene = drum(*(Gate(BELOW, i, patch) for i, patch in enumerate(patches)), Gate(ABOVE))
    assert Scene.from_toml(scene.to_toml()) == scene


HEAD = drum().to_toml()
DISC = 'patch = { shape = "disc", radius = "1 um" }'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("gap = 0", "load.gate.gap: found 0; allowed: other than 0"),
        (f"gap = 1e-7\n{DISC.replace('1 um', '-1 um')}", "load.gate.patch.radius: found"),
        (f"gap = 1e-7\n{DISC.replace('1 um', '3 um')}", "load.gate: found number 1, a disc that"),
        (f"gap = 1e-7\n{DISC.replace('disc', 'disk')}", "load.gate.patch.shape: found 'disk'"),
        ("gap = 1e-7\npatch = { radius = 1 }", "load.gate.patch.shape: missing"),
        (f"gap = 1e-7\n{DISC[:-2]}, thickness = 1e-9 }}", "load.gate.patch.thickness: found"),
        ("voltage = 1", "load.gate.gap: missing"),
        (f"gap = 1e-7\n{DISC}\n[[load.gate]]\ngap = 2e-7", "load.gate: found 1 and 2 on one anot"),
        ('gap = 1e-7\npatch = { shape = "surface", surface = "x" }', "load.gate.patch: found surf"),
    ],
)
def test_bad_gates_are_one_line_before_anything_runs(text, message):
    with pytest.raises(SceneError, match=message.replace("[", r"\[")) as error:
        Scene.from_toml(f"{HEAD}\n[[load.gate]]\n{text}\n")
    assert "\n" not in str(error.value)


def test_gates_beside_what_does_not_go_with_them_are_told():
    with pytest.raises(SceneError, match="load.gate: found beside load.voltage"):
        Load(voltage=1.0, gap=1e-7, gates=Gate(1e-7))
    with pytest.raises(SceneError, match=r"drive.gate: found 2; allowed: 1 to 1"):
        Scene.from_toml(f"{HEAD}\n[[load.gate]]\ngap = 1e-7\n[drive]\n{DRIVEN}")
    with pytest.raises(SceneError, match="drive.gate: not used with"):
        Drive(direct=1.0, gate=1)
