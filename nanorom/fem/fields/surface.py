"""What fields ask of the film they are on: a mesh, a degree, mirrors, and spaces."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from nanorom.fem.fields.holding import Holding
from nanorom.fem.mesh.mesh import Domain
from nanorom.fem.symmetry import Mirrors
from nanorom.scene.elasticity import Law


class Surface(Protocol):
    """A meshed film, flat or in space, with a space for its deflections."""

    @property
    def domain(self) -> Domain:
        """The mesh and its tagged boundary."""

    @property
    def degree(self) -> int:
        """Of the deflections."""

    @property
    def mirrors(self) -> Mirrors:
        """Axes at which the domain is cut."""

    @property
    def deflections(self) -> Any:
        """Scalar Lagrange space."""

    @property
    def stretching_degree(self) -> int:
        """Quadrature degree for products of four slopes."""


class Elastic(Protocol):
    """What a film resists stretching with, in its own units."""

    @property
    def stretching(self) -> float:
        """E h."""

    @property
    def law(self) -> Law:
        """Stress by E of (xx, yy, 2 xy)."""

    @property
    def in_plane(self) -> Mapping[str, tuple[float, float]]:
        """Stiffness of the edges that are elastic in the plane."""


class Membrane(Surface, Protocol):
    """A flat film that also stretches in its plane."""

    @property
    def in_plane(self) -> Any:
        """Space of the in-plane displacement."""

    @property
    def stiffness(self) -> Elastic:
        """Of the material."""

    @property
    def holding(self) -> Holding:
        """Where and how supports hold the in-plane displacement."""

    def law_in(self, cells: np.ndarray) -> np.ndarray:
        """Membrane force (3, 3) of (xx, yy, 2 xy), where it differs (c, 3, 3) in local cells."""

    def on_mirror(self, axis: str) -> np.ndarray:
        """Local facets on the mirror of an axis."""

    def compiled(self, write: Callable[..., Any], switches: Sequence[Any] = ()) -> Any:
        """Form that one of its methods writes, ready to be assembled."""

    def plane_spring_form(self) -> Any:
        """Stiffness of the edges that are elastic in the plane."""
