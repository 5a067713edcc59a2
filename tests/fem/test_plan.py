"""What a plan skips makes no difference; what is in doubt is computed."""

import random
import re

import attrs
import numpy as np
import pytest
import ufl
from ffcx.codegeneration import jit

from nanorom.fem.mesh.gmsh import MESHES
from nanorom.fem.plan import Plan
from nanorom.fem.reduce import reduce_scene
from nanorom.fem.routes.registry import route_of
from nanorom.fem.solvers import compat
from nanorom.fem.tensors.cases import load_cases
from nanorom.fem.tensors.loaded_cases import StaticCases
from nanorom.fem.tensors.step import coefficients
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Damping, Sweep
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Disc, MeshFile, Rectangle, String
from nanorom.scene.load import Load
from nanorom.scene.material import Material
from nanorom.scene.scene import (
    Accuracy,
    Modes,
    Reduction,
    Scene,
)
from nanorom.scene.support import Edge, Support
from tests.fem.exact import drum, paper_drum
from tests.fem.routes.test_drum import solved_modes

NOISE = 1e-9  # relative, of forces that vanish by symmetry
DRUM_FILE = MeshFile(file=MESHES / "drum.geo", scale=1e-6)
LOPSIDED = Support({"left": "clamped", "right": "simply_supported", "default": "clamped"})


def rectangle(**changes) -> Scene:
    fields = {
        "geometry": Rectangle(length="10 um", width="6 um"),
        "plate": Plate(thickness="10 nm"),
        "material": Material(youngs_modulus="200 GPa", poisson_ratio=0.25, density=2700.0),
        "tension": Tension(x=1.0, y=1.0),
        "modes": Modes(count=3),
        "accuracy": Accuracy(tolerance=1e-4),
    }
    return Scene(**fields | changes)


def test_bending_is_skipped_only_where_it_makes_no_difference():
    scene = drum(1e10, count=4, model="auto", accuracy=Accuracy(tolerance=1e-3))
    scene = scene.with_(in_plane="fixed")  # a film stretched so far has no slow plane to condense
    plan = Plan.of(scene)
    assert not plan.bending
    skipped = reduce_scene(scene)
    full = reduce_scene(attrs.evolve(scene, plate=attrs.evolve(scene.plate, model="plate")))
    effect = np.abs(skipped.frequency / full.frequency - 1).max()
    assert effect < plan.bending_effect < 1e-3
    largest = np.abs(full.cubic).max()
    assert np.abs(skipped.cubic - full.cubic).max() < plan.bending_effect * largest


def test_what_is_skipped_is_counted_in_the_estimate():
    scene = drum(1e10, count=2, model="auto", accuracy=Accuracy(tolerance=1e-3))
    plan = Plan.of(scene)
    found = reduce_scene(scene.with_(in_plane="fixed")).diagnostics
    assert found["error_frequency"] > plan.left_out > 0
    assert found["error_tensor"] > plan.left_out
    exact = attrs.evolve(scene, plate=attrs.evolve(scene.plate, model="membrane"))
    assert Plan.of(exact).left_out == 0  # the scene says so


# Bessel functions: simply supported disc with the tension of 1 N/m less 0.999999
RELAXED = [49.4830, 79.0834]


def test_bending_counts_by_the_tension_that_acts_under_a_load():
    """Almost all of the tension is taken away by the load's stress."""
    scene = Scene(
        geometry=Disc(radius=2e-3),
        plate=Plate(thickness=5e-9),
        material=Material(youngs_modulus=250e9, poisson_ratio=0.23, density=3000.0),
        tension=Tension.isotropic(1.0),
        support=Support("simply_supported"),
        modes=Modes(count=2),
    )
    assert not Plan.of(scene).bending
    loaded = attrs.evolve(scene, load=Load(stress=-199999800.0))
    assert reduce_scene(loaded).frequency == pytest.approx(RELAXED, rel=2e-6)


@pytest.mark.parametrize(
    "changes",
    [
        {"load": Load(pressure=1.0)},
        {"load": Load(voltage=1.0, gap=1e-6)},
        {"support": Support({"left": "clamped", "right": "clamped"})},
        {"support": Support(Edge("simply_supported", in_plane="tangential"))},
        {
            "support": Support(Edge("simply_supported", in_plane="normal")),
            "tension": Tension(1.0, 1.0, 0.1),
        },
    ],
    ids=["pressure", "gate", "free sides", "free normal to the sides", "free along them, sheared"],
)
def test_bending_is_computed_where_only_the_state_tells_what_tension_acts(changes):
    wide = rectangle(plate=Plate(thickness="1e-12 m"), support=Support("simply_supported"))
    assert not Plan.of(wide).bending
    plan = Plan.of(attrs.evolve(wide, **changes))
    assert plan.bending
    assert any("only the static state" in item.why for item in route_of(wide).items(plan))


