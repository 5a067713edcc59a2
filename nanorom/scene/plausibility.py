"""What a scene's numbers say of each other: what cannot be, and what is worth a second look.

All estimates are generous by a factor of several: what they refuse is out of a model's range by
far, most often by a unit.
"""

from __future__ import annotations

import numpy as np

from nanorom.errors import SceneError
from nanorom.scene.gate import KEY as GATE
from nanorom.scene.geometry import Disc, Rectangle, String
from nanorom.scene.patterns import PARAMETRIC
from nanorom.scene.scene import Scene
from nanorom.scene.units import with_unit
from nanorom.scene.wrinkles import KEY as SHAPE
from nanorom.scene.wrinkles import Wrinkles

THICKEST = 0.5  # of the film's width: beyond it nothing is left of a film
THICK = 0.1  # from here on transverse shear, which films lack, is no small correction
FARTHEST = 1.0  # gap by width: two plates farther apart are none to each other
FINEST = 1e-4  # of the film's length: smaller cells are too many for any machine
STEEPEST = 0.5  # of wrinkles: slope of films that are taken for shallow
DEEPEST = 0.5  # deflection by half width: slopes near 1, strains of tens of per cent
STRAINED = 0.01  # of the tension: few materials bear more
FREQUENCIES = 1.0, 100e9  # Hz
DENSITIES = 100.0, 25e3  # kg/m^3, from foams to osmium
LONGEST = 10.0  # m
OUT_OF_REACH = 100.0  # times the lowest frequency, to its order of magnitude, either way
CLAMPED_DISC = 14.682  # critical compression of a clamped disc by D/R^2

Span = tuple[float, float]  # shorter and longer side of the film, in m


def span_of(scene: Scene) -> Span | None:
    """Sides of the rectangle about the film, None for a mesh file, which is not yet read."""
    geometry = scene.geometry
    if isinstance(geometry, Disc):
        return 2 * geometry.radius, 2 * geometry.radius
    if not isinstance(geometry, Rectangle):
        return None
    return min(geometry.length, geometry.width), max(geometry.length, geometry.width)


def check(scene: Scene, span: Span) -> None:
    """Raise SceneError for a film that cannot be one, or a load that would burst it."""
    _check_lengths(scene, span)
    across = span[1] if isinstance(scene.geometry, String) else span[0]
    thickness = scene.plate.thickness
    scale = ", geometry.scale" if scene.geometry.shape == "mesh" else ""
    thin = scene.plate.rules.thin
    if thin and thickness > THICKEST * across:
        raise SceneError(
            f"plate.thickness: found {with_unit(thickness, 'm', 6)} on a film of "
            f"{with_unit(across, 'm', 6)}; allowed: less than "
            f"{THICKEST:g} of that, and a tenth is thick; check the units of both{scale}"
        )
    load = scene.load
    if not scene.plate.rules.shallow or load is None:
        return
    stretch, half = scene.material.youngs_modulus * thickness, across / 2
    loads = {"pressure": (load.pressure, half**2, "Pa"), "force": (load.force, 1.0, "N")}
    for key, (value, area, unit) in loads.items():
        depth = _depth(scene, abs(value or 0.0) * area, half)
        if depth > DEEPEST * half:
            most = (DEEPEST * half / depth) ** 3 * abs(value or 0.0)
            raise SceneError(
                f"load.{key}: found {with_unit(value or 0.0, unit, 6)}, which would deflect a film "
                f"of E h = {with_unit(stretch, 'N/m', 3)} by about {depth / half:.1g} of its half "
                "width: it bursts, and the model ends far below; allowed: up to about "
                f"{with_unit(most, unit, 1)}; check the units"
            )


def _check_lengths(scene: Scene, span: Span) -> None:
    """Raise SceneError for a length beside the film that its width or thickness rules out."""
    across = span[1] if isinstance(scene.geometry, String) else span[0]
    thickness, shape = scene.plate.thickness, scene.plate.initial_shape
    width = f"the film's width, {with_unit(across, 'm', 6)}"
    apart = FARTHEST * across, f"{width}, as plates farther apart are none"
    limits = [
        ("load.gap" if scene.load and scene.load.gates is None else f"{GATE}.gap", gate.gap, *apart)
        for gate in (scene.load.electrodes if scene.load else ())
    ]
    if scene.gas is not None and scene.gas.gap is not None:
        limits.append(("gas.gap", scene.gas.gap, *apart))
    for number, region in enumerate(scene.regions, 1):
        thick = thickness if region.thickness is None else region.thickness
        both = f"{with_unit(thickness + thick, 'm', 6)}, with which it would lie beside the film"
        limits.append((f"region {number}: thickness", thick, THICKEST * across, f"half of {width}"))
        limits.append((f"region {number}: offset", region.offset, thickness + thick, both))
    if isinstance(shape, Wrinkles) and scene.plate.rules.shallow:
        steepest = STEEPEST * shape.correlation
        why = f"{with_unit(steepest, 'm', 3)}, where slopes are no longer small"
        limits.append((f"{SHAPE}.amplitude", shape.amplitude, steepest, why))
    for key, length, most, why in limits:
        if abs(length) > most:
            raise SceneError(
                f"{key}: found {with_unit(length, 'm', 6)}; allowed: less than {why}; check the "
                "units"
            )
    size = scene.accuracy.mesh_size
    if size is not None and size < FINEST * span[1]:
        raise SceneError(
            f"accuracy.mesh_size: found {with_unit(size, 'm', 6)}; allowed: {FINEST:g} of the "
            f"film's length, {with_unit(span[1], 'm', 6)}, or more; check the units"
        )


