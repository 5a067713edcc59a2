"""Write scan.md beside this: random systems whose orbits an independent shooting scan finds, too.

    ./run python -m tests.stress.scan [--first 0] [--count 20] [--seconds 600]

Newton's method from random states, by Runge and Kutta's steps of the equations as the docstrings
have them and none of the package's code, finds orbits of one, two and three periods of the drive at
some frequencies, stable or not, at any Q. Every one of them must lie on a branch of the diagram, or
something in its `unexplored` tell that such orbits were not looked for or not followed.
"""

from __future__ import annotations

import argparse
import hashlib
import time
from pathlib import Path

import attrs
import numpy as np

from nanorom.bench import report
from nanorom.continuation import Diagram, ModalSystem, explore
from nanorom.files.lines import Lines

TABLE = Path(__file__).with_suffix(".md")
KINDS = ("hardening", "softening", "pair", "equal pair", "1:2", "1:3", "parametric")
RANGE = (0.85, 1.25)
FREQUENCIES = 4
STARTS = 48  # random states at each of them
ORDERS = (1, 2, 3)
PER_OSCILLATION = 40  # steps of the fastest mode
NEWTONS, CLOSED = 25, 1e-8
LARGEST = 3.0  # of amplitudes of the diagram: random states
SAME = 6e-2  # of an amplitude, which is interpolated between points of a branch
AWAY = 5e-2  # of the largest amplitude: of a mode that hardly moves
REST = 1e-7  # of random states: amplitudes that Newton's method does not tell apart
UNSTABLE = 100.0  # multiplier beyond which an orbit that nothing leads to is not followed


@attrs.frozen
class Case:
    """A random system with its levels."""

    kind: str
    quality: float
    system: ModalSystem
    direct: float
    parametric: float
    omega: tuple[float, float]


@attrs.frozen
class Row:
    """What the scan found of one system, and how many of that no branch has."""

    seed: int
    kind: str
    Q: float
    branches: int
    special_points: int
    orbits: int
    told: int
    missed: str
    seconds: float


def random_case(seed: int) -> Case:
    """The system of a seed: one or two modes, with a cubic force that has a potential."""
    random = np.random.default_rng(seed)
    kind = KINDS[seed % len(KINDS)]
    quality = 10 ** random.uniform(1.5, 9.0)
    size = 1 if kind in ("hardening", "softening", "parametric") else 2
    ratio = {"pair": random.uniform(1.01, 1.06), "1:2": random.uniform(1.95, 2.05)}
    ratio |= {"1:3": random.uniform(2.9, 3.05)}
    frequencies = np.array([1.0, ratio.get(kind, 1.0)])[:size]
    vectors = random.standard_normal((2, size))
    vectors /= np.linalg.norm(vectors, axis=0)
    cubic = np.einsum("mi,mj,mk,ml->ijkl", vectors, vectors, vectors, vectors)
    cubic *= -0.6 if kind == "softening" else 1.0
    quadratic = np.zeros((size,) * 3)
    if kind == "1:2":
        quadratic[0, 0, 1] = quadratic[0, 1, 0] = quadratic[1, 0, 0] = random.uniform(0.1, 0.4)
    amplitude = random.uniform(0.1, 0.4)
    parametric = random.uniform(2.2, 6.0) / quality if kind == "parametric" else 0.0
    system = ModalSystem(
        stiffness=frequencies**2,
        damping=frequencies / quality,
        quadratic=quadratic,
        cubic=cubic,
        direct=random.uniform(0.3, 1.0, size),
        parametric=np.eye(size),
    )
    direct = 0.0 if parametric else amplitude / quality
    low, high = RANGE
    return Case(
        kind,
        quality,
        system,
        direct,
        parametric,
        (2 * low, 2 * high) if parametric else (low, high),
    )


