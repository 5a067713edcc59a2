"""Films about static states: against a spectral reference, and one route against the other."""

import sys
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from nanorom.fem import discretisation, film, loaded, mesh, statics
from nanorom.fem import step as stiffness_evaluation
from nanorom.fem.plate import Plate
from nanorom.fem.shapes import normalise
from nanorom.fem.symmetry import Mirrors

sys.path.insert(0, str(Path(__file__).parent))
from radial import Disc  # noqa: E402

SPECTRAL = 1e-5  # asked of centre deflection and frequencies
ROUTES = 1e-7  # direct against STEP: round-off over the amplitude
POTENTIAL = 1e-6  # asymmetry of the tensors
NU = 0.16


def drum(bending, degree=8, size=0.5, layer=0.0, mirrors=("x", "y"), nu=NU):
    chosen = discretisation._disc(degree, degree, size, layer, Mirrors(mirrors))
    domain = mesh.build(
        MPI.COMM_WORLD, chosen.file, chosen.parameters, chosen.order, chosen.grading
    )
    plate = Plate(domain, degree, ["edge"], [], bending > 0, Mirrors(mirrors))
    plate.tension_x.value = plate.tension_y.value = 1.0
    plate.bending_stiffness.value = bending
    plate.nu.value = nu
    return plate


def centre(plate, state):
    return film.evaluate(plate, state.deflection(), np.zeros((1, 2)))[0]


@pytest.mark.parametrize("bending, layer", [(0.0, 0.0), (0.01, 0.1)])
def test_pressurised_drum_matches_spectral_reference(bending, layer):
    plate = drum(bending, layer=layer)
    state = film.Film(plate)
    load = film.pressure(state)
    reference = Disc(1.0, bending, NU)
    for point in statics.load_steps(film.problem(state, load), [1.0, 100.0, 1000.0]):
        assert point.stable
        reference.solve(point.magnitude)
        assert centre(plate, state) == pytest.approx(reference.centre(), rel=SPECTRAL)
        modes = loaded.solve(state.about(load, point.magnitude), 4)
        exact = np.concatenate(
            [reference.eigenvalues(0, 2), *2 * [reference.eigenvalues(1, 1)]]
            + 2 * [reference.eigenvalues(2, 1)]
        )
        exact = np.sort(exact)[:4]
        assert np.sqrt(modes.eigenvalues[:4]) == pytest.approx(np.sqrt(exact), rel=SPECTRAL)
