"""Where a response has what Keskekler et al. name: used by fig3.py, fig4.py and dependence.py.

Frequencies are drive frequencies by f01, levels are gamma by the value at which f01 alone doubles
its period.  Alone, and without nonlinear damping, f01 goes up to about 2 x level (`alone`).  What
stays below is held back by other modes.
"""

from math import pi, tau
from typing import NamedTuple

import numpy as np

from nanorom.continuation import explore
from nanorom.continuation.curves.locus import locus
from nanorom.rom.motion import energy_shares
from nanorom.rom.patterns import aimed

PAPER_NS = 2.538  # omega_d/omega_0 of the paper's Neimark-Sacker point
PAPER_PEAK = 3.5  # and of its highest peak
SURGED = 0.1  # f01 beyond the end of the first stable stretch
ABOVE = 1.15  # by its threshold: the level at which a period doubling is looked for


class Stretch(NamedTuple):
    """A stable part of a branch: its ends by f01, and the special points there ("" if none)."""

    start: float
    stop: float
    opens: str
    closes: str

    @property
    def top(self):
        return max(self.start, self.stop)


class Reach(NamedTuple):
    """How far the doubled branch of f01 goes at one level, by f01."""

    first: float  # end of the stable stretch that begins at 2 f01: what a sweep up follows
    lost: str  # the special point there
    peak: float  # end of the highest stable stretch
    amplitude: float  # largest stable amplitude of f01, in m
    torus: float  # Neimark-Sacker point nearest to the paper's, or nan

    @property
    def surged(self):
        return self.peak > self.first + SURGED


def alone(level):
    """Where the doubled branch of a single mode closes, by f01.

    Power in and out balance there: c w (1 + 9 p^2) = gamma J (1 + 2 p), with the share p of the
    third harmonic that the cubic force adds on the backbone, p = (s^2 - 1)/(3 (1 + 7 s^2)),
    s = w/(2 w_1).
    """
    ratio = 2 * level
    for _ in range(50):
        square = (ratio / 2) ** 2
        third = (square - 1) / (3 * (1 + 7 * square))
        ratio = 2 * level * (1 + 2 * third) / (1 + 9 * third**2)
    return ratio


def quality(model):
    """Quality factors (L,) of a model."""
    return model.mass * tau * model.frequency / np.diag(model.damping)


def first_branch(diagram, model):
    """The branch of doubled period that leaves the base branch at 2 f01, or None."""
    for branch in diagram.branches:
        start = branch.omega[0] / tau / model.frequency[0]
        if branch.period_multiple == 2 and branch.parent == 0 and abs(start - 2) < 0.1:
            return branch
    return None


def stable_stretches(diagram, branch, model):
    """The stable parts of a branch, in order along it."""
    unit = 1 / (tau * model.frequency[0])
    special = diagram.points(branch=diagram.branches.index(branch))

    scale = np.array([np.ptp(branch.omega), *np.maximum(branch.amplitude.max(axis=0), 1e-300)])

    def place(where):
        """Frequency and amplitudes of points, each by how much it varies."""
        return np.column_stack([np.atleast_1d(where.omega), np.atleast_2d(where.amplitude)]) / scale

    along = place(branch)

    def end(before, after):
        """The special point that lies between two points of the branch."""
        low, high = along[before], along[after]
        ends = sorted((low[0], high[0]))

        def detour(point):
            (here,) = place(point)
            if point.type == "LP" and ends[0] < here[0] < ends[1]:
                return np.inf  # frequencies turn at a fold: it is not between those of the points
            return np.linalg.norm(here - low) + np.linalg.norm(here - high)

        nearest = min(special, key=detour)
        return nearest.omega * unit, nearest.type

    changes = np.flatnonzero(np.diff(branch.stable)) + 1
    found = []
    for start, stop in zip([0, *changes], [*changes, len(branch)]):
        if not branch.stable[start]:
            continue
        first = end(start - 1, start) if start else (branch.omega[0] * unit, "")
        last = end(stop - 1, stop) if stop < len(branch) else (branch.omega[-1] * unit, "")
        found.append(Stretch(first[0], last[0], first[1], last[1]))
    return found


def reach(diagram, model):
    """The `Reach` of one level, or None if f01 does not double its period."""
    branch = first_branch(diagram, model)
    if branch is None:
        return None
    stretches = stable_stretches(diagram, branch, model)
    torus = nearest_torus(diagram, model)
    return Reach(
        stretches[0].top,
        stretches[0].closes,
        max(stretch.top for stretch in stretches),
        float(branch.amplitude[branch.stable, 0].max()),
        torus.omega / tau / model.frequency[0] if torus else float("nan"),
    )


def nearest_torus(diagram, model):
    """The Neimark-Sacker point of doubled period nearest to the paper's, or None."""
    points = [point for point in diagram.points("NS") if point.period_multiple == 2]
    distance = [abs(point.omega / tau / model.frequency[0] - PAPER_NS) for point in points]
    return points[int(np.argmin(distance))] if points else None


def internal_resonance(model, label):
    """Where a mode meets the drive while f01 moves at half of it: backbones of both, one harmonic.

    W^2 = (rho^2 - 4 r)/(1 - r), rho the ratio of frequencies, r = B_ss11/m_s/(2 B_1111/m_1).
    """
    s = model.label.index(label)
    ratio = model.frequency[s] / model.frequency[0]
    r = model.cubic[s, s, 0, 0] / model.mass[s] / (2 * model.cubic[0, 0, 0, 0] / model.mass[0])
    return float(np.sqrt((ratio**2 - 4 * r) / (1 - r)))


def opening(model, drive, label):
    """(level, drive frequency by twice that of the mode) at which it starts to double its period.

    drive : of level 1.  With all modes: the least level on the curve of period doublings in the
    plane of frequency and level, gamma by the mode's own threshold 2 k/(Q |J|) of one mode alone.
    """
    system = aimed(model, drive).system(drive.direct_pattern, drive.parametric_pattern)
    r = model.label.index(label)
    factor = ABOVE * threshold(model, drive)[r] / drive.parametric[0]
    beta, gamma = factor * drive.direct[0], factor * drive.parametric[0]
    twice = 4 * pi * model.frequency[r]
    near = (0.98 * twice, 1.02 * twice)
    point = explore(system, near, beta, gamma, depth=0, tolerance=1e-8).points("PD")[0]
    curve = locus(system, point, beta, gamma, omega=near, level=(0.5, 1.1), parameter="both")
    least = int(curve.level.argmin())
    return float(ABOVE * curve.level[least]), float(curve.omega[least] / twice)


def threshold(model, drive):
    """gamma (L,) in Pa/m at which a mode alone doubles its period, 2 k_r/(Q_r |J_r|)."""
    force = np.abs(aimed(model, drive).drive[drive.direct_pattern])
    with np.errstate(divide="ignore"):
        return 2 * np.diag(model.stiffness) / (quality(model) * force)


def most_excited(model, orbit, count=5):
    """The modes with most of the energy of an orbit, as text."""
    energy = energy_shares(model, orbit)
    return ", ".join(f"{model.label[r]} {energy[r]:.2%}" for r in np.argsort(energy)[::-1][:count])
