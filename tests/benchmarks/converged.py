"""Write converged.md beside this: the special points of demos/dependence.py with more modes.

    ./run python -m tests.benchmarks.converged [--sizes 18,28,40] [CASE ...]

Every case is followed with the lowest eleven modes as the demo does it.  Special points of
the doubled branch of f01 are then located in models of more and more modes, each starting from the
one before (`nanorom.continuation.larger.location`): where the branch loses its stability first,
where its highest stable stretch and where all of it ends, and its Neimark-Sacker point nearest to
the paper's.  That is some ten times cheaper than a diagram.  What is told as the film's is the
last, its bar the last change.
"""

from __future__ import annotations

import argparse
import sys
import time
import warnings
from collections.abc import Iterator, Sequence
from math import tau
from pathlib import Path
from typing import Any

import attrs
import numpy as np

import nanorom
from nanorom.bench import report
from nanorom.continuation import ModalSystem, PeriodicOrbit, SpecialPoint
from nanorom.continuation.larger.correction import first_correction
from nanorom.continuation.larger.equations import LargerSystem
from nanorom.continuation.larger.location import nearby, special
from nanorom.continuation.orbits.balance import NewtonFailure
from nanorom.continuation.orbits.bifurcations import KINDS, outside
from nanorom.continuation.orbits.orbit import orbit_amplitudes
from nanorom.errors import SlowPlaneError
from nanorom.rom.model import ReducedModel
from nanorom.rom.patterns import aimed
from nanorom.types import Array

TABLE = Path(__file__).with_suffix(".md")
DEMOS = Path(__file__).parents[2] / "demos"
SIZES = (12, 13, 14, 15, 16, 18, 21, 24, 28, 34, 40, 50, 60)  # points are lost at large steps
CRITICAL = 1e-2  # about the critical multiplier: what is as near is it, to the point's own error
MERGED = 1e-6  # relative difference of frequencies below which two places are one point
SETS = (
    "with f03",
    "pressure, E = 41 GPa",
    "pressure, modes 1 4 6 15",
    "pressure, f01 and f21c",
    "f01 alone",
)
FIRST, HIGHEST, NEAREST = "stable to", "highest stable", "NS nearest to 2.538"
END = "end of the branch"


@attrs.frozen
class Row:
    """A special point by modes, its drive frequency by f01.

    film : of the largest model, and the larger of the last two changes on the way; nm : of f01.
    """

    case: str
    level: float
    point: str
    by_modes: str
    film: str
    nm: float
    remark: str
    cpu: float


@attrs.frozen(eq=False)
class Located:
    """A special point: drive frequency in rad/s, coefficients (2H + 1, L) in m of L modes.

    unstable : how many multipliers beside the critical ones are outside the unit circle.
    """

    omega: float
    coefficients: Array
    unstable: int

    @property
    def amplitude(self) -> Array:
        """max |q_r| (L,) in m."""
        return np.asarray(orbit_amplitudes(self.coefficients[None])[0])


def located(
    systems: dict[int, ModalSystem], point: SpecialPoint, level: tuple[float, float]
) -> Iterator[Located]:
    """A special point in larger and larger models, by size; it ends where there is none nearby."""
    orbit, kind, multipliers = point.orbit, KINDS[point.type], point.multipliers
    for system in systems.values():
        larger = LargerSystem(system, np.arange(orbit.coefficients.shape[1]), *level)
        seen = larger.seen(orbit)
        try:
            place = nearby(seen, first_correction(larger, seen).slope)
            place = special(larger, seen, place, kind, multipliers)
        except NewtonFailure:
            return
        multipliers = larger.multipliers(seen, place.x, place.rate)
        scaled = larger.orbit(seen, place.x, place.rate).coefficients
        omega = place.rate * larger.scaled.frequency * orbit.period_multiple
        orbit = PeriodicOrbit(scaled * larger.scaled.amplitude, omega, orbit.period_multiple)
        critical = kind.condition.nearest(multipliers)
        away = np.minimum(np.abs(multipliers - critical), np.abs(multipliers.conj() - critical))
        others = multipliers[away > CRITICAL]
        yield Located(omega, orbit.coefficients, int(outside(others[None])[0]))


