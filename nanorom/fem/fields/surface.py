"""What fields ask of the film they are on: a mesh, a degree, mirrors, and spaces."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from nanorom.fem.mesh.mesh import Domain
from nanorom.fem.symmetry import Mirrors


class Surface(Protocol):
    """A meshed film, flat or in space, with a space for its deflections.

    domain : the mesh and its tagged boundary; degree : of the deflections; mirrors : axes at which
    the domain is cut; deflections : scalar Lagrange space; stretching_degree : of the quadrature.
    """

    domain: Domain
    degree: int
    mirrors: Mirrors
    deflections: Any

    @property
    def stretching_degree(self) -> int:
        """Quadrature degree for products of four slopes."""


class Membrane(Surface, Protocol):
    """A flat film that also stretches in its plane.

    in_plane : space of the in-plane displacement; nu, membrane_stiffness : constants of the
    material; supported : local facets where the in-plane displacement is held.
    """

    in_plane: Any
    nu: Any
    membrane_stiffness: Any
    supported: np.ndarray

    def on_mirror(self, axis: str) -> np.ndarray:
        """Local facets on the mirror of an axis."""
