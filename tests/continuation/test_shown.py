"""What calls return is shown in a few lines, whatever it holds."""

import pytest

from nanorom.continuation import ModalSystem, backbone, explore, locus

SCREEN = 700  # characters


@pytest.fixture(scope="module")
def system():
    return ModalSystem(damping=0.05, stiffness=1.0, cubic=[[[[1.0]]]], direct=[1.0])


def test_branches_backbones_and_loci_are_a_few_lines(system):
    diagram = explore(system, (0.5, 1.8), 0.1)
    fold = diagram.points("LP")[0]
    curve = locus(system, fold, 0.1, 0.0, omega=(0.5, 1.8), level=(0.08, 0.12))
    for result in (diagram.branches[0], backbone(system), curve):
        shown = repr(result)
        assert shown.startswith(type(result).__name__)
        assert f"omega=array ({len(result.omega)},)" in shown
        assert len(shown) < SCREEN
