"""Rectangles on soft springs beside hp elements: what is asked for is met, and told truly."""

import pytest

from tests.fem.hp import SIDES, Film
from tests.stress.edges import held

RATIO = 3.0  # of a true error to the estimate that is told
ORDERS = (5, 3), (6, 4)  # of the hp elements; half their difference may be theirs
H, NU = 0.01, 0.3
RIGIDITY = H**3 / 12 / (1 - NU**2)


def film(sides, stiffness, turning):
    """A rectangle 1 x .8; stiffness per length and of turning by that of bending, of sides e."""
    spring = stiffness * RIGIDITY, turning * RIGIDITY
    kinds = dict(zip(SIDES, sides))
    return Film(
        1.0,
        0.8,
        H,
        NU,
        {side: spring if kind == "e" else kind for side, kind in kinds.items()},
        {side: "free" if kind == "f" else "fixed" for side, kind in kinds.items()},
    )


@pytest.mark.parametrize(
    ("sides", "stiffness", "turning", "count", "tolerance"),
    [
        ("efff", 0.1, 0.1, 3, 1e-7),  # it turns and moves nearly as one
        ("eeff", 1e-3, 0.0, 2, 1e-6),  # no softer ones are allowed
        ("cfef", 0.1, 0.0, 3, 1e-7),  # what a soft spring does not hold something else does
    ],
)
def test_films_on_soft_springs_meet_their_tolerance(sides, stiffness, turning, count, tolerance):
    errors, told, dofs = held(film(sides, stiffness, turning), count, tolerance, ORDERS)
    assert max(told) < tolerance
    assert (errors < RATIO * told).all()
    assert dofs < 11_000  # 5 265 to 132 753 before, and not met
