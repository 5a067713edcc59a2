"""A shell on its mesh: static state and named modes as for a reduction, all that moves an unknown.

Displacements and directors are unknowns, so that inertia in the surface and of turning directors
is in its orbits.
"""

from __future__ import annotations

import attrs
import numpy as np
import scipy.sparse as sp

from nanorom.errors import SceneError
from nanorom.fem.fields import quadrature
from nanorom.fem.fields.places import locate
from nanorom.fem.models.shell import Shell
from nanorom.fem.models.shell_system import ShellSystem, lifted, stiffened
from nanorom.fem.modes.deflections import Deflections
from nanorom.fem.modes.normal import normalise
from nanorom.fem.modes.shell import ShellModes
from nanorom.fem.output import drawing, patterns
from nanorom.fem.plan import Plan
from nanorom.fem.routes.shell import solve
from nanorom.fem.scales import Scales
from nanorom.fem.solvers import compat
from nanorom.fem.solvers.groups import alone
from nanorom.fem.stopwatch import Stopwatch
from nanorom.rom.shapes import Shapes
from nanorom.scene.patterns.pattern import Areal
from nanorom.scene.scene import Scene
from nanorom.types import Array
from nanorom.verification.assembled import FilmWork, Forces, Operators, Units
from nanorom.verification.factors import Factors
from nanorom.verification.whole import ONLY, Rest, WholeFilm, WholeForce, condensed, outer

MESH_TOLERANCE = 1e-5  # of a mesh: an orbit is compared to 1e-4 at best


@attrs.frozen(eq=False)
class ShellFilm(WholeFilm):
    """A shell; normal (dofs, n): deflections along the undeformed normals, of its unknowns.

    free (n,): which of the shell's degrees of freedom these are.
    """

    shell: Shell
    modes: Deflections
    free: np.ndarray
    scales: Scales
    normal: sp.csr_matrix

    @property
    def work(self) -> ShellWork:
        """Of simple forces on all unknowns."""
        return ShellWork(self)

    def drawn(self, vectors: Array) -> Shapes:
        shapes = self.normal @ vectors
        modes = attrs.evolve(self.modes, shapes=shapes, parities=[ONLY] * shapes.shape[1])
        points, cells, values = drawing.triangulation(modes)
        return Shapes(points * self.scales.length, cells, values)


@attrs.frozen(eq=False)
class ShellWork(FilmWork):
    """Virtual work on all unknowns of a shell."""

    film: ShellFilm

    def _along_normals(self, deflections: Array) -> Forces:
        return {ONLY: np.asarray(self.film.normal.T @ deflections)}

    def _at(self, cells: np.ndarray, reference: Array, weights: Array) -> Forces:
        """sum of weights (m,) times deflections at reference points (m, 2) of cells."""
        shell = self.film.shell
        dofs = compat.cell_dofs(shell.deflections)[cells]
        basis = compat.reference_element(shell.degree).tabulate(0, reference)
        found = np.zeros(self.film.normal.shape[0])
        np.add.at(found, dofs, weights[:, None] * np.asarray(basis).reshape(dofs.shape))
        return self._along_normals(found)

    def uniform(self, pressure: float = 1.0) -> Forces:
        found = np.zeros(self.film.normal.shape[0])
        for field in quadrature.fields(self.film.shell):
            np.add.at(found, field.dofs, field.weights @ field.values)
        return self._along_normals(pressure * self.film.scales.length**2 * found)

    def areal(self, pattern: Areal) -> Forces:
        length = self.film.scales.length
        cells, reference, weights = patterns.areal_rule(
            pattern, self.film.shell, np.ones(2), length
        )
        return self._at(cells, reference, length**2 * weights)

    def points(self, places: Array, weights: Array, key: str) -> Forces:
        cells, reference = locate(self.film.shell, places / self.film.scales.length)
        if (cells < 0).any():
            raise SceneError(f"{key}: it is not on the film")
        return self._at(cells, reference, weights)

    def inertia(self, acceleration: float = 1.0) -> Forces:
        found = lifted(self.film.shell, self.film.free)
        return {ONLY: -acceleration * self.film.scales.mass * found}

    def stretch(self, tension: float = 1.0) -> Operators:
        whole = tension * stiffened(self.film.shell, self.film.free)
        return lambda parity: whole


