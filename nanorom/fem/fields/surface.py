"""What fields ask of the film they are on: a mesh, a degree, mirrors, and spaces."""

from __future__ import annotations

from collections.abc import Callable
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
    material; held_in_plane, elastic_in_plane : (local nodes, 3) tensors of the directions in which
    supports hold it rigidly and elastically, see `holding`.
    """

    in_plane: Any
    nu: Any
    membrane_stiffness: Any
    held_in_plane: np.ndarray
    elastic_in_plane: np.ndarray

    def on_mirror(self, axis: str) -> np.ndarray:
        """Local facets on the mirror of an axis."""

    def compiled(self, write: Callable[[], Any]) -> Any:
        """Form that one of its methods writes, ready to be assembled."""

    def plane_spring_form(self) -> Any:
        """Stiffness of elastic edges in the plane."""

    @property
    def elastic(self) -> bool:
        """Some edges are held elastically in the plane."""
