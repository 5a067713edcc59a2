"""Write chosen.md beside this: what `[modes] count = "auto"` costs and is wrong by.

    ./run python -m tests.benchmarks.chosen [DEVICE ...]

Every device is asked for a response to 1e-3.  Beside it are a run with just the modes that were
chosen, with its estimates of errors as it comes and without them, and one of more modes, whose
special points are the reference.  CPU seconds, those of other processes included.
"""

from __future__ import annotations

import argparse
import os
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import attrs

import nanorom
from nanorom.bench import report
from nanorom.results.respond import respond
from nanorom.results.response import Response
from nanorom.rom.model import ReducedModel

TABLE = Path(__file__).with_suffix(".md")
DEMOS = Path(__file__).parents[2] / "demos"
TOLERANCE = 1e-3
LACKING = 1.0  # error of a point that more modes do not have
SPOT = {"direct_pattern": "spot", "position": ["1.0 um", "0.6 um"], "radius": "1.0 um"}
T = TypeVar("T")


def drum(drive: nanorom.Drive, stop: str, load: nanorom.Load | None = None) -> nanorom.Scene:
    """The paper's drum without bending and with equal tensions."""
    scene = nanorom.Scene.from_file(DEMOS / "drum.toml")
    plate = nanorom.Plate(thickness=scene.plate.thickness, model="membrane")
    sweep = nanorom.Sweep("0.9 f1", stop)
    tension = nanorom.Tension(0.3, 0.3)
    return scene.with_(
        plate=plate, tension=tension, drive=drive, sweep=sweep, load=load,
        accuracy=nanorom.Accuracy(1e-5), damping=nanorom.Damping(180.0),
    )  # fmt: skip


DEVICES: dict[str, tuple[Callable[[], nanorom.Scene], list[int]]] = {
    "drum, pressure 5, 10, 15 Pa": (
        lambda: drum(nanorom.Drive([5.0, 10.0, 15.0]), "1.3 f1"), list(range(1, 25)),
    ),
    "drum, spot of 10, 30, 90 Pa": (
        lambda: drum(nanorom.Drive([10.0, 30.0, 90.0], **SPOT), "1.9 f1"), list(range(1, 25)),
    ),
    "drum under 20 kPa, 10 and 20 Pa": (
        lambda: drum(nanorom.Drive([10.0, 20.0]), "1.1 f1", nanorom.Load(pressure="20 kPa")),
        list(range(1, 25)),
    ),
    "string of demos/string.toml": (
        lambda: nanorom.Scene.from_file(DEMOS / "string.toml"), [1, 3, 5, 7],
    ),
    "rectangle of demos/rectangle.toml": (
        lambda: nanorom.Scene.from_file(DEMOS / "rectangle.toml"), list(range(1, 25)),
    ),
}  # fmt: skip


@attrs.frozen
class Row:
    """A device: its modes, errors of the response, and the price by two runs of just these modes.

    estimated, true : largest relative error of frequency or amplitude of a special point.
    """

    device: str
    chosen: str
    points: int
    estimated: float
    true: float
    reference: int
    cpu: float
    price: float
    price_without_estimates: float


def timed(run: Callable[[], T]) -> tuple[T, float]:
    """What a run returns, and its CPU seconds."""
    before = sum(os.times()[:4])
    return run(), sum(os.times()[:4]) - before


def whole(scene: nanorom.Scene, estimates: bool = True) -> tuple[ReducedModel, Response]:
    """Model and response of a scene."""
    from nanorom.fem.reduce import reduce_scene

    model = nanorom.reduce(scene) if estimates else reduce_scene(scene)
    own = nanorom.Scene.from_toml(model.scene)
    assert own.drive is not None and own.sweep is not None
    return model, respond(model, own.drive, own.sweep, processes=1)


def difference(response: Response, other: Response) -> float:
    """Largest relative one of frequency or amplitude of special points."""
    worst = 0.0
    for diagram, more in zip(response.diagrams, other.diagrams):
        for point in diagram.special_points:
            apart = [
                max(
                    abs(p.omega / point.omega - 1),
                    abs(p.amplitude.max() / point.amplitude.max() - 1),
                )
                for p in more.special_points
                if p.type == point.type
            ]
            worst = max(worst, min(apart, default=LACKING))
    return worst


def row(name: str) -> Row:
    """One device."""
    make, reference = DEVICES[name]
    scene = make()
    asked = attrs.evolve(scene.accuracy, response=TOLERANCE)
    nanorom.reduce(scene.with_(modes=1))  # compiles
    (model, response), cpu = timed(
        lambda: whole(scene.with_(modes=nanorom.Modes("auto"), accuracy=asked))
    )
    numbers = model.number.tolist()
    just = scene.with_(modes=nanorom.Modes(select=numbers))
    _, with_estimates = timed(lambda: whole(just))
    _, without = timed(lambda: whole(just, estimates=False))
    more = scene.with_(modes=nanorom.Modes(select=sorted({*numbers, *reference})))
    many, other = whole(more, estimates=False)
    return Row(
        device=name,
        chosen=", ".join(model.label),
        points=sum(len(d.special_points) for d in response.diagrams),
        estimated=response.error,
        true=difference(response, other),
        reference=many.size,
        cpu=cpu,
        price=cpu / with_estimates,
        price_without_estimates=cpu / without,
    )


def main() -> None:
    """Print rows as they come, then write the table."""
    warnings.simplefilter("ignore")
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("devices", nargs="*", help=f"some of: {'; '.join(DEVICES)}")
    names = parser.parse_args().devices or list(DEVICES)
    rows = []
    for name in names:
        rows.append(row(name))
        print(*attrs.astuple(rows[-1]), sep=" | ", flush=True)
    command = "python -m tests.benchmarks.chosen"
    report.write_markdown("Modes that the program chooses, to 1e-3", (rows,), TABLE, command)


if __name__ == "__main__":
    main()
