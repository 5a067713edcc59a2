"""Drums that several claims are about: solved once."""

import numpy as np
import pytest

import nanorom
from nanorom.continuation import explore
from nanorom.verification.assemble import assemble
from nanorom.verification.driven import DrivenFilm

RADIUS, THICKNESS, YOUNG, DENSITY, NU = 2.5e-6, 10e-9, 410e9, 2267.0, 0.16


def drum(modes, *, model="membrane", tension=(0.321, 0.257), quality=180.0, **sections):
    """The paper's drum, as a membrane unless told otherwise."""
    return nanorom.Scene(
        geometry=nanorom.Disc(radius=RADIUS),
        plate=nanorom.Plate(thickness=THICKNESS, model=model),
        material=nanorom.Material(youngs_modulus=YOUNG, poisson_ratio=NU, density=DENSITY),
        tension=nanorom.Tension(*tension),
        support=nanorom.Support("clamped"),
        modes=nanorom.Modes(select=modes) if isinstance(modes, list) else nanorom.Modes(modes),
        damping=nanorom.Damping(quality),
        **sections,
    )


SPOT = {"position": ["1.0 um", "0.6 um"], "radius": "1.0 um"}
LEVEL, BETA, PLACE = 1.6, 60.0, 2.2883  # gamma by its threshold; Pa per level; drive by f01


class Doubled:
    """The doubled branch of f01 in the paper's membrane, a spot and its tension driving it."""

    def __init__(self):
        self.drive = nanorom.Drive(1.0, direct_pattern="spot", **SPOT)
        sweep = nanorom.Sweep("1.95 f1", "2.3 f1")
        self.scene = drum(11, drive=self.drive, sweep=sweep)
        self.model = nanorom.reduce(self.scene)
        first = 2 * np.pi * self.model.frequency[0]
        modulated = abs(self.model.parametric["tension"][0, 0])
        self.direct = BETA * LEVEL
        self.parametric = LEVEL * 2 * self.model.stiffness[0, 0] / (180.0 * modulated)
        self.diagram = explore(
            self.model.system("spot", "tension"),
            omega=(1.95 * first, 2.05 * first),
            direct=self.direct,
            parametric=self.parametric,
        )
        branch = next(b for b in self.diagram.branches if b.period_multiple == 2)
        near = int(np.argmin(np.abs(branch.omega - PLACE * first)))
        self.orbit, self.amplitude = branch.orbit(near), branch.amplitude[near]
        self.film = assemble(self.scene)
        self.driven = DrivenFilm(self.film, self.drive, self.direct, self.parametric)


@pytest.fixture(scope="session")
def doubled():
    return Doubled()
