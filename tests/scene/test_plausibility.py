"""Numbers of a scene that do not go together are refused or remarked on, with the key to blame."""

import re

import attrs
import pytest

from nanorom.errors import SceneError
from nanorom.scene import plausibility
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Damping, Sweep
from nanorom.scene.gate import Gate
from nanorom.scene.load import Load
from nanorom.scene.material import Gas
from nanorom.scene.outlines import DiscRegion
from nanorom.scene.request import Accuracy
from nanorom.scene.scene import (
    Disc,
    Material,
    Modes,
    Plate,
    Rectangle,
    Scene,
    String,
    Support,
    Tension,
)
from nanorom.scene.wrinkles import Wrinkles

DRUM = Scene(
    geometry=Disc(radius="2.5 um"),
    plate=Plate(thickness="10 nm"),
    material=Material(youngs_modulus="410 GPa", poisson_ratio=0.16, density="2267 kg/m^3"),
    tension=Tension("0.321 N/m", "0.257 N/m"),
    modes=Modes(count=11),
)
STRING = attrs.evolve(
    DRUM,
    geometry=String(length="1 mm", width="10 um"),
    plate=Plate(thickness="100 nm"),
    tension=Tension("100 N/m", "0 N/m"),
)


def excited(drive, sweep=None):
    """What makes a driven scene of the drum."""
    sweep = sweep or Sweep("0.8 f1", "2.9 f1")
    return {"drive": drive, "sweep": sweep, "damping": Damping(quality_factor=180)}


def thick(thickness, **offset):
    """A region in the middle of the drum."""
    return DiscRegion(radius="1 um", thickness=thickness, **offset)


def wrinkled(amplitude, correlation):
    return Plate("10 nm", initial_shape=Wrinkles(amplitude, correlation))


def noted(scene):
    span = plausibility.span_of(scene)
    plausibility.check(scene, span)
    return plausibility.notes(scene, span)


PAPER = attrs.evolve(DRUM, **excited(Drive("40 Pa", "6 mN/m"), Sweep("19 MHz", "90 MHz")))


@pytest.mark.parametrize(
    "scene", [DRUM, STRING, PAPER, attrs.evolve(DRUM, load=Load(pressure="1 MPa"))]
)
def test_devices_are_not_remarked_on(scene):
    assert noted(scene) == []


@pytest.mark.parametrize(
    ("changes", "key", "told"),
    [
        ({"plate": Plate(thickness="10 um")}, "plate.thickness", "10 µm on a film of 5 µm"),
        ({"plate": Plate(thickness="5 mm")}, "plate.thickness", "check the units"),
        ({"load": Load(pressure="10 GPa")}, "load.pressure", "it bursts"),
        ({"load": Load(force="1 N")}, "load.force", "it bursts"),
        ({"load": Load(voltage=1, gap="220 mm")}, "load.gap", "220 mm; .* width, 5 µm"),
        ({"load": Load(gates=Gate("-220 mm", 1))}, "load.gate.gap", "-220 mm; .* width, 5 µm"),
        ({"gas": Gas(pressure="1 kPa", gap="6 um")}, "gas.gap", "6 µm; .* width, 5 µm"),
        ({"regions": [thick("3 um")]}, "region 1: thickness", "3 µm; .* half of .* width"),
        ({"regions": [thick("20 nm", offset="-31 nm")]}, "region 1: offset", "-31 nm; .* 30 nm"),
        (
            {"plate": wrinkled("60 nm", "0.1 um")},
            "plate.initial_shape.amplitude",
            "60 nm; .* 50 nm",
        ),
        (
            {"accuracy": Accuracy(degree=4, mesh_size=1e-30)},
            "accuracy.mesh_size",
            "1e-30 m; .* 5 µm",
        ),
    ],
)
def test_what_cannot_be_is_refused_by_its_key(changes, key, told):
    with pytest.raises(SceneError, match=told) as raised:
        noted(attrs.evolve(DRUM, **changes))
    assert str(raised.value).startswith(f"{key}: found")


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"plate": Plate(thickness="1 um")}, "plate.thickness: .* transverse shear"),
        ({"tension": Tension("60 N/m", "60 N/m")}, "tension: strains the film by 0.012"),
        ({"geometry": Disc(radius=45)}, "geometry: the film is 90 m long"),
        ({"material": Material("410 GPa", 0.16, 2.267)}, r"density: 2.267 .* 1 g/cm\^3 is 1000"),
        ({"geometry": Disc(radius=2.5), "tension": Tension(1e-9)}, "frequencies: .* outside 1 Hz"),
        ({"tension": Tension(-0.3)}, "tension: found -300 mN/m .* buckles"),
        (
            {"tension": Tension(0.3), "load": Load(stress="-100 MPa")},
            "tension: .* buckles",
        ),
        (excited(Drive("40 kPa", "6 N/m")), "drive.parametric: .* 6 N/m, more than the 321 mN/m"),
        (excited(Drive("5 Pa"), Sweep(19, 26)), "sweep.to: 26.0 Hz .* another unit than Hz"),
        (excited(Drive("5 Pa"), Sweep("1 Hz", "30 MHz")), "sweep.from: 1.0 Hz .* another unit"),
        (excited(Drive("5 Pa"), Sweep("0.8 f1", "900 f1")), "sweep.to: 900.0 f1 .* 9e"),
    ],
)
def test_what_is_hardly_meant_is_remarked_on(changes, told):
    assert any(re.search(told, note) for note in noted(attrs.evolve(DRUM, **changes)))


@pytest.mark.parametrize(
    "load",
    [
        Load(voltage=1, gap="5 um"),
        Load(gates=[Gate("-220 nm", 1), Gate("220 nm", 2)]),
        Load(force="1 nN", position=("2.4 um", 0), radius="0.1 um"),
    ],
)
def test_lengths_beside_the_film_that_can_be_are_accepted(load):
    noted(attrs.evolve(DRUM, load=load))


def test_places_off_the_film_are_refused_by_their_key():
    for change, told in (
        ({"load": Load(force="1 nN", position=(0, "3 um"))}, r"load.position: found \(0, 3\) µm;"),
        (
            {"load": Load(force="1 nN", radius="3 um")},
            r"load.position: found \(0, 0\) m with radius 3 µm; allowed: on the disc",
        ),
        (
            excited(Drive("1 nN", direct_pattern="point", position=("-3 um", 0))),
            r"drive.position: found \(-3, 0\) µm; allowed: on the disc",
        ),
    ):
        with pytest.raises(SceneError, match=told):
            attrs.evolve(DRUM, **change)


def test_no_film_that_holds_is_told_to_buckle():
    # exact: clamped disc 14.68197 D/R^2; a clamped square 5.30 pi^2 D/a^2 (Timoshenko and Gere)
    bending = 410e9 * 1e-24 / 12 / (1 - 0.16**2)
    for geometry, critical in (
        (Disc(1e-6), 14.68197 * bending / 1e-12),
        (Rectangle(1e-6, 1e-6), 5.30 * 9.8696 * bending / 1e-12),
    ):
        for share, expected in ((0.999, False), (1.05, True)):
            scene = attrs.evolve(
                DRUM, geometry=geometry, tension=Tension(-share * critical), support=Support()
            )
            assert any("buckles" in note for note in noted(scene)) == expected
