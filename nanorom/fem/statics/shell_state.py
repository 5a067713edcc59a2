"""Static state of a shell under its pre-tension and load."""

from __future__ import annotations

from dolfinx import fem

from nanorom.errors import SolverError
from nanorom.fem.models.build import boundary_kinds, check_boundary
from nanorom.fem.models.shell import Shell
from nanorom.fem.scales import Scales
from nanorom.fem.statics import path
from nanorom.fem.statics.problem import StaticProblem
from nanorom.scene.scene import Scene


def equilibrium(scene: Scene, scales: Scales, shell: Shell) -> StaticProblem:
    """The shell's static problem, in equilibrium under its pre-tension and load. Collective.

    Raises SolverError that says how much of the load was reached.
    """
    kinds = boundary_kinds(scene, list(shell.domain.facets), shell.mirrors)
    check_boundary(scene, shell.domain, kinds)
    clamped, pinned = (
        [side for side, kind in kinds.items() if kind == wanted]
        for wanted in ("clamped", "simply_supported")
    )
    fixed = shell.held(clamped, pinned)
    pressure = None if scene.load is None else scene.load.pressure
    if pressure is None:
        problem = StaticProblem(shell.state, shell.energy(), fixed=fixed)
        problem.solve(0.0)
        return problem
    unit = pressure * scales.length / scales.tension
    load = fem.Constant(shell.mesh, unit) * shell.follower_pressure()
    problem = StaticProblem(shell.state, shell.energy(), load, fixed=fixed)
    try:
        for _ in path.load_steps(problem, [1.0]):
            pass
    except SolverError as error:
        raise SolverError(f"load.pressure: {error}") from error
    return problem
