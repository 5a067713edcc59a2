"""Drums for tests, in the film's units: radius, tension and E h are 1."""

import numpy as np
from mpi4py import MPI

from nanorom.fem.fields import places
from nanorom.fem.mesh import mesh
from nanorom.fem.mesh.shapes import Rings
from nanorom.fem.models.plate import Plate
from nanorom.fem.models.state import Stiffness
from nanorom.fem.symmetry import Mirrors

NU = 0.16
GROWTH = 2  # cells that each ring has more per quadrant


def drum(bending, degree=8, radii=(0.5, 1.0), mirrors=("x", "y"), nu=NU, sectors=16):
    """A disc of radius and tension 1, in rings of given radii."""
    counts = [min(GROWTH * ring, sectors // 4) for ring in range(1, len(radii) + 1)]
    quadrants = 4 // 2 ** len(mirrors)
    rings = Rings(tuple(radii), tuple(counts), quadrants, polar=radii[1])
    domain = mesh.build(MPI.COMM_WORLD, rings, degree)
    stiffness = Stiffness(bending=bending, poisson_ratio=nu)
    return Plate.on(domain, degree, ["edge"], stiffness=stiffness, mirrors=Mirrors(mirrors))


def centre(plate, state):
    return places.evaluate(plate, state.deflection(), np.zeros((1, 2)))[0]
