"""Drums for tests, in the film's units: radius, tension and E h are 1."""

import numpy as np
from mpi4py import MPI

from nanorom.fem.fields import places
from nanorom.fem.mesh import gmsh, mesh
from nanorom.fem.models.plate import Plate
from nanorom.fem.models.state import Stiffness
from nanorom.fem.symmetry import Mirrors

NU = 0.16


def drum(bending, degree=8, radii=(0.5, 1.0), mirrors=("x", "y"), nu=NU, sectors=16):
    """A disc of radius and tension 1, in rings of given radii."""
    parameters = {"rings": len(radii), "sectors": sectors, "quadrants": 4 // 2 ** len(mirrors)}
    uniform, wanted = np.linspace(0, 1, len(radii) + 1), np.array([0.0, *radii])

    def move(points):
        radius = np.linalg.norm(points, axis=1)
        scale = np.interp(radius, uniform, wanted) / np.where(radius > 0, radius, 1.0)
        return points * scale[:, None]

    domain = mesh.build(
        MPI.COMM_WORLD,
        gmsh.MESHES / "drum.geo",
        parameters,
        degree,
        gmsh.Grading(move, polar=wanted[2]),
    )
    stiffness = Stiffness(bending=bending, poisson_ratio=nu)
    return Plate.on(domain, degree, ["edge"], stiffness=stiffness, mirrors=Mirrors(mirrors))


def centre(plate, state):
    return places.evaluate(plate, state.deflection(), np.zeros((1, 2)))[0]
