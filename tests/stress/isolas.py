"""Write isolas.md beside this: isolas of random tuned absorbers beside an independent scan.

    ./run python -m tests.stress.isolas [--first 0] [--count 20]

A Duffing oscillator with a nonlinear tuned vibration absorber has isolas below the force at which
they merge with its resonance (Detroux et al. 2015, doi:10.1016/j.ymssp.2015.01.035). One level
alone is explored, its isolas are looked for along its curves of folds, and Newton's method from
random states (`tests.stress.scan`) finds orbits, every one of which must lie on a branch. Among
the absorbers farther from the tuned one are isolas that merge at nearly twice the level, or are cut
by the end of the range.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from itertools import product
from pathlib import Path

import attrs
import numpy as np

from nanorom.bench import report
from nanorom.continuation import ModalSystem, add_isolas, explore
from tests.stress.scan import REST, Case, on_branch, orbits

TABLE = Path(__file__).with_suffix(".md")
RANGE = (0.6, 3.0)
SCANNED = (1.05, 1.9)  # where the isolas are
LARGEST = 1.2  # of amplitudes of the diagram: random states
FREQUENCIES = 6
NEAR = 0.03  # of the numbers of the absorber in that article
# mass, cubic, spring, damping, force
WIDE = ((0.04, 0.06), (0.002, 0.006), (0.04, 0.05), (0.010, 0.015), (0.11, 0.2))


@attrs.frozen
class Row:
    """How far from the tuned absorber, branches with and without those of folds, orbits that the
    scan found, those on isolas, and those on no branch.
    """

    seed: int
    tuned: str
    level: float
    branches: int
    isolas: int
    orbits: int
    on_isolas: int
    missed: str
    seconds: float


def near(seed: int) -> Case:
    """An absorber near the tuned one."""
    random = np.random.default_rng(seed)
    mass, cubic, spring, damping = (
        value * random.uniform(1 - NEAR, 1 + NEAR) for value in (0.05, 0.0042, 0.0454, 0.0128)
    )
    return absorber(mass, cubic, spring, damping, random.uniform(0.14, 0.18))


def wide(seed: int) -> Case:
    """An absorber farther from it."""
    random = np.random.default_rng(seed)
    return absorber(*(float(random.uniform(*limits)) for limits in WIDE))


def absorber(mass: float, cubic: float, spring: float, damping: float, force: float) -> Case:
    """The system in coordinates of unit masses."""
    unit = np.diag([1.0, 1 / np.sqrt(mass)])
    between = unit @ [1.0, -1.0]
    square, first = np.outer(between, between), np.diag([1.0, 0.0])
    tensor = cubic * np.einsum("i,j,k,l->ijkl", *[between] * 4)
    tensor[0, 0, 0, 0] += 1.0
    system = ModalSystem(
        stiffness=first + spring * square,
        damping=0.002 * first + damping * square,
        cubic=tensor,
        direct=[1.0, 0.0],
        parametric=np.zeros((2, 2)),
    )
    return Case("absorber", 0.0, system, force, 0.0, RANGE)


def scanned(seed: int, draw: Callable[[int], Case] = near) -> Row:
    """The level of a seed and its scan."""
    case, random = draw(seed), np.random.default_rng([seed, 1])
    start = time.process_time()
    alone = explore(case.system, case.omega, case.direct)
    diagram = add_isolas(case.system, case.omega, [alone], 1)[0]
    seconds = time.process_time() - start
    size = LARGEST * max(float(branch.amplitude.max()) for branch in diagram.branches)
    count, isolated, missed = 0, 0, []
    for omega in random.uniform(*SCANNED, FREQUENCIES):
        for amplitude, _ in orbits(case, omega, 1, size, random):
            count += 1
            if on_branch(alone, omega, amplitude, REST * size):
                continue
            if on_branch(diagram, omega, amplitude, REST * size):
                isolated += 1
            else:
                missed.append(f"{omega:.6f}: {amplitude.max():.4f}")
    isolas = len(diagram.branches) - len(alone.branches)
    told = len(alone.branches), isolas, count, isolated, "; ".join(missed), seconds
    return Row(seed, draw.__name__, case.direct, *told)


def main() -> None:
    """Print rows as they come, then write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=20)
    given = parser.parse_args()
    rows: list[Row] = []
    seeds = range(given.first, given.first + given.count)
    for draw, seed in product((near, wide), seeds):
        rows.append(scanned(seed, draw))
        print(report.line(rows[-1]), flush=True)
    command = f"python -m tests.stress.isolas --first {given.first} --count {given.count}"
    report.write_markdown("Isolas of random absorbers beside a scan", (rows,), TABLE, command)


if __name__ == "__main__":
    main()
