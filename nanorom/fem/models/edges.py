"""What the forms of a plate are about: its edges, and its numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np
from dolfinx import fem

from nanorom.fem.mesh.mesh import Domain
from nanorom.fem.models.patchwork import Patchwork
from nanorom.fem.models.state import State, Stiffness
from nanorom.fem.solvers import compat
from nanorom.fem.symmetry import Mirrors, line
from nanorom.scene import elasticity


@attrs.frozen(eq=False)
class Edges:
    """Integration over edges: the clamped one, mirrors, elastic ones, and those in the plane."""

    clamped: Any
    mirrors: Sequence[Any]
    elastic: Sequence[Any]
    in_plane: Sequence[Any]

    @classmethod
    def of(
        cls,
        domain: Domain,
        clamped: np.ndarray,
        mirrors: Mirrors,
        stiffness: Stiffness,
        degree: int,
    ) -> Edges:
        """With a quadrature of a degree."""
        named = [*(line(axis) for axis in mirrors.axes), *stiffness.springs]
        groups = [clamped, *(domain.facets_of([name]) for name in named)]
        others = [domain.facets_of([name]) for name in stiffness.in_plane]
        first, *rest = compat.facet_measures(
            domain.mesh, groups, {"quadrature_degree": degree}, others
        )
        n, m = len(mirrors.axes), len(named)
        return cls(first, rest[:n], rest[n:m], rest[m:])


@attrs.frozen(eq=False)
class Constants:
    """Numbers of a plate as forms hold them.

    law, bending_law: (3, 3); stiffest: of bending, by D along any direction; density: mass per
    area by rho h; springs: transverse and rotational, in_plane: normal and tangential, by edge.
    """

    tension_x: Any
    tension_y: Any
    shear: Any
    bending: Any
    law: Any
    bending_law: Any
    stiffest: Any
    stretching: Any
    density: Any
    springs: Sequence[Any]
    in_plane: Sequence[Any]

    @classmethod
    def of(
        cls, mesh: Any, stiffness: Stiffness, state: State, patchwork: Patchwork | None = None
    ) -> Constants:
        """Those of a stiffness and a state; laws and density are fields on a patchwork."""
        x, y = state.tension
        springs = [np.array([k or 0.0, turning]) for k, turning in stiffness.springs.values()]
        if patchwork is not None:
            law, bending_law = patchwork.matrix(patchwork.law), patchwork.matrix(patchwork.moments)
            stiffest, density = patchwork.field(patchwork.stiffest), patchwork.field(patchwork.mass)
        else:
            law = fem.Constant(mesh, np.array(stiffness.law))
            bending_law = fem.Constant(mesh, np.array(stiffness.bending_law))
            stiffest = fem.Constant(mesh, elasticity.stiffest(stiffness.bending_law))
            density = None
        return cls(
            tension_x=fem.Constant(mesh, float(x)),
            tension_y=fem.Constant(mesh, float(y)),
            shear=fem.Constant(mesh, float(state.shear)),
            bending=fem.Constant(mesh, float(stiffness.bending)),
            law=law,
            bending_law=bending_law,
            stiffest=stiffest,
            stretching=fem.Constant(mesh, float(stiffness.stretching)),
            density=density,
            springs=[fem.Constant(mesh, spring) for spring in springs],
            in_plane=[fem.Constant(mesh, np.array(k)) for k in stiffness.in_plane.values()],
        )

    @property
    def all(self) -> list[Any]:
        """One after the other."""
        numbers = [self.tension_x, self.tension_y, self.shear, self.bending, self.stretching]
        laws = [self.law, self.bending_law, self.stiffest]
        return [*numbers, *laws, *self.springs, *self.in_plane]
