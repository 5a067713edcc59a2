"""Which modes a response needs: followed with few, held against many, until no point asks for more.

It starts with the modes that the drive moves, follows the strongest level, and estimates what every
special point and points between are wrong by in a model of many more modes (`continuation.larger`).
Modes outside that make more of it than the tolerance allows are added, and so are those whose own
motion grows where the model is at rest; then the same at all levels.  What answers statically is
no reason to add a mode: a film that is not flat has it in its cubic force.
"""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np
from numpy.typing import NDArray

from nanorom.continuation import Diagram, explore_levels
from nanorom.continuation.diagrams.selection import PLAIN
from nanorom.continuation.larger.equations import LargerSystem
from nanorom.results.estimates import Estimates, estimates_of
from nanorom.results.question import Question
from nanorom.rom.model import ReducedModel
from nanorom.types import Array, Progress

SAFE = 0.7  # of the tolerance, that an estimate may be: the larger model is not the film
LEFT = 0.25  # of the tolerance, that modes which are not added may make together
DRIVEN, RESONANT = 0.1, 0.01  # of the largest linear response: modes that are there from the start,
# and those whose own resonance is swept
SMALL = 0.1  # of the largest share of a point's error: it may be gone once the larger are there
GROWS = 0.1  # of a growing motion: modes that are added for it
LEAST_ADDED, MOST_ROUNDS = 2, 8  # modes of a round, else as many as there are; rounds
UPPER = 2 / 3  # of the larger model: were modes beyond that needed, there may be more
SET = "driven"  # why a mode is there from the start
FREQUENCIES = 200  # at which the linear response is looked at

Level = tuple[float, float]


@attrs.frozen(eq=False)
class Choice:
    """Names of modes (L,), why each is there, and what they give.

    diagrams, estimates : by level; wider : whether a larger model has to be asked.
    """

    why: dict[str, str]
    diagrams: tuple[Diagram, ...]
    estimates: tuple[Estimates, ...]
    wider: bool

    @property
    def error(self) -> float:
        """The largest estimated error of a point."""
        return max((float(e.error.max(initial=0.0)) for e in self.estimates), default=0.0)


class Search:
    """A search among the modes of a larger model.

    model : of N modes; question : drive, sweep and damping, the sweep in Hz; tolerance : of the
    response; processes : for the levels, None for one per core.
    """

    def __init__(
        self,
        model: ReducedModel,
        question: Question,
        tolerance: float,
        processes: int | None = None,
        progress: Progress | None = None,
    ) -> None:
        self.model, self.question, self.tolerance = model, question, tolerance
        self.processes, self.progress = processes, progress
        self.why: dict[int, str] = {}
        self.upper = 0.0  # share of the upper modes in an error
        self._known: dict[tuple[tuple[str, ...], Level], Diagram] = {}

    def within(self, model: ReducedModel) -> Search:
        """The same search going on in a model of still more modes."""
        wider = Search(model, self.question, self.tolerance, self.processes, self.progress)
        wider.why = {model.label.index(self.model.label[n]): w for n, w in self.why.items()}
        wider._known = self._known
        return wider

    def run(self) -> Choice:
        """Add modes until every point at every level is within the tolerance."""
        if not self.why:
            self.why = dict.fromkeys(_driven(self.model, self.question), SET)
        levels = self.question.drive.levels
        strongest = max(levels, key=lambda level: (level[1], level[0]))
        for own in ([strongest], levels):
            for number in range(MOST_ROUNDS):
                if self.progress is not None:
                    self.progress("choice of modes", number, MOST_ROUNDS)
                diagrams = self._diagrams(own)
                found = [self._estimates(diagram) for diagram in diagrams]
                added = self._wanted(found)
                if not added:
                    break
                self.why |= added
        return Choice(
            why={self.model.label[n]: self.why[n] for n in sorted(self.why)},
            diagrams=tuple(diagrams),
            estimates=tuple(found),
            wider=self.upper > self.tolerance
            or len(self.why) == self.model.size
            or any(n >= UPPER * self.model.size and why != SET for n, why in self.why.items()),
        )

    @property
    def _places(self) -> NDArray[np.intp]:
        return np.array(sorted(self.why), dtype=np.intp)

    def _diagrams(self, levels: Sequence[Level]) -> list[Diagram]:
        chosen = self.model.select([self.model.label[n] for n in self._places])
        system, omega, options = self.question.of(chosen)
        missing = [level for level in levels if (chosen.label, level) not in self._known]
        followed = explore_levels(system, omega, missing, self.processes, **options)
        for level, diagram in zip(missing, followed):
            self._known[chosen.label, level] = diagram
        return [self._known[chosen.label, level] for level in levels]

    def _estimates(self, diagram: Diagram) -> Estimates:
        system, _, _ = self.question.of(self.model)
        larger = LargerSystem(system, self._places, diagram.direct, diagram.parametric)
        return estimates_of(larger, diagram)

    def _wanted(self, found: Sequence[Estimates]) -> dict[int, str]:
        """Modes to add, the most important first and not more than there are, and why."""
        asked: list[tuple[float, int, str]] = []
        outside = np.setdiff1d(np.arange(self.model.size), self._places)
        top = outside >= UPPER * self.model.size
        self.upper = max((float(s[top].sum()) for e in found for s in e.share), default=0.0)
        for each in found:
            for omega, shares in zip(each.growth_omega, each.growth_share):
                text = f"grows at {self._by_first(omega)}"
                asked += [(1.0 + shares[k], k, text) for k in np.flatnonzero(shares > GROWS)]
            for row in np.flatnonzero(each.error > SAFE * self.tolerance):
                shares = each.share[row]
                kind = "" if each.type[row] == PLAIN else f"{each.type[row]} "
                at = f"{kind}at {self._by_first(each.omega[row])}"
                large = _large(shares, LEFT * self.tolerance)
                for k in large[shares[large] > SMALL * shares.max(initial=0.0)]:
                    asked.append((shares[k], k, f"shifts {at} by {shares[k]:.1e}"))
        why: dict[int, str] = {}
        for _, k, text in sorted(asked, reverse=True):
            if len(why) < max(LEAST_ADDED, len(self.why)):
                why.setdefault(int(outside[k]), text)
        return why

    def _by_first(self, omega: float) -> str:
        return f"{omega / (2 * np.pi * self.model.frequency[0]):.4g} f1"