def assemble(scene: Scene, more: int, tolerance: float | None = None) -> ShellFilm:
    """The shell of a scene, on this process alone, with ``more`` named modes than the model has.

    tolerance : of the mesh.  Raises SolverError as `reduce` does.
    """
    fine = scene.accuracy.tolerance
    if fine is not None:
        fine = tolerance or max(fine, MESH_TOLERANCE)
    assert scene.damping is not None
    wide = scene.with_(
        modes=scene.modes.highest + more,
        tolerance=fine,
        damping=attrs.evolve(scene.damping, quality_factor=1.0),
    )
    plan = Plan.of(wide)
    scales = plan.scales
    solution = solve(alone(), plan, fine, Stopwatch(None))
    modes = solution.modes.like(normalise(solution.modes.modes))
    modes, names = _first(modes, solution.names, wide.modes.highest)
    shell, problem = modes.shell, modes.problem
    load = 0.0 if scene.load is None or scene.load.pressure is None else scene.load.pressure
    pressure = load * scales.length / scales.tension
    system = ShellSystem.of(shell, problem.free.local, problem.stiffness, pressure)
    shapes = modes.states[system.free]
    mass = np.einsum("nm,nm->m", shapes, system.mass @ shapes)
    named = shapes / np.sqrt(mass)
    static = Factors(system.stiffness, "shell's stiffness")
    rest = Rest.of(system, named, static)
    quadratic, cubic = condensed(system, rest)
    unit = np.sqrt(mass)
    tension, length = scales.tension, scales.length
    normal = _normal(shell, system)
    return ShellFilm(
        scene=scene,
        units=Units(
            time=float(np.sqrt(scales.mass / tension)), deflection=length, stiffness=tension
        ),
        discrete=WholeForce(system, _points(shell) @ normal, rest),
        names=names,
        parities=[ONLY] * len(names),
        values=modes.eigenvalues,
        modal={
            "mass": scales.mass * mass,
            "stiffness": tension * np.diag(mass * modes.eigenvalues),
            "quadratic": tension / length * quadratic * outer(unit, 3),
            "cubic": tension / length**2 * cubic * outer(unit, 4),
        },
        losses={},
        inside=np.array(scene.modes.numbers) - 1,
        classes=[ONLY],
        copies=1,
        named=named,
        shell=shell,
        modes=modes.modes,
        free=system.free,
        scales=scales,
        normal=normal,
    )


def _first(modes: ShellModes, names: list[str], count: int) -> tuple[ShellModes, list[str]]:
    """Some of the lowest modes."""
    some = np.arange(count)
    taken = attrs.evolve(modes, states=modes.states[:, some], modes=modes.modes.take(some))
    return taken, names[:count]


def _normal(shell: Shell, system: ShellSystem) -> sp.csr_matrix:
    """Deflections (their dofs, n) along the normals, of free degrees of freedom."""
    nodes = np.arange(system.nodes)
    rows = np.repeat(shell.nodes_in(shell.deflections), 3)
    columns = (6 * nodes[:, None] + np.arange(3)).ravel()
    shape = (system.nodes, 6 * system.nodes)
    whole = sp.csr_matrix((shell.normals().ravel(), (rows, columns)), shape)
    return whole[:, system.free]


def _points(shell: Shell) -> sp.csr_matrix:
    """Values at all quadrature points (p, dofs) of deflections."""
    rows, columns, values = [], [], []
    first = 0
    for field in quadrature.fields(shell):
        c, q = field.weights.shape
        n = field.dofs.shape[1]
        rows.append(first + np.repeat(np.arange(c * q), n))
        columns.append(np.repeat(field.dofs[:, None], q, axis=1).ravel())
        values.append(np.tile(field.values, (c, 1, 1)).ravel())
        first += c * q
    entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
    size = shell.deflections.dofmap.index_map.size_global
    return sp.csr_matrix(entries, (first, size))
