"""Entries and load cases that symmetry rules out are those that a full computation finds zero."""

from math import comb

import attrs
import numpy as np
import pytest

from nanorom.fem.reduce import reduce_scene
from nanorom.fem.tensors import selection
from nanorom.fem.tensors.cases import load_cases, with_opposites
from nanorom.fem.tensors.step import EXTRAPOLATED
from nanorom.scene.film import Tension
from nanorom.scene.load import Load
from nanorom.scene.scene import Accuracy, Modes, Reduction
from tests.fem.exact import drum, paper_drum

ZERO = 1e-9  # of the largest entry: what a tolerance of 1e-8 leaves of an entry that is zero
SAME = 1e-9  # of the largest entry: two computations of one tensor
TOLERANCE = Accuracy(tolerance=1e-8)
ZERO_LOADED, LOADED = 1e-6, Accuracy(tolerance=1e-5)  # the same of a drum under a load


def without_rules(monkeypatch):
    def everything(modes, rank):
        return np.ones((len(modes.parities),) * rank, dtype=bool)

    monkeypatch.setattr(selection, "permitted", everything)


def test_entries_zero_on_a_body_of_revolution_are_zero_in_the_full_tensor(monkeypatch):
    scene = drum(100.0, count=11, accuracy=TOLERANCE)
    ruled = reduce_scene(scene).cubic
    without_rules(monkeypatch)
    full = reduce_scene(scene).cubic
    assert np.abs(ruled - full).max() < ZERO * np.abs(full).max()
    removed = (ruled == 0) & (full != 0)
    assert removed.sum() > 0.05 * full.size  # the mirrors alone leave them
    assert np.array_equal(ruled[~removed], full[~removed])


def test_quadratic_entries_of_a_pressurised_drum_keep_to_the_rule(monkeypatch):
    scene = attrs.evolve(drum(100.0, count=4, accuracy=LOADED), load=Load(pressure="1 kPa"))
    ruled = reduce_scene(scene).quadratic
    without_rules(monkeypatch)
    full = reduce_scene(scene).quadratic
    assert np.abs(ruled - full).max() < ZERO_LOADED * np.abs(full).max()
    assert (ruled == 0).sum() > (full == 0).sum()


def test_unequal_tensions_leave_only_the_mirrors_to_rule():
    """f01 f01 f01 f21c would vanish on a body of revolution; here it is 2 % of the largest."""
    model = reduce_scene(paper_drum(4))
    f01, f21c = model.label.index("f01"), model.label.index("f21c")
    largest = np.abs(model.cubic).max()
    assert abs(model.cubic[f01, f01, f01, f21c]) > 1e-3 * largest


@pytest.mark.parametrize("tension", [Tension(0.321, 0.257), Tension.isotropic(0.3)])
def test_load_cases_that_are_images_of_others_give_what_solving_them_gives(monkeypatch, tension):
    scene = attrs.evolve(
        paper_drum(6), tension=tension, accuracy=Accuracy(1e-4), reduction=Reduction(method="step")
    )
    fewer = reduce_scene(scene)
    without_rules(monkeypatch)
    monkeypatch.setattr(selection, "images", lambda parities, odd: [np.ones(len(parities), int)])
    every = reduce_scene(scene)
    assert every.diagnostics["load_cases"] == len(list(load_cases(6)))
    assert fewer.diagnostics["load_cases"] < 6 + 2 * comb(6, 2) + comb(6, 3)
    assert np.abs(fewer.cubic - every.cubic).max() < SAME * np.abs(every.cubic).max()


def test_triples_with_nothing_to_find_are_not_solved():
    """f01, f11c and f21s: their product is odd in y, but of 1 and 3 nodal diameters."""
    scene = drum(100.0, count=6, accuracy=Accuracy(1e-4))
    names = reduce_scene(scene).label
    numbers = [names.index(name) + 1 for name in ("f01", "f11c", "f21s")]
    scene = attrs.evolve(scene, modes=Modes(select=numbers), reduction=Reduction(method="step"))
    # of 3 + 3 * 2 + 1 the pairs of unlike parity need no second sign, and the triple none
    assert reduce_scene(scene).diagnostics["load_cases"] == 3 + 3


@pytest.mark.parametrize(("flat", "solved"), [(False, 1278), (True, 729)])
def test_shells_of_eleven_modes_solve_fewer_load_cases_for_their_mirrors(flat, solved):
    """Of a drum: cos(n t) is odd in x for odd n, sin(n t) in y and for even n in x; 1716 in all."""
    parities = [(0, 0)]  # f01
    for n in (1, 2, 0, 3, 1, 4):  # f11, f21, f02, f31, f12, f41
        parities += [(n % 2, 0), (1 - n % 2, 1)] if n else [(0, 0)]
    every = with_opposites(list(load_cases(11)))
    assert EXTRAPOLATED * len(every) == 1716
    sources = selection.solved_for(every, selection.images(parities[:11], odd=flat))
    assert EXTRAPOLATED * len({source for source, _ in sources.values()}) == solved
    for case, (source, signs) in sources.items():
        assert tuple((mode, int(sign * signs[mode])) for mode, sign in case) == source
