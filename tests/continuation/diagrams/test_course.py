"""What a level has come to is told while it is under way, from other processes, too."""

import pytest

from nanorom.continuation import Course, ModalSystem, explore, explore_each

DUFFING = ModalSystem(damping=0.01, stiffness=[1.0], cubic=[[[[1.0]]]], direct=[1.0])
RANGE = (0.8, 1.6)


def test_the_course_of_a_level_goes_through_the_range_and_counts_what_is_found() -> None:
    told: list[Course] = []
    diagram = explore(softening(), (0.5, 1.5), 0.08, watch=told.append)
    assert told[0].branches == 0
    assert len(diagram.branches) - told[-1].branches in (0, 1)  # nothing follows the last one
    assert 0 < told[-1].points <= len(diagram.special_points)
    assert min(course.omega for course in told) < 0.6
    assert max(course.omega for course in told) > 1.2


def softening() -> ModalSystem:
    return ModalSystem(damping=0.05, stiffness=[1.0], quadratic=[[[1.0]]], direct=[1.0])


@pytest.mark.parametrize("processes", [1, 2])
def test_levels_tell_their_course_by_number_whatever_the_processes(processes, monkeypatch) -> None:
    monkeypatch.setattr("nanorom.continuation.diagrams.levels.EVERY", 1e-3)
    told: list[tuple[int, Course]] = []
    levels = [(0.03, 0.0), (0.01, 0.0)]
    given = DUFFING, RANGE, levels, processes, lambda *each: told.append(each)
    whole = dict(explore_each(*given))
    assert sorted(whole) == [0, 1]
    assert {number for number, _ in told} == {0, 1}
    assert all(RANGE[0] / 2 <= course.omega <= RANGE[1] * 2 for _, course in told)