def test_bending_counts_by_the_least_tension_of_a_sheared_one():
    sheared = rectangle(support=Support("simply_supported"), tension=Tension(1.0, 1.0, 0.999))
    along = rectangle(support=Support("simply_supported"), tension=Tension(0.001, 1.999))
    effects = [Plan.of(scene).bending_effect for scene in (sheared, along)]
    assert effects[0] == pytest.approx(effects[1], rel=1e-9)
    assert Plan.of(sheared).layer == pytest.approx(Plan.of(along).layer, rel=1e-9)
    slack = rectangle(support=Support("simply_supported"), tension=Tension(1.0, 1.0, 1.001))
    assert Plan.of(slack).bending


def test_thinness_alone_does_not_skip_bending():
    scene = drum(1e5, count=4, model="auto")
    assert scene.plate.thickness / scene.geometry.radius < 0.01
    assert Plan.of(scene).bending
    assert Plan.of(attrs.evolve(scene, accuracy=Accuracy(degree=4, mesh_size=1e-6))).bending


def test_flat_film_has_no_quadratic_force_and_needs_half_of_the_pairs():
    """All load cases solved one by one on the whole film give what the skips leave out."""
    scene = attrs.evolve(paper_drum(3), accuracy=Accuracy(degree=4, mesh_size=1.25e-6))
    modes = solved_modes(scene, whole=True)
    cases = list(load_cases(3))
    q = np.zeros((len(modes.parities), len(cases)))
    for column, case in enumerate(cases):
        for mode, sign in case:
            q[mode, column] = 0.5 * sign
    forces = dict(zip(cases, StaticCases(modes).nonlinear_force(q).T[:, :3]))
    quadratic, cubic = coefficients(forces, 3, 0.5)
    assert np.abs(quadratic).max() < NOISE * np.abs(cubic).max()
    for case, force in forces.items():
        opposite = forces.get(tuple((mode, -sign) for mode, sign in case))
        if opposite is not None:
            assert np.abs(force + opposite).max() < NOISE * np.abs(force).max()


def test_modes_outside_the_asked_band_do_not_change_those_inside():
    scene = rectangle()
    three = reduce_scene(scene)
    chosen = reduce_scene(attrs.evolve(scene, modes=Modes(select=[1, 3])))
    assert chosen.frequency == pytest.approx(three.frequency[[0, 2]], rel=1e-12)
    assert chosen.cubic == pytest.approx(three.cubic[np.ix_(*[[0, 2]] * 4)], rel=1e-9)
    assert chosen.number.tolist() == [1, 3]


def test_supports_without_mirror_symmetry_mesh_the_whole_film():
    assert Plan.of(rectangle()).discretisation(1e-4).mirrors.axes == ("x", "y")
    assert Plan.of(rectangle(support=LOPSIDED)).discretisation(1e-4).mirrors.axes == ("y",)


def test_half_and_whole_meshes_give_one_result():
    """A support that breaks the symmetry by its name only: the same film, meshed differently."""
    scene = rectangle(support=Support("simply_supported"))
    quarter = reduce_scene(scene)
    turned = attrs.evolve(
        scene,
        geometry=Rectangle(length=scene.geometry.width, width=scene.geometry.length),
    )
    assert reduce_scene(turned).frequency == pytest.approx(quarter.frequency, rel=1e-6)


def test_tension_across_a_free_edge_relaxes():
    """What is left far from the ends is the uniaxial stress (1 - nu) N."""
    scene = rectangle(
        geometry=String(length="100 um", width="2 um"),
        support=Support({"left": "clamped", "right": "clamped"}),
        tension=Tension.isotropic(1.0),
    )
    nu = scene.material.poisson_ratio
    relaxed = reduce_scene(scene)
    along = attrs.evolve(scene, tension=Tension(x=1.0 - nu, y=0.0))
    assert relaxed.frequency[0] == pytest.approx(reduce_scene(along).frequency[0], rel=0.01)
    assert relaxed.static["mean_tension"] == pytest.approx((1 - nu) / 2, rel=0.03)
    assert not relaxed.static["deflection"].any()