def returned(
    case: Case, states: np.ndarray, omega: float, periods: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """States (n, 2L) after some periods, maps (n, 2L, 2L) and the largest |q| (n, L) on the way."""
    system, size = case.system, case.system.size
    fastest = float(np.sqrt(np.abs(system.stiffness).max()))
    per_period = int(np.ceil(PER_OSCILLATION * max(1.0, fastest / omega)))
    step = 2 * np.pi / omega / per_period

    def slope(t: float, both: np.ndarray) -> np.ndarray:
        q, v = both[:, :size, 0], both[:, size:, 0]
        wave = np.cos(omega * t)
        stiffness = system.stiffness - case.parametric * wave * system.parametric
        secant = np.einsum("rjkl,nk,nl->nrj", system.cubic, q, q)
        linear = np.einsum("rjk,nk->nrj", system.quadratic, q)
        force = case.direct * wave * system.direct - v @ system.damping.T - q @ stiffness.T
        force -= np.einsum("nrj,nj->nr", secant + linear, q)
        tangent = stiffness + 3 * secant + 2 * linear
        result = np.empty_like(both)
        result[:, :size] = both[:, size:]
        result[:, size:, 0] = force
        result[:, size:, 1:] = -tangent @ both[:, :size, 1:] - system.damping @ both[:, size:, 1:]
        return result

    both = np.concatenate(
        [states[:, :, None], np.broadcast_to(np.eye(2 * size), (len(states), 2 * size, 2 * size))],
        axis=2,
    )
    largest = np.abs(states[:, :size])
    for i in range(periods * per_period):
        t = i * step
        k1 = slope(t, both)
        k2 = slope(t + step / 2, both + step / 2 * k1)
        k3 = slope(t + step / 2, both + step / 2 * k2)
        k4 = slope(t + step, both + step * k3)
        both = both + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        largest = np.maximum(largest, np.abs(both[:, :size, 0]))
    return both[:, :, 0], both[:, :, 1:], largest


def orbits(
    case: Case, omega: float, periods: int, size: float, random: np.random.Generator
) -> list[tuple[np.ndarray, float]]:
    """Amplitudes (L,) and largest multipliers of the orbits that Newton's method finds."""
    states = random.uniform(-1, 1, (STARTS, 2 * case.system.size)) * size
    with np.errstate(all="ignore"):
        for _ in range(NEWTONS):
            ends, maps, largest = returned(case, states, omega, periods)
            gaps = ends - states
            good = np.isfinite(maps).all(axis=(1, 2)) & np.isfinite(gaps).all(axis=1)
            states, maps, gaps, largest = states[good], maps[good], gaps[good], largest[good]
            if not len(states):
                return []
            matrices = maps - np.eye(maps.shape[1])
            change = -_solved(matrices, gaps)
            limit = size / np.maximum(np.abs(change).max(axis=1), size)
            states = states + limit[:, None] * change
    closed = np.abs(change).max(axis=1) < CLOSED * size
    found: list[tuple[np.ndarray, float]] = []
    for amplitude, matrix in zip(largest[closed], maps[closed]):
        if not any(_alike(amplitude, other, REST * size) for other, _ in found):
            found.append((amplitude, float(np.abs(np.linalg.eigvals(matrix)).max())))
    return found


def _solved(matrices: np.ndarray, gaps: np.ndarray) -> np.ndarray:
    return np.stack([np.linalg.lstsq(m, g, rcond=1e-14)[0] for m, g in zip(matrices, gaps)])


def _alike(one: np.ndarray, two: np.ndarray, floor: float) -> bool:
    allowed = SAME * np.maximum(one, two) + AWAY * max(one.max(), two.max()) + floor
    return bool((np.abs(one - two) <= allowed).all())


def on_branch(diagram: Diagram, omega: float, amplitude: np.ndarray, floor: float) -> bool:
    """Whether a branch passes a frequency with these amplitudes, but for a difference `floor`."""
    for branch in diagram.branches:
        for i in np.flatnonzero((branch.omega[:-1] - omega) * (branch.omega[1:] - omega) <= 0):
            gap = branch.omega[i + 1] - branch.omega[i]
            part = (omega - branch.omega[i]) / gap if gap else 0.0
            here = branch.amplitude[i] + part * (branch.amplitude[i + 1] - branch.amplitude[i])
            if _alike(here, amplitude, floor):
                return True
    return False


def scanned(seed: int) -> Row:
    """The diagram and the scan of one system."""
    case = random_case(seed)
    random = np.random.default_rng([seed, 1])
    start = time.process_time()
    diagram = explore(case.system, case.omega, case.direct, case.parametric)
    seconds = time.process_time() - start
    size = LARGEST * max(float(branch.amplitude.max()) for branch in diagram.branches) or 1.0
    count, told, missed = 0, 0, []
    for omega in random.uniform(*case.omega, FREQUENCIES):
        for periods in ORDERS:
            for amplitude, multiplier in orbits(case, omega, periods, size, random):
                count += 1
                if on_branch(diagram, omega, amplitude, REST * size):
                    continue
                if multiplier > UNSTABLE or diagram.unexplored:
                    told += 1
                    continue
                missed.append(f"{periods} at {omega:.6f}: {amplitude.max():.4f}")
    return Row(
        seed,
        case.kind,
        case.quality,
        len(diagram.branches),
        len(diagram.special_points),
        count,
        told,
        "; ".join(missed),
        seconds,
    )


def main() -> None:
    """Print rows as they come; write the table of those that the seconds allow, go on next time."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=np.inf, help="of CPU, of this run")
    given = parser.parse_args()
    kept = Lines(TABLE, hashlib.sha256(Path(__file__).read_bytes()).hexdigest())
    rows: list[Row] = []
    for seed in range(given.first, given.first + given.count):
        if seed not in kept.found and time.process_time() > given.seconds:
            print(f"seeds from {seed} on are for the next run", flush=True)
            break
        rows += [Row(**row) for row in kept.each([seed], lambda n: attrs.asdict(scanned(n)))]
        print(report.line(rows[-1]), flush=True)
    else:
        kept.finished()
    command = f"python -m tests.stress.scan --first {given.first} --count {given.count}"
    report.write_markdown("Random systems beside a shooting scan", (rows,), TABLE, command)


if __name__ == "__main__":
    main()
