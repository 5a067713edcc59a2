"""Start-up and fine meshes: what a user waits for besides the solution of a small problem."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator

import attrs
import numpy as np
from mpi4py import MPI

from nanorom.exact import cases
from nanorom.fem import stopwatch
from nanorom.fem.mesh import discretisation
from nanorom.fem.models import build
from nanorom.fem.modes import eigen, names
from nanorom.fem.modes.eigen import Modes
from nanorom.fem.modes.normal import normalise
from nanorom.fem.routes import methods
from nanorom.fem.scales import Scales
from nanorom.fem.tensors import direct as condensation

FINE = 80_000  # deflection's degrees of freedom
FINE_DEGREE = 4
REPEATED = 11  # short work, timed together
DENSITY = 0.62  # cells of a quarter disc, by radius / size squared, at least


@attrs.frozen
class Figure:
    """A measured figure: name, value, unit."""

    name: str
    value: float
    unit: str


def start_up() -> Iterator[Figure]:
    """Wall time of new processes: import, --help, and the paper's drum cold and warm."""
    yield Figure("import nanorom, beyond an empty python", _beyond_python("import nanorom"), "s")
    command = (
        "import sys; from nanorom.cli.main import main; sys.argv = ['nanorom', '--help']; main()"
    )
    yield Figure("nanorom --help, process", _process(command), "s")
    toml = cases.paper_drum().scene.to_toml()
    command = (
        "from nanorom.scene.scene import Scene; from nanorom.workflow import reduce\n"
        f"reduce(Scene.from_toml({toml!r}))"
    )
    with tempfile.TemporaryDirectory() as cache:
        yield Figure("paper's drum, empty form cache, process", _process(command, cache), "s")
        yield Figure("paper's drum, warm form cache, process", _process(command, cache), "s")


def _beyond_python(command: str) -> float:
    return min(_process(command) for _ in range(5)) - min(_process("pass") for _ in range(5))


def _process(command: str, cache: str | None = None) -> float:
    """Wall time of a Python process, its form cache in a directory of its own."""
    environment = dict(os.environ)
    if cache is not None:
        environment |= {"XDG_CACHE_HOME": cache, "DOLFINX_JIT_CACHE_DIR": cache}
    start = time.perf_counter()
    subprocess.run(
        [sys.executable, "-c", command],
        env=environment,
        check=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    return time.perf_counter() - start


@attrs.frozen
class _Unit:
    """What tensors on a mesh cannot do without, in processor time: s, the last three once each."""

    assembly: float
    factorisation: float
    load: float
    solution: float
    reaction: float

    @classmethod
    def of(cls, modes: Modes) -> _Unit:
        """Of the in-plane displacement of modes."""
        import ufl
        from dolfinx import fem

        from nanorom.fem.fields import membrane
        from nanorom.fem.solvers import algebra, compat

        plate, clock = modes.plate, _Clock()
        stiffness = algebra.assemble(plate.compiled(plate.in_plane_form))
        assembly = clock.lap()
        free = membrane.free_dofs(plate, plate.mirrors.even)
        factors = algebra.Factorization(free.restrict(stiffness), "nanorom_bench_", "stiffness")
        factorisation = clock.lap()
        u, w = fem.Function(plate.in_plane), fem.Function(plate.deflections)
        w.x.array[:] = modes.shapes[:, 0]
        energy = plate.stretching_energy(u, w)
        load = compat.form(ufl.derivative(energy, u))
        reaction = compat.form(ufl.derivative(energy, w))
        right = algebra.assemble_vector(load)[free.local, None]
        clock.lap()
        loads = clock.mean(lambda: algebra.assemble_vector(load)[free.local, None])
        solutions = clock.mean(lambda: factors.solve(right))
        reactions = clock.mean(lambda: algebra.assemble_vector(reaction))
        return cls(assembly, factorisation, loads, solutions, reactions)

    def direct(self, pairs: int) -> float:
        """One factorisation, a load and a back-substitution for each pair."""
        return self.assembly + self.factorisation + pairs * (self.load + self.solution)

    def step(self, cases: int) -> float:
        """One factorisation, a residual and a back-substitution for each load case."""
        return self.direct(cases) + cases * self.reaction


def fine_mesh(dofs: int = FINE, degree: int = FINE_DEGREE) -> Iterator[Figure]:
    """Tensors of the paper's drum on a fine mesh, in units of what they cannot do without.

    The unit of the direct route is one factorisation of the in-plane stiffness on the meshed part
    of the film, and one right-hand side and back-substitution per pair; that of STEP one
    factorisation, and one residual and back-substitution per load case.  Processor times.
    """
    size = cases.RADIUS * np.sqrt(DENSITY * degree**2 / dofs)
    case = cases.by_hand(cases.paper_drum(), degree, cases.RADIUS / size, cases.RADIUS)
    scales = Scales.of(case.scene)
    layer = float(np.sqrt(scales.bending))
    chosen = discretisation.choose(case.scene, scales.length, layer, None)
    plate = build.build_plate(MPI.COMM_SELF, case.scene, scales, chosen)
    clock = _Clock()
    modes = eigen.solve(plate, 11)
    modes, _ = names.name(case.scene, modes)
    modes = normalise(modes.take(np.arange(11)))
    modal = clock.lap()
    unit = _Unit.of(modes)
    one = unit.load + unit.solution + unit.reaction
    yield Figure(
        "deflection's dofs on the meshed part",
        float(plate.deflections.dofmap.index_map.size_global),
        "",
    )
    yield Figure("eleven modes", modal, "s")
    yield Figure("in-plane stiffness assembled", unit.assembly, "s")
    yield Figure("one factorisation", unit.factorisation, "s")
    yield Figure("one load, one back-substitution, one reaction", one, "s")
    clock.lap()
    condensation.cubic_tensor(modes)
    direct = clock.lap()
    yield Figure("direct, 11 modes", direct, "s")
    name = "direct / (one factorisation + 66 loads and back-substitutions)"
    yield Figure(name, direct / unit.direct(66), "")
    clock.lap()
    methods.tensors(case.scene.with_(method="step"), scales, modes, stopwatch.Stopwatch(None))
    step = clock.lap()
    yield Figure("STEP, 11 modes", step, "s")
    name = "STEP / (one factorisation + 352 residuals and back-substitutions)"
    yield Figure(name, step / unit.step(352), "")


class _Clock:
    def __init__(self) -> None:
        self._last = time.process_time()

    def lap(self) -> float:
        """Processor time since the last call."""
        last, self._last = self._last, time.process_time()
        return self._last - last

    def mean(self, work: Callable[[], object]) -> float:
        """Processor time of some work, done several times."""
        for _ in range(REPEATED):
            work()
        return self.lap() / REPEATED


def many_modes() -> Iterator[Figure]:
    """Fifty modes of the drum at tolerance 1e-6, direct: time and true error."""
    from nanorom.bench import measure

    case = cases.with_tolerance(cases.drum(100.0, count=50), 1e-6)
    row = measure.reduction(case, repeats=1)
    yield Figure("50 modes direct at tolerance 1e-6, wall", row.seconds, "s")
    yield Figure("50 modes direct at tolerance 1e-6, processor", row.cpu, "s")
    yield Figure("50 modes direct at tolerance 1e-6, true error", row.error, "")
