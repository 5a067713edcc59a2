"""From a scene to its reduced model: steps I to IV of the paper in order."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import attrs
import numpy as np
from mpi4py import MPI

from nanorom.errors import SceneError
from nanorom.fem import compat, condensation, discretisation, drawing, labels, mesh, quadrature
from nanorom.fem import modes as eigen
from nanorom.fem import step as stiffness_evaluation
from nanorom.fem.modes import Modes
from nanorom.fem.plate import Plate
from nanorom.fem.shapes import normalise
from nanorom.fem.symmetry import Mirrors, line
from nanorom.rom import ReducedModel, Shapes
from nanorom.scene import Disc, MeshFile, Rectangle, Scene

Progress = Callable[[str, int, int], None]  # stage, done, of how many


@attrs.frozen
class Scales:
    """Units in which a scene is computed: SI value = unit x non-dimensional value.

    length in m, tension in N/m, mass in kg, cubic in N/m^3; bending is D/(tension length^2).
    """

    length: float
    tension: float
    mass: float
    cubic: float
    bending: float

    @classmethod
    def of(cls, scene: Scene) -> Scales:
        """Scales of a scene; a film without tension is measured by its bending stiffness."""
        geometry, material, h = scene.geometry, scene.material, scene.plate.thickness
        if isinstance(geometry, Disc):
            length = geometry.radius
        else:
            length = geometry.scale if isinstance(geometry, MeshFile) else geometry.length
        stretch = material.youngs_modulus * h
        bending = 0.0
        if scene.plate.model != "membrane":
            bending = stretch * h**2 / (12 * (1 - material.poisson_ratio**2)) / length**2
        tension = max(abs(scene.tension.x), abs(scene.tension.y), bending)
        mass = material.density * h * length**2
        return cls(length, tension, mass, stretch / length**2, bending / tension)

    def frequency(self, eigenvalues: np.ndarray) -> np.ndarray:
        """Frequencies in Hz of eigenvalues of the scaled problem."""
        return np.sqrt(eigenvalues * self.tension / self.mass) / (2 * np.pi)


class Stopwatch:
    """Wall time by stage, and the caller told when a stage begins."""

    def __init__(self, progress: Progress | None) -> None:
        self.seconds: dict[str, float] = {}
        self._progress = progress

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time what happens inside."""
        self.tell(name, 0, 1)
        start = time.perf_counter()
        yield
        self.seconds[name] = time.perf_counter() - start
        self.tell(name, 1, 1)

    def tell(self, name: str, done: int, total: int) -> None:
        """Report progress within a stage."""
        if self._progress is not None:
            self._progress(name, done, total)


def reduce_scene(
    scene: Scene, progress: Progress | None = None, comm: MPI.Comm = MPI.COMM_WORLD
) -> ReducedModel:
    """Reduced model of a scene. Collective: every rank gets the same model.

    Raises SceneError, MeshError or SolverError with one line that names the cause.
    """
    scales = Scales.of(scene)
    watch = Stopwatch(progress)
    layer = np.sqrt(scales.bending * scales.tension / max(scene.tension.x, scene.tension.y, 1e-300))
    # a static load case of STEP mixes modes of every parity: it needs the whole film
    chosen = attrs.evolve(
        discretisation.choose(scene, scales.length, float(layer)),
        whole=scene.reduction.method != "direct",
    )
    with watch.stage("mesh"):
        plate = build_plate(comm, scene, scales, chosen)
    with watch.stage("modes"):
        modes = eigen.solve(plate, scene.modes.highest)
        modes, names = name(scene, modes)
        modes = normalise(modes)
    selected = np.array(scene.modes.numbers) - 1
    modes = modes.take(selected)
    with watch.stage("tensors"):
        quadratic, cubic, diagnostics = tensors(scene, scales, modes, watch)
    with watch.stage("patterns"):
        products = modal_products(modes)
        points, cells, values = drawing.triangulation(modes)
    diagnostics |= {
        "dofs": int(plate.deflections.dofmap.index_map.size_global),
        "cells": int(plate.domain.mesh.topology.index_map(2).size_global),
        "degree": chosen.degree,
        "geometry_order": chosen.order,
        "ranks": comm.size,
        **{f"seconds_{stage}": seconds for stage, seconds in watch.seconds.items()},
    }
    stiffness = scales.tension * products.stiffness
    mass = scales.mass * products.mass
    frequency = scales.frequency(modes.eigenvalues)
    damping = np.zeros_like(stiffness)
    if scene.damping is not None:
        quality = np.array(scene.damping.per_mode(len(mass)))
        damping = np.diag(2 * np.pi * frequency * mass / quality)
    pressure = scales.length**2 * products.area
    return ReducedModel(
        frequency=frequency,
        mass=mass,
        label=tuple(names[i] for i in selected),
        number=selected + 1,
        stiffness=stiffness,
        damping=damping,
        quadratic=quadratic,
        cubic=cubic,
        drive={"pressure": pressure},
        parametric={"tension": -products.slope, "paper": np.diag(pressure)},
        shapes=Shapes(points * scales.length, cells, values),
        diagnostics=diagnostics,
        scene=scene.to_toml(),
        method=scene.reduction.method,
        in_plane=scene.reduction.in_plane,
        versions=compat.versions(),
    )


