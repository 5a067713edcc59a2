"""An alternating voltage on the gate: its force and its softening, from the scene to a response."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import nanorom
from nanorom.errors import ModelError, SceneError
from nanorom.fem.reduce import reduce_scene
from nanorom.rom.patterns import driven
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Damping, Sweep
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Disc
from nanorom.scene.load import VACUUM_PERMITTIVITY, Load
from nanorom.scene.material import Material
from nanorom.scene.scene import Accuracy, Modes, Scene

GAP, THICKNESS, DENSITY = 300e-9, 2e-9, 2500.0
QUALITY = 200.0


def drum(voltage, count=1, tolerance=1e-6, **changes):
    parts = {
        "geometry": Disc(radius=2e-6),
        "plate": Plate(thickness=THICKNESS, model="membrane"),
        "material": Material(youngs_modulus="300 GPa", poisson_ratio=0.2, density=DENSITY),
        "tension": Tension.isotropic(0.1),
        "modes": Modes(count=count),
        "load": Load(voltage=voltage, gap=GAP),
        "accuracy": Accuracy(tolerance=tolerance),
    }
    return Scene(**parts | changes)


@pytest.fixture(scope="module")
def flat():
    return reduce_scene(drum(0.0))


@pytest.fixture(scope="module")
def held():
    """About 4 V, by its four lowest round modes: f01 to f04."""
    return reduce_scene(drum(4.0, modes=Modes(select=[1, 6, 15, 30])))


def test_film_at_rest_has_the_forces_of_a_plane_condenser(flat):
    force = VACUUM_PERMITTIVITY / GAP**2 * flat.drive["pressure"]
    assert flat.drive["gate"] == pytest.approx(force, rel=1e-9)
    softening = 2 * VACUUM_PERMITTIVITY / GAP**3 * flat.mass / (DENSITY * THICKNESS)
    assert np.diag(flat.parametric["gate"]) == pytest.approx(softening, rel=1e-8)


def test_frequency_at_a_voltage_near_by_follows_from_force_softening_and_tensors(held):
    """k'(V) = -V P + 2 A q'(V), q' = K^-1 J V: finite differences of whole static states."""
    step = 0.05
    up, down = (reduce_scene(drum(4.0 + s, tolerance=1e-8, count=1)) for s in (step, -step))
    squares = [(2 * np.pi * m.frequency[0]) ** 2 * m.mass[0] for m in (up, down)]
    masses = (up.mass[0] - down.mass[0]) / (2 * step)
    found = (squares[0] - squares[1]) / (2 * step)
    moved = np.linalg.solve(held.stiffness, 4.0 * held.drive["gate"])
    slope = 2 * held.quadratic[0, 0] @ moved - 4.0 * held.parametric["gate"][0, 0]
    # the shape changes, too: its stiffness by the square, its mass as the scale of max |phi| does
    omega = (2 * np.pi * held.frequency[0]) ** 2
    assert found - omega * masses == pytest.approx(slope, rel=2e-2)


def test_static_deflection_at_a_voltage_near_by_follows_from_the_force(held):
    step = 0.02
    up, down = (reduce_scene(drum(4.0 + s, tolerance=1e-8)) for s in (step, -step))
    found = (up.static["centre_deflection"] - down.static["centre_deflection"]) / (2 * step)
    moved = np.linalg.solve(held.stiffness, 4.0 * held.drive["gate"])
    centre = np.array([held.shapes.at((0.0, 0.0))[r] for r in range(held.size)])
    *_, three, four = np.cumsum(moved * centre)  # of an alternating series
    assert four < found < three
    assert (three + four) / 2 == pytest.approx(float(found), rel=5e-3)


def integrated(system_of, omega, periods=600):
    """Largest |q| of one mode in its last periods, by Runge-Kutta on the whole voltage squared."""
    m, c, k, a, b, j, p, direct, alternating = system_of

    def rhs(t, y):
        square = ((direct + alternating * np.cos(omega * t)) ** 2 - direct**2) / 2
        q, v = y
        force = square * (j + p * q) - c * v - k * q - a * q**2 - b * q**3
        return [v, force / m]

    period = 2 * np.pi / omega
    t = np.linspace((periods - 4) * period, periods * period, 4000)
    found = solve_ivp(rhs, (0, t[-1]), [0, 0], "DOP853", t, rtol=1e-10, atol=1e-10)
    return np.abs(found.y[0]).max()


@pytest.mark.parametrize(("direct", "alternating", "at"), [(4.0, 0.01, 0.99), (0.0, 0.5, 0.5)])
def test_response_is_that_of_the_square_of_the_voltage(flat, direct, alternating, at):
    """At rest the film answers at half its frequency, under a constant voltage at its own."""
    model = flat if direct == 0 else reduce_scene(drum(direct))
    drive, sweep = Drive(voltage=[alternating / 2, alternating]), Sweep("0.45 f1", "1.05 f1")
    if direct:
        sweep = Sweep("0.97 f1", "1.03 f1")
    response = nanorom.respond(model, drive, sweep, Damping(QUALITY), processes=1)
    model = model.with_damping(Damping(QUALITY))
    omega = at * 2 * np.pi * model.frequency[0]
    branch = response.diagrams[1].branches[0]
    order = np.argsort(branch.omega)
    found = np.interp(omega, branch.omega[order], branch.amplitude[order, 0])
    unit = 1e-9  # of length: the integrator's tolerance is absolute, too
    parts = [
        model.mass[0],
        model.damping[0, 0],
        model.stiffness[0, 0],
        model.quadratic[0, 0, 0] * unit,
        model.cubic_of()[0, 0, 0, 0] * unit**2,
        model.drive["gate"][0] / unit,
        model.parametric["gate"][0, 0],
        direct,
        alternating,
    ]
    time = np.sqrt(parts[0] / parts[2])
    exact = integrated(
        [1.0, parts[1] / parts[0] * time, 1.0, *(x / parts[2] for x in parts[3:7]), *parts[7:]],
        omega * time,
    )
    assert found / unit == pytest.approx(exact, rel=2e-3)  # between points of the branch


def test_voltages_survive_the_file_and_what_stands_beside_them_is_refused():
    drive = Drive(voltage=["10 mV", "20 mV"])
    assert drive.levels == ((0.01, 0.01), (0.02, 0.02))
    scene = drum(1.0, drive=drive, sweep=Sweep("0.9 f1", "1.1 f1"), damping=Damping(100))
    assert Scene.from_toml(scene.to_toml()) == scene
    with pytest.raises(SceneError, match=r"^drive\.direct: found beside drive\.voltage"):
        Drive(voltage=0.1, direct=1.0)
    with pytest.raises(SceneError, match=r"^drive\.voltage: missing"):
        Drive(direct=0.1, direct_pattern="gate")
    with pytest.raises(SceneError, match=r"^drive\.voltage: found -1\.0?; allowed: 0 or more"):
        Drive(voltage=-1.0)
    with pytest.raises(SceneError, match=r"^drive\.voltage: found without a gate"):
        drum(1.0, load=None, drive=drive, sweep=Sweep("0.9 f1", "1.1 f1"), damping=Damping(100))


def test_model_without_a_gate_refuses_a_voltage(make_model):
    with pytest.raises(ModelError, match=r"^drive\.voltage: the film has no gate"):
        driven(make_model(), Drive(voltage=0.1))
