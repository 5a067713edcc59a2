"""From the modes and tensors of a route to the reduced model in SI units."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from nanorom.fem.fields import quadrature
from nanorom.fem.modes.eigen import Modes
from nanorom.fem.solvers import compat
from nanorom.rom.heat import Heat
from nanorom.rom.model import ReducedModel
from nanorom.rom.shapes import Shapes
from nanorom.scene.scene import Scene


@attrs.frozen(eq=False, kw_only=True)
class Parts:
    """What a route makes of a scene, in SI units; L modes.

    frequency (L,) Hz; mass (L,) kg; label: L names; stiffness (L, L) N/m; quadratic (L, L, L)
    N/m^2; cubic and outside_cubic (L, L, L, L) N/m^3; patterns: the direct ones (L,) and the
    parametric ones (L, L) by name (`nanorom.rom.patterns.reduced`); viscous: parts of the force
    that a viscous material damps, by their names in the model; losses: 1/Q (L,) by what takes
    energy; heat: of a laser; method: of the tensors.
    """

    frequency: np.ndarray
    mass: np.ndarray
    label: list[str]
    stiffness: np.ndarray
    quadratic: np.ndarray
    cubic: np.ndarray
    patterns: tuple[dict[str, np.ndarray], dict[str, np.ndarray]]
    shapes: Shapes
    method: str
    diagnostics: dict[str, Any]
    in_plane: str = "free"
    outside_cubic: np.ndarray | None = None
    static: dict[str, np.ndarray] = attrs.field(factory=dict)
    viscous: dict[str, np.ndarray] = attrs.field(factory=dict)
    losses: dict[str, np.ndarray] = attrs.field(factory=dict)
    heat: Heat | None = None


def assembled(scene: Scene, parts: Parts, told: dict[str, Any]) -> ReducedModel:
    """The reduced model of a scene, with its damping; ``told`` is added to its diagnostics."""
    direct, parametric = parts.patterns
    model = ReducedModel(
        frequency=parts.frequency,
        mass=parts.mass,
        label=tuple(parts.label),
        number=np.array(scene.modes.numbers),
        stiffness=parts.stiffness,
        damping=np.zeros_like(parts.stiffness),
        quadratic=parts.quadratic,
        cubic=parts.cubic,
        outside_cubic=parts.outside_cubic,
        drive=direct,
        parametric=parametric,
        losses=parts.losses,
        heat=parts.heat,
        shapes=parts.shapes,
        static=parts.static,
        diagnostics=parts.diagnostics | told,
        scene=scene.to_toml(),
        method=parts.method,
        in_plane=parts.in_plane,
        versions=compat.versions(),
        bending=parts.viscous.get("bending"),
        stretching=parts.viscous.get("stretching"),
    )
    return model if scene.damping is None else model.with_damping(scene.damping)


@attrs.frozen
class ModalProducts:
    """Scaled integrals: Phi^T K Phi, int m phi^2, int m phi, int phi, int grad phi . grad phi."""

    stiffness: np.ndarray
    mass: np.ndarray
    momentum: np.ndarray
    area: np.ndarray
    slope: np.ndarray


def modal_products(modes: Modes) -> ModalProducts:
    """Modal matrices from the assembled operators, patterns by quadrature. Collective."""
    mass = modes.modal(dict.fromkeys(modes.parities, modes.mass))
    area, slope = pattern_integrals(modes)
    return ModalProducts(
        modes.modal_stiffness(), np.diag(mass).copy(), modes.momentum(), area, slope
    )


def pattern_integrals(modes: Modes) -> tuple[np.ndarray, np.ndarray]:
    """int phi (L,) and int grad phi . grad phi (L, L) over the whole film. Collective."""
    plate, shapes = modes.plate, modes.shapes
    n_modes = shapes.shape[1]
    comm, copies = plate.domain.comm, plate.mirrors.copies
    area, slope = np.zeros(n_modes), np.zeros((n_modes, n_modes))
    for field in quadrature.fields(plate, columns=2 * n_modes):
        area += np.einsum("cq,cqn->n", field.weights, field.value(shapes))
        gradient = field.gradient(shapes)
        weighted = gradient * field.weights[..., None, None]
        slope += np.einsum("cqdr,cqds->rs", gradient, weighted, optimize=True)
    slope, area = copies * comm.allreduce(slope), copies * comm.allreduce(area)
    parities = modes.parities
    slope[[[a != b for b in parities] for a in parities]] = 0.0
    area[[parity != plate.mirrors.even for parity in parities]] = 0.0
    return area, slope