def build_plate(
    comm: MPI.Comm, scene: Scene, scales: Scales, chosen: discretisation.Discretisation
) -> Plate:
    """Mesh the scene and set up its plate with the scaled parameters. Collective."""
    whole, part = (chosen.mirrors, Mirrors()) if chosen.whole else (Mirrors(), chosen.mirrors)
    domain = mesh.build(comm, chosen.file, chosen.parameters, chosen.order, chosen.grading, whole)
    kinds = boundary_kinds(scene, list(domain.facets), part)
    by_kind = {kind: [s for s, k in kinds.items() if k == kind] for kind in set(kinds.values())}
    plate = Plate(
        domain,
        chosen.degree,
        clamped=by_kind.get("clamped", []),
        pinned=by_kind.get("simply_supported", []),
        bending=scales.bending > 0,
        mirrors=part,
    )
    plate.tension_x.value = scene.tension.x / scales.tension
    plate.tension_y.value = scene.tension.y / scales.tension
    plate.bending_stiffness.value = scales.bending
    plate.nu.value = scene.material.poisson_ratio
    return plate


def boundary_kinds(scene: Scene, tags: list[str], mirrors: Mirrors) -> dict[str, str]:
    """Kind of support of every boundary curve of the mesh but the mirrors; raises SceneError."""
    tags = [tag for tag in tags if tag not in map(line, mirrors.axes)]
    for side in scene.support.named:
        if side not in tags and isinstance(scene.geometry, MeshFile):
            raise SceneError(
                f"support.{side}: the mesh has no boundary of that name; "
                f"allowed: {', '.join(sorted(tags)) or 'none, as it has no physical curves'}"
            )
    kinds = {tag: scene.support.kind(tag) for tag in tags}
    if all(kind == "free" for kind in kinds.values()):
        raise SceneError(
            "support: no boundary of the mesh is held; name a physical curve of the mesh "
            "and give it a kind"
        )
    return kinds


def name(scene: Scene, modes: Modes) -> tuple[Modes, list[str]]:
    """Orient degenerate modes and name all of them by the scene's shape. Collective."""
    if isinstance(scene.geometry, Disc):
        return labels.name_drum(modes, scene.tension.x == scene.tension.y)
    if isinstance(scene.geometry, Rectangle):
        free = {side: kind == "free" for side, kind in scene.supports.items()}
        return labels.name_rectangle(
            modes, free_x=free["left"] and free["right"], free_y=free["bottom"] and free["top"]
        )
    return labels.name_by_number(modes)


def tensors(
    scene: Scene, scales: Scales, modes: Modes, watch: Stopwatch
) -> tuple[np.ndarray, np.ndarray, dict[str, float]]:
    """Quadratic (N/m^2) and cubic (N/m^3) tensors and what is known of their error. Collective."""
    plate, count = modes.plate, modes.shapes.shape[1]
    in_plane = scene.reduction.in_plane
    if scene.reduction.method == "direct":
        cubic = condensation.cubic_tensor(modes, in_plane)
        asymmetry = 0.0
        quadratic = np.zeros((count,) * 3)
        return quadratic, scales.cubic * cubic, {"asymmetry": asymmetry}
    amplitude = scene.reduction.amplitude or scene.plate.thickness
    # with deflections in units of the amplitude, stretching is measured against the tension
    strength = scales.cubic * amplitude**2 / scales.tension
    plate.membrane_stiffness.value = strength
    result = stiffness_evaluation.step(
        modes, count, 1.0, in_plane, lambda i, n: watch.tell("load cases", i, n)
    )
    quadratic = scales.tension / amplitude * result.quadratic
    cubic = scales.cubic / strength * result.cubic
    found = {"asymmetry": result.asymmetry, "load_cases": result.n_cases, "amplitude": amplitude}
    return quadratic, cubic, found


@attrs.frozen
class ModalProducts:
    """Scaled integrals of the modes: Phi^T K Phi, int phi^2, int phi, int grad phi . grad phi."""

    stiffness: np.ndarray
    mass: np.ndarray
    area: np.ndarray
    slope: np.ndarray


def modal_products(modes: Modes) -> ModalProducts:
    """Modal matrices from the assembled operators, patterns by quadrature. Collective."""
    plate, shapes = modes.plate, modes.shapes
    n_modes, n_owned = shapes.shape[1], modes.n_owned
    comm, copies = plate.domain.comm, plate.mirrors.copies
    area, slope = np.zeros(n_modes), np.zeros((n_modes, n_modes))
    for field in quadrature.fields(plate, columns=2 * n_modes):
        area += np.einsum("cq,cqn->n", field.weights, field.value(shapes))
        gradient = field.gradient(shapes)
        weighted = gradient * field.weights[..., None, None]
        slope += gradient.reshape(-1, n_modes).T @ weighted.reshape(-1, n_modes)
    stiff, heavy = np.empty((n_owned, n_modes)), np.empty((n_owned, n_modes))
    x, y = modes.mass.createVecRight(), modes.mass.createVecLeft()
    for i, parity in enumerate(modes.parities):
        x.array[:] = shapes[:n_owned, i]
        for matrix, columns in ((modes.stiffness[parity], stiff), (modes.mass, heavy)):
            matrix.mult(x, y)
            columns[:, i] = y.array
    owned = shapes[:n_owned]
    products = np.stack([owned.T @ stiff, owned.T @ heavy, slope])
    stiffness, mass, slope = copies * comm.allreduce(products) * same_parity(modes)
    area = copies * comm.allreduce(area)
    area[[parity != plate.mirrors.even for parity in modes.parities]] = 0.0
    return ModalProducts(0.5 * (stiffness + stiffness.T), np.diag(mass).copy(), area, slope)


def same_parity(modes: Modes) -> np.ndarray:
    """1 where two modes are of one parity, 0 where their product integrates to zero."""
    return np.array([[float(a == b) for b in modes.parities] for a in modes.parities])
