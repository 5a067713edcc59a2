"""The reduced model: its forces derive from its energy, and arrays that do not fit are refused."""

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import eigh

from nanorom.errors import ModelError
from nanorom.rom.model import ReducedModel
from nanorom.scene.excitation import Damping

DIFFERENCE = 1e-11  # relative; the five-point formula is exact up to fourth degree
ROUND_OFF = 1e-12

models = st.tuples(st.integers(1, 5), st.integers(0, 2**32 - 1))
amplitudes = st.integers(0, 2**32 - 1)


def sample(seed, shape):
    return np.random.default_rng(seed).uniform(-2e-8, 2e-8, shape)


def slope(function, q, step=1e-8):
    """Five-point differences of a function along every mode, as the last axis."""
    return np.stack(
        [
            (8 * (function(q + e) - function(q - e)) - function(q + 2 * e) + function(q - 2 * e))
            / (12 * step)
            for e in step * np.eye(q.shape[-1])
        ],
        axis=-1,
    )


def close(a, b, tolerance):
    return np.abs(a - b).max() <= tolerance * np.abs(b).max()


@given(models, amplitudes)
def test_force_is_the_gradient_of_the_energy(make_model, model, seed):
    model = make_model(*model)
    q = sample(seed, (4, model.size))
    assert close(slope(model.energy, q), model.forces(q), DIFFERENCE)


@given(models, amplitudes)
def test_jacobian_is_the_derivative_of_the_force(make_model, model, seed):
    model = make_model(*model)
    q = sample(seed, (4, model.size))
    assert close(slope(model.forces, q), model.jacobian(q), DIFFERENCE)


def test_force_is_the_sum_that_defines_the_tensors(make_model):
    model = make_model(3, 1)
    q = sample(2, 3)
    expected = [
        sum(model.stiffness[r, j] * q[j] for j in range(3))
        + sum(model.quadratic[r, j, k] * q[j] * q[k] for j in range(3) for k in range(3))
        + sum(
            model.cubic[r, j, k, l] * q[j] * q[k] * q[l]
            for j in range(3)
            for k in range(3)
            for l in range(3)
        )
        for r in range(3)
    ]
    assert np.allclose(model.forces(q), expected, rtol=ROUND_OFF, atol=0)


def test_forces_are_those_of_the_equations_that_are_followed(make_model):
    model = make_model(3, 1)
    curved = attrs.evolve(model, outside_cubic=-0.3 * model.cubic)
    alone = attrs.evolve(model, cubic=curved.system(damped=False).cubic)
    q = sample(2, 3)
    for told in ("forces", "energy", "jacobian"):
        found, expected = getattr(curved, told), getattr(alone, told)
        assert np.allclose(found(q), expected(q), rtol=ROUND_OFF, atol=0)
        still = found(q, outside=False)
        assert np.array_equal(still, getattr(model, told)(q))
        assert not np.allclose(still, found(q), rtol=1e-3, atol=0)


def test_functions_are_vectorised_over_leading_axes(make_model):
    model = make_model(3)
    q = sample(3, (2, 5, 3))
    for function, shape in [
        (model.forces, (2, 5, 3)),
        (model.nonlinear_forces, (2, 5, 3)),
        (model.jacobian, (2, 5, 3, 3)),
        (model.energy, (2, 5)),
    ]:
        values = function(q)
        assert values.shape == shape
        assert np.allclose(values[1, 4], function(q[1, 4]), rtol=ROUND_OFF, atol=0)
    with pytest.raises(ModelError, match="the last axis is the 3 modes"):
        model.forces(q[..., :2])


@given(models, amplitudes)
def test_paper_coefficients_give_the_force_of_the_papers_sum(make_model, model, seed):
    model = make_model(*model)
    q = sample(seed, model.size)
    force, magnitude = np.zeros(model.size), 0.0
    for r, indices, value in model.coefficients():
        term = value * np.prod([q[i - 1] for i in indices])
        force[r - 1] += term
        magnitude += abs(term)
    assert np.abs(force - model.nonlinear_forces(q)).max() <= ROUND_OFF * magnitude


