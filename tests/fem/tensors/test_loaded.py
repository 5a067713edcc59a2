"""Films about static states: against a spectral reference, and one route against the other."""

import numpy as np
import pytest

from nanorom.fem.models import coupled
from nanorom.fem.modes import coupled as coupled_modes
from nanorom.fem.modes.normal import normalise
from nanorom.fem.statics import loads, path
from nanorom.fem.tensors import loaded as loadeds
from nanorom.fem.tensors import step as stiffness_evaluation
from nanorom.fem.tensors.loaded_cases import static_cases
from tests.fem.drums import NU, centre, drum
from tests.fem.radial import Disc

SPECTRAL = 1e-5  # asked of centre deflection and frequencies
ROUTES = 1e-7  # direct against STEP: round-off over the amplitude
POTENTIAL = 1e-6  # asymmetry of the tensors


@pytest.mark.parametrize("bending, radii", [(0.0, (0.5, 1.0)), (0.01, (0.4, 0.7, 0.9, 1.0))])
def test_pressurised_drum_matches_spectral_reference(bending, radii):
    plate = drum(bending, radii=radii)
    state = coupled.Film(plate)
    load = loads.pressure(state)
    reference = Disc(1.0, bending, NU)
    for point in path.load_steps(loads.problem(state, load), [100.0, 1000.0]):
        assert point.stable
        reference.solve(point.magnitude)
        assert centre(plate, state) == pytest.approx(reference.centre(), rel=SPECTRAL)
        modes = coupled_modes.solve(state.about(load.attraction(point.magnitude)), 4)
        exact = np.concatenate(
            [reference.eigenvalues(0, 2), *2 * [reference.eigenvalues(1, 1)]]
            + 2 * [reference.eigenvalues(2, 1)]
        )
        exact = np.sort(exact)[:4]
        assert np.sqrt(modes.eigenvalues[:4]) == pytest.approx(np.sqrt(exact), rel=SPECTRAL)


def loaded_modes(plate, load_of, magnitude, count):
    """Oriented, scaled modes about the state under a load."""
    state = coupled.Film(plate)
    load = load_of(state)
    for _ in path.load_steps(loads.problem(state, load), [magnitude]):
        modes = coupled_modes.solve(state.about(load.attraction(magnitude)), count)
        return normalise(modes.take(np.arange(count)))


LOADS = {
    "pressure": (loads.pressure, 20.0),
    "gate": (lambda state: loads.gate(state, 2.0), 6.0),
    "point": (lambda state: loads.patch(state, np.array([0.3, 0.2]), 0.0), 2.0),
}


@pytest.mark.parametrize("kind", LOADS)
def test_direct_and_step_agree_about_a_loaded_state(kind):
    plate = drum(0.05, degree=5, mirrors=())
    load_of, magnitude = LOADS[kind]
    modes = loaded_modes(plate, load_of, magnitude, 3)
    direct = loadeds.tensors(modes)
    amplitude = 1e-2 if kind == "gate" else 0.1
    result = stiffness_evaluation.step(static_cases(modes.take(np.arange(3))), amplitude)
    # the force of a gate is no polynomial: STEP truncates it
    tolerance = 1e-4 if kind == "gate" else ROUTES
    assert result.quadratic == pytest.approx(
        direct.quadratic, abs=tolerance * np.abs(direct.quadratic).max()
    )
    assert result.cubic == pytest.approx(direct.cubic, abs=tolerance * np.abs(direct.cubic).max())
    assert result.asymmetry < (1e-4 if kind == "gate" else POTENTIAL)


def test_gate_tunes_the_drum_as_the_spectral_reference():
    """Softening by the attraction, stiffening by stretching; up to close to pull-in."""
    gap = 3.0
    plate = drum(0.0)
    state = coupled.Film(plate)
    load = loads.gate(state, gap)
    reference = Disc(1.0, 0.0, NU)
    problem = loads.problem(state, load)
    frequency = []
    for point in path.load_steps(problem, [4.0, 40.0, 90.0]):
        reference.solve(gap=gap, voltage2=point.magnitude)
        assert centre(plate, state) == pytest.approx(reference.centre(), rel=SPECTRAL)
        modes = coupled_modes.solve(state.about(load.attraction(point.magnitude)), 1)
        assert modes.eigenvalues[0] == pytest.approx(reference.eigenvalues(0, 1)[0], rel=SPECTRAL)
        frequency.append(np.sqrt(modes.eigenvalues[0]))
    flat = 2.404825557695773  # first zero of J0
    assert frequency[0] < flat < frequency[1] < frequency[2]


def test_pull_in_of_a_stiff_membrane_is_the_literature_value():
    """V^2 R^2/(2 T g^3) = 0.7892 (Pelesko and Bernstein 2002), between two lumped estimates.

    Where stretching is negligible the deflection is that of nabla^2 u = lambda/(1 - u)^2.  A lumped
    spring with the mean deflection's stiffness 8 T/R^2 gives 32/27, with the centre's 4 T/R^2
    16/27: the plates are not parallel, the centre is pulled more strongly than the mean.
    """
    gap = 1e-3
    plate = drum(0.0)
    state = coupled.Film(plate)
    load = loads.gate(state, gap)
    scale = 2 * gap**3
    problem = loads.problem(state, load)
    found = path.limit_point(problem, 0.2 * scale).magnitude / scale
    assert 16 / 27 < found < 32 / 27
    assert found == pytest.approx(0.7892, abs=1e-4)


def test_refinement_of_a_loaded_plate_converges_at_its_order():
    """Eigenvalues about a pressurised state: order 2 (k - 1) of C0 interior penalty, k = 3."""
    reference = Disc(1.0, 0.05, NU)
    reference.solve(20.0)
    exact = reference.eigenvalues(0, 1)[0]
    errors = []
    for rings in (2, 4, 8):
        radii = np.arange(1, rings + 1) / rings
        plate = drum(0.05, degree=3, radii=radii, sectors=8 * rings)
        state = coupled.Film(plate)
        load = loads.pressure(state)
        for point in path.load_steps(loads.problem(state, load), [20.0]):
            modes = coupled_modes.solve(state.about(load.attraction(point.magnitude)), 1)
        errors.append(abs(modes.eigenvalues[0] / exact - 1))
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert 3.3 < rates[-1] < 5.5