def _large(shares: Array, left: float) -> NDArray[np.intp]:
    """Which shares are needed for the others to sum up to less than what may be left."""
    order = np.argsort(shares)
    return np.sort(order[np.cumsum(shares[order]) > left])


def _driven(model: ReducedModel, question: Question) -> list[int]:
    """Places of the modes whose linear response is among the largest, or that are modulated."""
    system, (start, stop), _ = question.of(model)
    mass, damping, stiffness = (np.diag(a) for a in (system.mass, system.damping, system.stiffness))
    natural = np.sqrt(stiffness / mass)
    drive, found = question.drive, np.zeros(model.size, dtype=bool)
    if max(drive.direct) > 0:
        size = np.zeros(model.size)
        for harmonic, force in _tones(system.direct_drive[: model.size]):
            sweep = harmonic * np.linspace(start, stop, FREQUENCIES)[:, None]
            peaks = np.clip(natural, harmonic * start, harmonic * stop)[None]
            at = np.concatenate([sweep * np.ones(model.size), peaks])
            resisting = np.abs(stiffness - at**2 * mass + 1j * at * damping)
            size = np.maximum(size, (force / resisting).max(axis=0))
        swept = (start <= natural) & (natural <= stop)
        found |= size >= np.where(swept, RESONANT, DRIVEN) * size.max()
    if max(drive.parametric) > 0:
        highest = max(drive.parametric)
        for harmonic, pattern in _tones(system.parametric_at(highest)):
            pumped = highest * np.diag(pattern) > 2 * damping * natural
            found |= pumped & (harmonic * start <= 2 * natural) & (2 * natural <= harmonic * stop)
    if not found.any():
        found[0] = True
    return [int(n) for n in np.flatnonzero(found)]


def _tones(terms: Array) -> list[tuple[int, Array]]:
    """Number and size (...) of each harmonic of a drive (..., 2K + 1) in the terms 1, cos, ..."""
    count = (terms.shape[-1] - 1) // 2
    pairs = terms[..., 1:].reshape(*terms.shape[:-1], count, 2)
    size = np.linalg.norm(pairs, axis=-1)
    return [(k + 1, size[..., k]) for k in range(count)]