@pytest.mark.parametrize(
    ("scene", "ranks", "memory", "groups"),
    [
        (paper_drum(6), 2, 8e9, 2),
        (paper_drum(6), 6, 8e9, 3),
        (paper_drum(6), 8, 8e9, 4),
        (paper_drum(6), 2, 0.0, 1),
        (attrs.evolve(paper_drum(6), accuracy=Accuracy(degree=4, mesh_size="5 nm")), 2, 8e9, 1),
        (rectangle(support=LOPSIDED), 4, 8e9, 2),
        (attrs.evolve(paper_drum(6), load=Load(force="1 nN", position=("1 um", 0.0))), 4, 8e9, 1),
        (attrs.evolve(paper_drum(6), geometry=DRUM_FILE), 4, 8e9, 1),
    ],
)
def test_ranks_form_groups_where_classes_are_shared_and_meshes_fit(scene, ranks, memory, groups):
    assert route_of(scene).groups(Plan.of(scene), ranks, memory) == groups


def test_plan_says_what_is_skipped_and_why():
    route, plan = route_of(paper_drum()), Plan.of(paper_drum())
    items = {item.what: item for item in route.items(plan)}
    assert items["bending"].computed
    assert not items["quadratic tensor"].computed
    assert not items["three quarters of the film"].computed
    assert all(item.why for item in items.values() if not item.computed)
    assert "degrees of freedom" in route.cost(plan)


def test_what_a_plan_costs_counts_its_static_state():
    flat = rectangle()
    relaxed = rectangle(support=Support({"top": "free", "default": "clamped"}))
    loaded = rectangle(load=Load(pressure="1 kPa"))
    whole = rectangle(support=LOPSIDED)
    seconds = [
        float(re.search(r"about ([\d.]+) s on", route_of(scene).cost(Plan.of(scene)))[1])
        for scene in (flat, whole, relaxed, loaded)
    ]
    assert seconds == sorted(seconds)
    assert seconds[-1] > 3 * seconds[0]


@pytest.mark.parametrize(
    ("load", "told"), [(None, "at most 858"), (Load(pressure="1 kPa"), "at most 1716")]
)
def test_plan_says_that_shells_solve_one_of_the_load_cases_that_mirror_each_other(load, told):
    scene = attrs.evolve(paper_drum(11), plate=Plate("10 nm", "shell"), load=load)
    items = route_of(scene).items(Plan.of(scene))
    (cases,) = [item for item in items if "static solutions" in item.what]
    assert cases.what == f"cubic tensor by step: {told} static solutions"
    assert cases.why.endswith("of load cases that are mirror images one is solved")


def test_new_parameters_compile_no_form(monkeypatch):
    """Tension, E, thickness, density, damping and drive are numbers in forms that there are."""
    scene = rectangle(damping=Damping(100), drive=Drive(["1 Pa"]), sweep=Sweep("0.9 f1", "1.1 f1"))
    reduce_scene(scene)

    def refuse(*_, **__):
        raise AssertionError("a form is compiled")

    monkeypatch.setattr(jit, "_compile_objects", refuse)
    changed = attrs.evolve(
        scene,
        tension=Tension(x=0.5, y=0.8),
        plate=Plate(thickness="30 nm"),
        material=Material(youngs_modulus="70 GPa", poisson_ratio=0.17, density=2200.0),
        damping=Damping(300, material_time="1 us"),
        drive=Drive(["5 Pa"], ["1 mN/m"]),
    )
    assert reduce_scene(changed).frequency[0] != reduce_scene(scene).frequency[0]
    mesh = solved_modes(scene, whole=False).plate.domain.mesh
    with pytest.raises(AssertionError, match="compiled"):  # what a written number would do
        compat.form(random.random() * ufl.Measure("dx", domain=mesh))


@pytest.mark.parametrize(
    "changes",
    [{}, {"load": Load(pressure="1 kPa")}, {"plate": Plate("10 nm", "shell"), "modes": Modes(1)}],
    ids=["flat", "loaded", "shell"],
)
def test_no_more_load_cases_are_solved_than_planned(changes):
    by_hand = Accuracy(degree=4, mesh_size=2e-6)
    scene = attrs.evolve(rectangle(accuracy=by_hand, **changes), reduction=Reduction("step"))
    solved = reduce_scene(scene).diagnostics["load_cases"]
    assert 0 < solved <= route_of(scene).load_cases(Plan.of(scene))[0]
