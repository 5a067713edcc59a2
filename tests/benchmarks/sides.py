"""Write sides.md beside this: rectangles whose sides are held in every way, asked for 1e-8.

./run python -m tests.benchmarks.sides
"""

import itertools
import time
import warnings
from pathlib import Path

import attrs
import numpy as np

from nanorom.bench import bounded
from nanorom.errors import NanoromError
from nanorom.fem.reduce import reduce_scene
from tests.fem.routes.test_sides import film

TABLE = Path(__file__).with_suffix(".md")
TOLERANCE, FINER = 1e-8, 1e-9
HEAD = """# Rectangles held in every way

1 x 0.8, no tension, three modes, thickness 0.01, asked for 1e-8: left, right, bottom, top are
clamped, simply supported or free.  Of the 36 combinations (left and right change places, and so do
bottom and top) these 33 are held; a free one moves rigidly, and two turn about a line.
Unknowns are those of w on the part that mirrors leave and on the whole film, beside which is what
they are by the clamped one's; seconds are of the processor, on a machine with other load; errors
(of frequencies, and of the cubic tensor by its largest entry) are against the same scene at 1e-9,
estimates those that are told.  Written by `./run python -m tests.benchmarks.sides`.

| sides | dofs | whole film | by cccc | seconds | frequencies | estimate | tensor | estimate |
|---|---|---|---|---|---|---|---|---|
"""


@attrs.frozen
class Row:
    """One combination: unknowns, seconds, true errors (2,) and told ones (2,)."""

    sides: str
    dofs: int
    whole: int
    seconds: float
    errors: tuple[float, float]
    estimates: tuple[float, float]


def held():
    """The combinations, clamped all around first."""
    pairs = [a + b for a, b in itertools.combinations_with_replacement("csf", 2)]
    loose = {"ffff", "sfff", "ffsf"}
    return [x + y for x, y in itertools.product(pairs, pairs) if x + y not in loose]


def row(sides):
    """Solve a combination, and again for a smaller tolerance."""
    warnings.simplefilter("ignore")  # cantilevers bend without stretching
    start = time.process_time()
    model = reduce_scene(film(sides, 0.8, tolerance=TOLERANCE))
    seconds = time.process_time() - start
    finer = reduce_scene(film(sides, 0.8, tolerance=FINER))
    errors = (
        float(np.abs(model.frequency / finer.frequency - 1).max()),
        float(np.abs(model.cubic - finer.cubic).max() / np.abs(finer.cubic).max()),
    )
    found = model.diagnostics
    dofs, copies = int(found["dofs"]), 2 ** len(found["mirrors"])
    estimates = float(found["error_frequency"]), float(found["error_tensor"])
    return Row(sides, dofs, dofs * copies, seconds, errors, estimates)


def main():
    """Print rows as they come, then write the table."""
    lines, clamped = [], None
    for sides in held():
        try:
            found = bounded.bounded(row, sides, seconds=120)
        except NanoromError as error:
            lines.append(f"| {sides} | {error} |" + 7 * " |")
            continue
        finally:
            print(lines[-1] if lines else HEAD, flush=True)
        clamped = clamped or found.whole
        numbers = [found.errors[0], found.estimates[0], found.errors[1], found.estimates[1]]
        cells = [sides, found.dofs, found.whole, f"{found.whole / clamped:.2f}"]
        cells += [f"{found.seconds:.1f}", *(f"{number:.1e}" for number in numbers)]
        lines.append(f"| {' | '.join(map(str, cells))} |")
    TABLE.write_text(HEAD + "\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