def test_paper_coefficients_carry_the_multiplicity(make_model):
    model = make_model(3)
    b = model.b(2)
    assert b[1, 1, 1] == model.cubic[1, 0, 0, 0]
    assert b[1, 1, 2] == 3 * model.cubic[1, 0, 0, 1]
    assert b[1, 2, 3] == 6 * model.cubic[1, 0, 1, 2]
    assert model.alpha(3)[1, 2] == 2 * model.quadratic[2, 0, 1]
    # of a potential: b112 of equation 1 is three times b111 of equation 2
    assert model.b(1)[1, 1, 2] == pytest.approx(3 * model.b(2)[1, 1, 1], rel=ROUND_OFF)


def test_paper_coefficients_are_found_in_any_order_and_by_name(make_model):
    model = make_model(3)
    first, second, third = model.label
    assert model.b(2)[3, 1, 1] == model.b(2)[1, 3, 1] == model.b(2)[1, 1, 3]
    assert model.b(second)[third, first, first] == model.b(2)[1, 1, 3]
    assert model.alpha(second)[2, first] == model.alpha(2)[1, 2]
    assert list(model.alpha(1)) == [(1, 1), (1, 2), (1, 3), (2, 2), (2, 3), (3, 3)]
    for wrong, message in [
        (lambda: model.b("f99"), "equation: found 'f99'; allowed: 1 to 3, or f0é"),
        (lambda: model.b(4), "equation: found 4; allowed: 1 to 3"),
        (lambda: model.b(0), "equation: found 0; allowed"),
        (lambda: model.b(1)[1, 1, 4], "coefficient: found 4; allowed: 1 to 3"),
        (lambda: model.b(1)[1, 1], r"coefficient: found \(1, 1\); allowed: 3 modes"),
        (lambda: model.alpha(1)["f0é"], "coefficient: found 'f0é'; allowed: 2 modes"),
    ]:
        with pytest.raises(ModelError, match=message):
            wrong()


def test_tensors_are_made_symmetric_in_the_indices_of_the_amplitudes(make_model):
    cubic = np.zeros((2, 2, 2, 2))
    cubic[0, 0, 0, 1] = 6.0
    model = make_model(2, cubic=cubic)
    assert model.cubic[0, 0, 0, 1] == model.cubic[0, 0, 1, 0] == model.cubic[0, 1, 0, 0] == 2.0
    assert model.asymmetry == 1.0


def test_selected_modes_keep_their_forces(make_model):
    model = make_model(4)
    part = model.select([4, 2])
    assert part.number.tolist() == [2, 4]
    assert part.label == (model.label[1], model.label[3])
    q = sample(5, 2)
    whole = np.array([0.0, q[0], 0.0, q[1]])
    assert np.allclose(part.forces(q), model.forces(whole)[[1, 3]], rtol=ROUND_OFF)
    assert np.array_equal(part.shapes.values, model.shapes.values[[1, 3]])
    assert np.array_equal(part.parametric["tension"], model.parametric["tension"][1::2, 1::2])
    assert model.select([model.label[2]]).number.tolist() == [3]
    with pytest.raises(ModelError, match="mode 7: not in the model; it has 1, 2, 3, 4"):
        model.select([7])


def test_damping_from_quality_factors_gives_the_width_of_each_resonance(make_model):
    model = make_model(2).with_damping(Damping([100, 200]))
    omega = 2 * np.pi * model.frequency
    assert np.allclose(np.diag(model.damping), model.mass * omega / [100, 200], rtol=ROUND_OFF)
    assert model.damping[0, 1] == 0


def test_papers_parametric_pattern_is_the_diagonal_of_the_force_map(make_model):
    model = make_model(3)
    j, p = model.patterns("pressure", "paper")
    assert np.array_equal(p, np.diag(j))
    with pytest.raises(ModelError, match="no pattern 'laser'; it has pressure"):
        model.patterns("laser")