def _depth(scene: Scene, force: float, half: float) -> float:
    """Deflection under a force in all, from below: by stretching, or by tension and bending."""
    stretch = scene.material.youngs_modulus * scene.plate.thickness
    bending = stretch * scene.plate.thickness**2 / 12
    linear = max(scene.tension.largest, 0.0) + 16 * bending / half**2
    stiff = 0.6 * half * (force / (stretch * half)) ** (1 / 3)
    return min(stiff, force / (4 * linear))


def notes(scene: Scene, span: Span) -> list[str]:
    """Remarks on a scene that is valid and may not be meant, one line each."""
    material, thickness = scene.material, scene.plate.thickness
    across, along = (span[1],) * 2 if isinstance(scene.geometry, String) else span
    found = []
    if scene.plate.rules.thin and thickness > THICK * across:
        found.append(
            f"plate.thickness: {with_unit(thickness, 'm', 6)} is {thickness / across:.2g} of the "
            "film's width; transverse shear, which is left out, matters from a tenth on"
        )
    strain = scene.tension.largest * (1 - material.poisson_ratio)
    strain /= material.youngs_modulus * thickness
    if strain > STRAINED:
        found.append(f"tension: strains the film by {strain:.2g}, more than {STRAINED:g}")
    if along > LONGEST:
        found.append(f"geometry: the film is {with_unit(along, 'm')} long; were other units meant?")
    if not DENSITIES[0] <= material.density <= DENSITIES[1]:
        found.append(
            f"material.density: {material.density:g} kg/m^3 is none of a solid; 1 g/cm^3 is 1000"
        )
    frequency = _frequency(scene, across)
    if not FREQUENCIES[0] <= frequency <= FREQUENCIES[1]:
        found.append(
            f"frequencies: the lowest will be of the order of {with_unit(frequency, 'Hz', 1)}, "
            f"outside {' to '.join(with_unit(f, 'Hz') for f in FREQUENCIES)}; were other units "
            "meant?"
        )
    found += _excited(scene, frequency)
    critical = _buckles(scene)
    if critical is not None:
        found.append(
            f"tension: found {with_unit(scene.tension.x, 'N/m', 6)} and "
            f"{with_unit(scene.tension.y, 'N/m', 6)}; the flat film buckles under any "
            f"compression beyond {with_unit(critical, 'N/m', 3)}, however it is held"
        )
    return found


def _excited(scene: Scene, frequency: float) -> list[str]:
    """Remarks on drive and sweep, given the order of magnitude of the lowest frequency in Hz."""
    found = []
    drive, sweep, largest = scene.drive, scene.sweep, scene.tension.largest
    if drive is not None and PARAMETRIC[drive.parametric_pattern].unit == "N/m":
        level = max(drive.parametric)
        if 0 < largest < level and scene.load is None:
            found.append(
                f"drive.parametric: modulates the tension by {with_unit(level, 'N/m', 6)}, more "
                f"than the {with_unit(largest, 'N/m', 6)} that there is: the film is slack in "
                "part of every period, and a response may end at one of its budgets; was mN/m "
                "meant?"
            )
    for key, end in () if sweep is None else (("from", sweep.start), ("to", sweep.stop)):
        ratio = end.hertz(frequency) / frequency
        if not 1 / OUT_OF_REACH <= ratio <= OUT_OF_REACH:
            found.append(
                f"sweep.{key}: {end} is of the order of {ratio:.1g} times the lowest frequency, "
                f"far from where anything happens; was another unit than Hz meant?"
            )
    return found


def _frequency(scene: Scene, across: float) -> float:
    """Of the lowest mode, to its order of magnitude, in Hz."""
    wave = np.pi / across
    stretch = scene.material.youngs_modulus * scene.plate.thickness
    bending = 0.0 if scene.plate.bends is False else stretch * scene.plate.thickness**2 / 12
    square = max(scene.tension.largest, 0.0) * wave**2 + bending * wave**4
    return float(np.sqrt(square / (scene.material.density * scene.plate.thickness)) / (2 * np.pi))


def _buckles(scene: Scene) -> float | None:
    """Mean compression in N/m beyond which a flat film certainly buckles, if it is beyond it.

    By Rayleigh's quotient of a shape that is clamped all around: any other edge buckles before.
    """
    geometry, load = scene.geometry, scene.load
    uneven = scene.plate.initial_shape is not None or scene.tension.variation is not None
    if uneven or not isinstance(geometry, (Disc, Rectangle)):
        return None
    if load is not None and load.deflects:
        return None
    change = 0.0 if load is None else (load.stress or 0.0) * scene.plate.thickness
    x, y = scene.tension.x + change, scene.tension.y + change
    stretch = scene.material.youngs_modulus * scene.plate.thickness
    bending = stretch * scene.plate.thickness**2 / (12 * (1 - scene.material.poisson_ratio**2))
    if isinstance(geometry, Disc):
        critical, mean = CLAMPED_DISC * bending / geometry.radius**2, -(x + y) / 2
    else:  # w = (1 - cos(p x)) (1 - cos(q y))
        p, q = ((2 * np.pi / side) ** 2 for side in (geometry.length, geometry.width))
        critical = bending * (3 * p**2 + 3 * q**2 + 2 * p * q) / (3 * (p + q))
        mean = -(x * p + y * q) / (p + q)
    return float(critical) if mean > critical else None
