"""Estimates of random devices against orbits of their films: none too small, none far too large.

./run python -m tests.stress.estimates [FIRST LAST]     seeds; prints a line per device
"""

import sys
import time

import attrs
import numpy as np

import nanorom

POINTS = 4  # orbits of a device
ONLY_BELOW = 0.1  # errors that estimates are held to
FEW = 1e-6  # errors below are those of the orbits themselves


@attrs.frozen
class Held:
    """Ratios (n,) of estimated to true error of the points that count, and orbits not found."""

    text: str
    ratios: np.ndarray
    missing: int


def device(seed):
    """A membrane or plate, disc or rectangle, of few modes under pressure, past its first fold."""
    random = np.random.default_rng(seed)
    thickness, quality = 10e-9 * random.uniform(0.5, 2), float(random.uniform(60, 300))
    tension = 0.3 * np.exp(random.uniform(-0.5, 0.5))
    radius = 2.5e-6 * random.uniform(0.6, 1.6)
    if random.random() < 0.5:
        geometry = nanorom.Disc(radius)
    else:
        geometry = nanorom.Rectangle(2 * radius, 2 * radius * random.uniform(0.5, 0.95))
    modes = [1] if random.random() < 0.5 else [1, int(random.integers(2, 7))]
    # at resonance a membrane deflects by about p R^2 Q / (4 T)
    height = thickness * random.uniform(0.4, 1.5)
    pressure = 4 * tension * height / (radius**2 * quality)
    return nanorom.Scene(
        geometry=geometry,
        plate=nanorom.Plate(thickness, model=str(random.choice(["membrane", "plate"]))),
        material=nanorom.Material(300e9 * random.uniform(0.3, 1.5), 0.2, 2500.0),
        tension=nanorom.Tension(tension, tension * random.uniform(0.7, 1.0)),
        support=nanorom.Support("clamped"),
        modes=nanorom.Modes(select=modes),
        accuracy=nanorom.Accuracy(1e-4),
        damping=nanorom.Damping(quality),
        drive=nanorom.Drive(pressure),
        sweep=nanorom.Sweep("0.95 f1", "1.4 f1"),
    )


def held(seed, points=POINTS):
    """Estimates of a device beside the errors that its film's orbits show."""
    scene = device(seed)
    model = nanorom.reduce(scene)
    response = nanorom.respond(model, scene.drive, scene.sweep, processes=1)
    found = nanorom.verify(scene, response, points=points)
    fold = np.array([kind == "LP" for kind in found.type])
    moved = found.omega_full != found.omega  # across the branch: its frequency tells
    by_omega = fold | moved
    error = np.abs(np.where(by_omega, found.error_omega, found.error))
    told = np.abs(np.where(by_omega, found.estimate_omega, found.estimate))
    counts = found.solved & (error > FEW) & (error < ONLY_BELOW)
    kind = type(scene.geometry).__name__
    text = f"{kind} {scene.plate.model} {'+'.join(model.label)}"
    return Held(text, told[counts] / error[counts], int((~found.solved).sum()))


def main(first=0, last=40):
    """A line per device, and the extremes of all."""
    every = []
    for seed in range(first, last):
        start = time.process_time()
        one = held(seed)
        every.extend(one.ratios)
        shown = " ".join(f"{ratio:.2g}" for ratio in one.ratios)
        seconds = time.process_time() - start
        print(f"{seed:3} {one.text:32} {shown} missing {one.missing}  {seconds:.0f} s", flush=True)
    print(f"{len(every)} points, estimate by error {min(every):.2g} to {max(every):.2g}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
