"""Sweeps whose truth is known: stable orbits of a Duffing resonator from the continuation."""

import attrs
import numpy as np
from scipy.interpolate import CubicSpline

from nanorom.continuation import ModalSystem, explore
from nanorom.continuation.readout import readout
from nanorom.measurement.data import Trace

PLACE, QUALITY, NM = 21.15e6, 200.0, 10.0  # Hz, 1, unit of the amplitude where q = 1
SAMPLES = 100_001  # of the spline along a branch, which is right to 1e-6


def duffing_sweeps(forces, ratios, quality=QUALITY):
    """Traces up and down at ratios of the drive frequency and w0: q'' + q'/Q + q + q^3 = F cos."""
    system = ModalSystem(stiffness=[1.0], damping=[1 / quality], cubic=[[[[1.0]]]], direct=[1.0])
    found = []
    for force in forces:
        diagram = explore(system, (0.98 * ratios[0], 1.02 * ratios[-1]), force)
        branch = diagram.branches[0]
        table = np.column_stack([branch.omega, np.log(readout(branch).size)])
        along = np.hypot(*(np.diff(table, axis=0) * [quality, 1]).T)
        way = np.append(0, np.cumsum(along))
        omega, size = CubicSpline(way, table)(np.linspace(0, way[-1], SAMPLES)).T
        folds = sorted(point.omega for point in diagram.points("LP", 0))
        back = np.flatnonzero(np.diff(omega) < 0)
        ends = (back[0], back[-1] + 1) if len(back) else (len(omega) - 1, 0)
        low = np.interp(ratios, omega[: ends[0] + 1], size[: ends[0] + 1])
        high = np.interp(ratios, omega[ends[1] :], size[ends[1] :])
        for direction, fold in zip(("up", "down"), (folds[-1:], folds[:1])):
            before = ratios < (fold[0] if fold else np.inf)
            order = slice(None) if direction == "up" else slice(None, None, -1)
            amplitude = NM * np.exp(np.where(before, low, high))[order]
            found.append(Trace(PLACE * ratios[order], amplitude, f"{force:g}", direction))
    return found


def noisy(traces, noise, seed):
    """With relative noise."""
    random = np.random.default_rng(seed)
    return [
        attrs.evolve(
            trace,
            amplitude=np.abs(
                trace.amplitude * (1 + noise * random.standard_normal(len(trace.amplitude)))
            ),
        )
        for trace in traces
    ]
