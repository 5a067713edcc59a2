"""What the sections of a scene say together of its film: combinations that make no sense."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nanorom.errors import SceneError
from nanorom.scene.geometry import Disc
from nanorom.scene.parted import check_gates, check_place, check_regions
from nanorom.scene.request import HIGHEST_DEGREE
from nanorom.scene.support import Edge, deflection_of
from nanorom.scene.units import with_unit
from nanorom.scene.wrinkles import Unevenness

if TYPE_CHECKING:
    from nanorom.scene.scene import Scene


def check_film(scene: Scene) -> None:
    """Raise SceneError where model, tension and supports of a scene do not go together."""
    tension, support, degree = scene.tension, scene.support, scene.accuracy.degree
    model, rules = scene.plate.model, scene.plate.rules
    kinds = [support.kind(side) for side in scene.geometry.sides] or support.kinds
    if all(deflection_of(kind) == "free" for kind in kinds):
        _check_free(scene, all(kind == "free" for kind in kinds))
    if rules.bends is False and not tension.smallest > 0:
        pulls = {"x": tension.x, "y": tension.y} | ({"xy": tension.xy} if tension.xy else {})
        found = ", ".join(f"{key} = {with_unit(pull, 'N/m', 6)}" for key, pull in pulls.items())
        raise SceneError(
            f"tension: found {found}; allowed: greater than 0 in every direction for a {model}"
        )
    _check_material(scene)
    _check_masses(scene)
    check_regions(scene)
    check_gates(scene)
    load = scene.load
    if load is not None and load.force is not None:
        check_place(scene.geometry, "load.position", load.position, load.radius)
    _check_frame(scene)
    if degree is not None and degree < rules.lowest_degree:
        raise SceneError(
            f"accuracy.degree: found {degree}; allowed: {rules.lowest_degree} to {HIGHEST_DEGREE} "
            f"for a {model}"
        )
    if tension.variation is not None and not (rules.planar and rules.shallow):
        raise SceneError(
            f"tension.variation: found beside plate.model = {model}; allowed: plate, membrane"
        )
    if isinstance(tension.variation, Unevenness) and rules.bends is False:
        if not tension.variation.amplitude < tension.smallest:
            raise SceneError(
                "tension.variation.amplitude: found "
                f"{with_unit(tension.variation.amplitude, 'N/m', 6)}; allowed: less than "
                f"the tension, {with_unit(tension.smallest, 'N/m', 6)}, for a {model}"
            )
    if not rules.planar and tension.xy:
        raise SceneError(
            f"tension.xy: found {with_unit(tension.xy, 'N/m', 6)} beside plate.model = {model}; "
            "allowed: 0, or plate.model = plate"
        )
    if not rules.planar and any(isinstance(kind, Edge) for kind in kinds):
        raise SceneError(
            f"support.in_plane: found beside plate.model = {model}; allowed: clamped | "
            "simply_supported | free, or plate.model = plate"
        )
    if support.springs and not rules.springs:
        raise SceneError(
            f"support: found springs beside plate.model = {model}; "
            "allowed: clamped | simply_supported | free"
        )
    if rules.bends is False and any(s.rotational for s in support.springs):
        raise SceneError(
            f"support.rotational: found beside plate.model = {model}, which has no bending "
            "stiffness to turn it; allowed: a transverse spring"
        )


def check_source(scene: Scene) -> None:
    """Raise SceneError for a drive that the film does not feel, a readout that does not see it."""
    drive, load, readout = scene.drive, scene.load, scene.readout
    if readout is not None and readout.position is not None:
        check_place(scene.geometry, "readout.position", readout.position)
    if drive is None:
        return
    if drive.voltage is not None:
        gates = () if load is None else load.electrodes
        if not gates:
            raise SceneError(
                "drive.voltage: found without a gate; allowed beside load.gap and load.voltage, or "
                "[[load.gate]]"
            )
        if drive.electrode > len(gates):
            raise SceneError(
                f"drive.gate: found {drive.electrode}; allowed: 1 to {len(gates)}, a gate of [load]"
            )
    if drive.position is not None:
        check_place(scene.geometry, "drive.position", drive.position)
    if drive.laser is None:
        return
    if not scene.material.thermal:
        raise SceneError(
            "drive.laser: found for a material whose heat is not known; allowed beside "
            "material.expansion, conductivity and specific_heat"
        )
    if not (scene.plate.rules.planar and scene.plate.rules.shallow):
        raise SceneError(
            f"drive.laser: found beside plate.model = {scene.plate.model}; allowed: plate, membrane"
        )


def _check_material(scene: Scene) -> None:
    """What a model of the film does not know of a material."""
    model, rules = scene.plate.model, scene.plate.rules
    material = scene.material
    bends = rules.bends is not False
    told = {
        "material.shear_modulus": (material.crystalline, rules.planar, "plate or membrane"),
        "material.bending": (material.bending is not None, rules.planar and bends, "plate"),
        "material.loss": (material.loss > 0, rules.shallow and bends, "plate or beam"),
        "material.expansion": (material.thermal, rules.shallow, "any other"),
        "gas": (scene.gas is not None, rules.shallow, "any other"),
        "gas.gap": (
            scene.gas is not None and scene.gas.gap is not None,
            rules.planar and rules.shallow,
            "plate or membrane",
        ),
    }
    for key, (given, known, allowed) in told.items():
        if given and not known:
            raise SceneError(f"{key}: found beside plate.model = {model}; allowed: {allowed}")


def _check_masses(scene: Scene) -> None:
    """Masses that are not on the film, or on one that does not bear them."""
    model, rules = scene.plate.model, scene.plate.rules
    for mass in scene.masses:
        if not (rules.planar and rules.shallow):
            raise SceneError(f"mass: found beside plate.model = {model}; allowed: plate, membrane")
        if mass.radius == 0 and rules.bends is False:
            raise SceneError(
                f"mass.radius: found 0 beside plate.model = {model}, which does not bear a point "
                "mass; allowed: greater than 0, or plate.model = plate"
            )
        check_place(scene.geometry, "mass.position", mass.position, mass.radius)


def _check_free(scene: Scene, in_plane: bool) -> None:
    """A film whose deflection nothing holds: its rigid motions have no frequency.

    in_plane : nothing holds it in its plane either.
    """
    hold = "hold at least one side"
    if in_plane and scene.plate.bends is False or not scene.plate.rules.planar:
        raise SceneError(
            f"support.edge: every side is free beside plate.model = {scene.plate.model}; {hold}, "
            "or let the model be plate"
        )
    if in_plane and any((scene.tension.x, scene.tension.y, scene.tension.xy)):
        raise SceneError(
            f"support.edge: every side is free, and a free film bears no tension; {hold}, or "
            "leave out [tension]"
        )
    if not scene.flat:
        what = "load" if scene.load is not None else "plate.initial_shape"
        raise SceneError(f"support.edge: every side is free beside {what}; {hold}")


def _check_frame(scene: Scene) -> None:
    """Raise SceneError for films whose pull on a frame that gives way is not computed."""
    if scene.support.impedance is None:
        return
    model, rules = scene.plate.model, scene.plate.rules
    if not rules.shallow:
        raise SceneError(
            f"support.impedance: found beside plate.model = {model}; allowed: plate, membrane "
            "or beam"
        )
    bent = scene.load is not None and scene.load.deflects
    if bent or scene.plate.initial_shape is not None:
        what = "a load that deflects" if bent else "plate.initial_shape"
        raise SceneError(f"support.impedance: found beside {what}; allowed: films that are flat")
    turning = [
        k for k in map(deflection_of, scene.supports.values()) if k not in ("clamped", "free")
    ]
    corners = rules.planar and not isinstance(scene.geometry, Disc)
    if turning and corners and rules.bends is not False:
        raise SceneError(
            "support.impedance: found beside simply supported or elastic sides, whose corners pull "
            "with forces at a point; allowed: clamped or free sides, a disc, or plate.model = "
            "membrane"
        )