def wanted(diagram: nanorom.Diagram, model: ReducedModel) -> dict[str, SpecialPoint]:
    """The points that the demo tells of, by what they are."""
    import phenomena as ph

    branch = ph.first_branch(diagram, model)
    if branch is None:
        return {}
    stretches = ph.stable_stretches(diagram, branch, model)
    highest = max(stretches, key=lambda stretch: stretch.top)
    unit = tau * model.frequency[0]
    found: dict[str, SpecialPoint] = {}
    torus = ph.nearest_torus(diagram, model)
    places = {FIRST: stretches[0].top, HIGHEST: highest.top}
    if torus is not None:
        places[NEAREST] = torus.omega / unit
    own = diagram.points(branch=diagram.branches.index(branch))
    places[END] = max(point.omega for point in own) / unit
    for name, ratio in places.items():
        point = min(own + ([torus] if torus else []), key=lambda p: abs(p.omega / unit / ratio - 1))
        if abs(point.omega / unit / ratio - 1) < MERGED:
            found[name] = point
    return found


def rows(name: str, sizes: Sequence[int]) -> Iterator[Row]:
    """All points of a case."""
    import dependence
    import fig3

    case: dict[str, Any] = dependence.BASE | dependence.CASES[name]
    full = attrs.evolve(
        dependence.reduced(**(case | {"modes": range(1, max(sizes) + 1)}), count=max(sizes)),
        larger=None,
    )
    few = full.select(
        list(case["modes"]) if case["modes"] != dependence.EVEN else list(range(1, 12))
    )
    drive = dependence.levels(few, **case)
    sweep = nanorom.Sweep("1.96 f1", "2.04 f1", tolerance=fig3.TOLERANCE)
    response = nanorom.respond(few, drive, sweep, processes=1)
    systems = {
        size: aimed(full.select(list(range(1, size + 1))), drive).system(
            drive.direct_pattern, drive.parametric_pattern
        )
        for size in sizes
    }
    unit = tau * full.frequency[0]
    for step, level, diagram in zip(dependence.LEVELS, drive.levels, response.diagrams):
        done: dict[float, str] = {}
        for what, point in wanted(diagram, few).items():
            if any(abs(point.omega / other - 1) < MERGED for other in done):
                continue
            done[point.omega] = what
            start = time.process_time()
            found = list(located(systems, point, level))
            ratios = [point.omega / unit, *(each.omega / unit for each in found)]
            bar = f"{ratios[-1]:.4f} ± {np.abs(np.diff(ratios))[-2:].max():.4f}" if found else ""
            lost = "" if len(found) == len(sizes) else f"lost with {sizes[len(found)]}"
            if found and found[-1].unstable:
                lost = (lost + " unstable before").strip()
            yield Row(
                case=name,
                level=step,
                point=f"{what} ({point.type})",
                by_modes=", ".join(f"{ratio:.4f}" for ratio in ratios),
                film=bar if len(found) == len(sizes) else "",
                nm=1e9 * float(found[-1].amplitude[0] if found else point.amplitude[0]),
                remark=lost,
                cpu=time.process_time() - start,
            )


def main() -> None:
    """Print rows as they come, then write the table."""
    warnings.simplefilter("ignore")
    sys.path.insert(0, str(DEMOS))
    import dependence

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", default=",".join(map(str, SIZES)), help="numbers of modes")
    parser.add_argument(
        "cases", nargs="*", help="of demos/dependence.py; all that are no sets of modes"
    )
    given = parser.parse_args()
    sizes = [int(size) for size in given.sizes.split(",")]
    found: list[Row] = []
    for name in given.cases or [name for name in dependence.CASES if name not in SETS]:
        try:
            for row in rows(name, sizes):
                found.append(row)
                print(" | ".join(map(str, attrs.astuple(row))), flush=True)
        except SlowPlaneError as error:  # a soft film: its plane is no faster than so many modes
            print(f"{name}: {error}", flush=True)
    cases = "".join(f' "{name}"' for name in given.cases)
    command = f"python -m tests.benchmarks.converged --sizes {given.sizes}{cases}"
    title = (
        f"The special points of demos/dependence.py with 11, {given.sizes.replace(',', ', ')} modes"
    )
    report.write_markdown(title, (found,), TABLE, command)


if __name__ == "__main__":
    main()