def test_modal_system_has_the_arrays_of_the_model(make_model):
    model = make_model(2)
    system = model.system()
    assert np.array_equal(system.mass, np.diag(model.mass))
    assert np.array_equal(system.stiffness, model.stiffness)
    assert np.array_equal(system.cubic, model.cubic)
    assert np.array_equal(system.direct, model.drive["pressure"])
    assert np.array_equal(system.parametric, model.parametric["tension"])


def test_arrays_cannot_be_changed_in_place(make_model):
    with pytest.raises(ValueError, match="read-only"):
        make_model(2).stiffness[0, 0] = 1.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mass": [1.0, 1.0, 1.0]}, "mass: found shape"),
        ({"mass": [1.0, -1.0]}, "not greater than 0"),
        ({"frequency": [2.0, 1.0]}, "frequency: not sorted"),
        ({"frequency": []}, "no modes"),
        ({"label": ["f01"]}, "label: found 1 names for 2 modes"),
        ({"number": [1, 1]}, "number: "),
        ({"number": [0, 1]}, "number: "),
        ({"stiffness": [[1.0, 0.5], [0.0, 1.0]]}, "stiffness: the matrix is not symmetric"),
        ({"damping": np.full((2, 2), np.nan)}, "damping: contains NaN"),
        ({"quadratic": np.zeros((2, 2))}, "quadratic: found shape"),
        ({"cubic": np.full((2,) * 4, np.inf)}, "cubic: contains NaN or infinite"),
        ({"drive": {"pressure": [1.0]}}, "drive/pressure: found shape"),
        ({"parametric": {"tension": np.zeros(2)}}, "parametric/tension: found shape"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(make_model, changes, message):
    with pytest.raises(ModelError, match=message):
        make_model(2, **changes)


def test_model_of_one_duffing_mode_has_its_closed_form_energy():
    model = ReducedModel(
        frequency=[1 / (2 * np.pi)],
        mass=[1.0],
        label=["f01"],
        number=[1],
        stiffness=[[2.0]],
        damping=[[0.1]],
        quadratic=[[[3.0]]],
        cubic=[[[[4.0]]]],
    )
    q = np.array([0.5])
    assert model.energy(q) == 2 * 0.25 / 2 + 3 * 0.125 / 3 + 4 * 0.0625 / 4
    assert model.forces(q)[0] == 2 * 0.5 + 3 * 0.25 + 4 * 0.125
    assert model.jacobian(q)[0, 0] == 2 + 6 * 0.5 + 12 * 0.25


def test_viscous_material_needs_a_model_that_knows_its_stretching(make_model):
    model = make_model(2)
    viscous = Damping(100, material_time="1 ns")
    with pytest.raises(ModelError, match="material_time.*bending and stretching"):
        model.with_damping(viscous)
    known = make_model(2, bending=np.eye(2), stretching=model.cubic)
    damped = known.with_damping(viscous)
    plain = known.with_damping(Damping(100))
    assert np.allclose(damped.damping - plain.damping, 1e-9 * np.eye(2))
    assert np.allclose(damped.select([2]).system().cubic_damping, 1e-9 * model.cubic[1, 1, 1, 1])
    assert not damped.with_damping(Damping(100)).system().cubic_damping.any()


def test_mass_responsivity_is_the_slope_of_frequencies_by_a_mass(make_model):
    model = make_model(3, 4)
    place = (0.2e-6, 0.3e-6)
    phi = model.shapes.at(place)
    diagonal = np.diag(model.mass) * (2 * np.pi * model.frequency) ** 2

    def frequencies(mass):
        whole = np.diag(model.mass) + mass * np.outer(phi, phi)
        return np.sqrt(eigh(diagonal, whole, eigvals_only=True)) / (2 * np.pi)

    step = 1e-5 * model.mass.min()
    slopes = (frequencies(step) - frequencies(-step)) / (2 * step)
    order = np.argsort(model.frequency)
    assert close(model.mass_responsivity(place)[order], slopes, 1e-6)
    with pytest.raises(ModelError, match="keeps none"):
        attrs.evolve(model, shapes=None).mass_responsivity(place)
