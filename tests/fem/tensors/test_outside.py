"""What lies outside the modes adds to the cubic force what static states of the whole film take.

Checked against nonlinear static states, against models with more modes, and between plate and
shell.
"""

import attrs
import numpy as np
import pytest

from nanorom.fem.models import coupled
from nanorom.fem.modes import coupled as coupled_modes
from nanorom.fem.modes.normal import normalise
from nanorom.fem.reduce import reduce_scene
from nanorom.fem.solvers import algebra
from nanorom.fem.statics import loads, path
from nanorom.fem.tensors import loaded
from nanorom.rom.model import ReducedModel
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Rectangle
from nanorom.scene.load import Load
from nanorom.scene.material import Material
from nanorom.scene.scene import Accuracy, Modes, Reduction, Scene
from nanorom.scene.support import Support
from tests.fem.drums import drum
from tests.fem.routes.test_loaded_scenes import drum as drum_scene

AMPLITUDES = 0.04, 0.02  # of the first mode, in the film's unit of deflection
THIRD_ORDER = 3e-4  # of the cubic term: what is left of the fifth order, extrapolated
FEWER_MODES = 1e-3  # two meshes, each made for 1e-4 of frequencies and of the cubic tensor
SHALLOW = 3e-3  # shell against plate: (rise / half the length)^2 = 0.01 changes both parts alike
LOADS = {
    "pressure": (loads.pressure, 20.0),
    "gate": (lambda film: loads.gate(film, 2.0), 6.0),
}


@pytest.mark.parametrize("kind", LOADS)
def test_one_mode_with_the_rest_static_has_the_third_order_of_the_whole_film(kind):
    plate = drum(0.05, degree=5)
    film = coupled.Film(plate)
    load_of, magnitude = LOADS[kind]
    load = load_of(film)
    for _ in path.load_steps(loads.problem(film, load), [magnitude]):
        pass
    about = film.about(load.attraction(magnitude))
    modes = normalise(coupled_modes.solve(about, 1).take(np.arange(1)))
    found = loaded.tensors(modes, outside=True)
    stiffness = float((modes.modal_stiffness() + found.stretching)[0, 0])
    quadratic, rest = float(found.quadratic[0, 0, 0]), film.deflection()
    inertia = algebra.multiply(modes.mass, modes.shapes)[:, 0]
    share = inertia @ modes.shapes[:, 0]
    mass = plate.mirrors.copies * share
    base, estimates = film.state.x.array.copy(), []
    for amplitude in AMPLITUDES:
        cubic = []
        for sign in (1, -1):
            force = sign * amplitude * stiffness  # of a load proportional to the mode's inertia
            nodal = film.deflections_to_state(force / mass * inertia)
            whole = attrs.evolve(load, form=magnitude * load.form, nodal=nodal)
            film.state.x.array[:] = base
            loads.problem(film, whole).solve(1.0)
            q = inertia @ (film.deflection() - rest) / share
            cubic.append((force - stiffness * q - quadratic * q**2) / q**3)
        estimates.append(np.mean(cubic))
    expected = (4 * estimates[1] - estimates[0]) / 3
    assert found.outside is not None
    own, added = float(found.cubic[0, 0, 0, 0]), float(found.outside.cubic[0, 0, 0, 0])
    assert own + added == pytest.approx(expected, abs=THIRD_ORDER * abs(own))
    assert abs(added) > 5 * THIRD_ORDER * abs(own)  # or nothing were shown


def test_fewer_modes_with_the_rest_static_are_those_of_more_modes(tmp_path):
    given = {"load": Load(pressure=5e4), "accuracy": Accuracy(tolerance=1e-4)}
    one, six = (reduce_scene(drum_scene(modes=Modes(n), **given)) for n in (1, 6))
    assert six.outside_cubic is not None
    unit = one.cubic[0, 0, 0, 0]
    fewer = six.select([1])
    assert fewer.outside_cubic == pytest.approx(one.outside_cubic, abs=FEWER_MODES * unit)
    assert np.abs(fewer.outside_cubic - six.outside_cubic[0, 0, 0, 0]) > 0.01 * unit
    # in the file, and in the equations unless they are asked for without it
    six.save(tmp_path / "rom.h5")
    read = ReducedModel.load(tmp_path / "rom.h5")
    assert np.array_equal(read.outside_cubic, six.outside_cubic)
    bare, whole = (read.system(damped=False, outside=outside).cubic for outside in (False, True))
    assert np.array_equal(bare, six.cubic)
    assert whole == pytest.approx(six.cubic + six.outside_cubic)
    # at rest, if the scene says so
    at_rest = drum_scene(modes=Modes(1), reduction=Reduction(outside="rest"), **given)
    assert reduce_scene(at_rest).outside_cubic is None


def arc(directory, model):
    """A shallow shell between two pinned straight edges."""
    length, width, sagitta = 2.0, 1.0, 0.1
    radius = (length**2 / 4 + sagitta**2) / (2 * sagitta)
    x, y = (
        a.ravel()
        for a in np.meshgrid(np.linspace(-1.001, 1.001, 201), np.linspace(-0.501, 0.501, 11))
    )
    file = directory / "arc.csv"
    height = np.sqrt(radius**2 - x**2) - (radius - sagitta)
    np.savetxt(file, np.column_stack([x, y, height]), delimiter=",")
    held = {"left": "simply_supported", "right": "simply_supported"}
    return Scene(
        geometry=Rectangle(length, width),
        plate=Plate(0.01, model, file),
        material=Material(70e9, 0.33, 2700),
        tension=Tension(0.0, 0.0),
        support=Support(held | {"bottom": "free", "top": "free"}),
        modes=Modes(2),
        accuracy=Accuracy(degree=4, mesh_size=0.5),
    )


def test_shell_and_plate_agree_on_what_turns_a_shallow_arc_soft(tmp_path):
    plate, shell = (reduce_scene(arc(tmp_path, model)) for model in ("plate", "shell"))
    for model in (plate, shell):
        assert model.outside_cubic is not None
        # the modes alone make it fourteen times as hard or more: published, it softens
        assert model.cubic_of()[0, 0, 0, 0] < 0.1 * model.cubic[0, 0, 0, 0]
    shares = [model.outside_cubic[0, 0, 0, 0] / model.cubic[0, 0, 0, 0] for model in (plate, shell)]
    assert shares[1] == pytest.approx(shares[0], rel=SHALLOW)
