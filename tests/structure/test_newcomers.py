"""A new capability moves in as one room and one row: tried in a copy of the house.

What CONTRIBUTING.md says of a drive pattern, a special point, a kind of file, a format of export,
an unknown of the fit and a model of the film is done with dummies, and then used as a user would.
"""

import os
import subprocess
import sys
import textwrap

import pytest

from tests.structure.newcomers import moved_in

BEGIN = """
import numpy as np
import nanorom
from nanorom.cli.main import main

def drum(model="membrane", **sections):
    return nanorom.Scene(
        geometry=nanorom.Disc(1e-6),
        plate=nanorom.Plate(thickness=1e-8, model=model),
        material=nanorom.Material(youngs_modulus=4e11, poisson_ratio=0.16, density=2267.0),
        tension=nanorom.Tension(0.3),
        modes=nanorom.Modes(1),
        accuracy=nanorom.Accuracy(degree=4, mesh_size=5e-7),
        **sections,
    )
"""

PROGRAMS = {
    "drive pattern": """
        from nanorom.rom.patterns import DrawnWork
        drive = nanorom.Drive(1.0, direct_pattern="ring", position=(0, 0), rim="300 nm")
        sweep = nanorom.Sweep("0.9 f1", "1.1 f1")
        scene = drum(drive=drive, damping=nanorom.Damping(100), sweep=sweep)
        assert nanorom.Scene.from_toml(scene.to_toml()) == scene
        model = nanorom.reduce(scene)
        drawn = drive.pattern.force(DrawnWork(model.shapes))
        assert np.allclose(model.drive["ring"], drawn, rtol=0.02) and model.drive["ring"][0] > 0
        assert nanorom.respond(model, drive, scene.sweep, processes=1).diagrams
    """,
    "parametric pattern with a key": """
        from nanorom.rom.patterns import aimed
        drive = nanorom.Drive(parametric=1e-3, parametric_pattern="share", share=0.25)
        sweep = nanorom.Sweep("1.95 f1", "2.05 f1")
        scene = drum(drive=drive, damping=nanorom.Damping(100), sweep=sweep)
        assert nanorom.Scene.from_toml(scene.to_toml()) == scene
        model = nanorom.reduce(scene)
        assert np.array_equal(model.parametric["share"], 0.25 * model.parametric["tension"])
        half = nanorom.Drive(parametric=1e-3, parametric_pattern="share", share=0.5)
        again = aimed(model, half).parametric["share"]
        assert np.allclose(again, 2 * model.parametric["share"], rtol=0.02)
        assert nanorom.respond(model, drive, scene.sweep, processes=1).diagrams
        try:
            nanorom.Drive(1.0, share=0.5)
        except nanorom.errors.SceneError as error:
            assert 'drive.share: not used with parametric_pattern = "tension"' in str(error)
    """,
    "special point": """
        from nanorom.continuation import ModalSystem, explore, locus
        from nanorom.continuation.diagrams.selection import of_level
        from nanorom.continuation.larger.equations import LargerSystem
        from nanorom.continuation.larger.estimate import estimate
        damping = 0.1
        system = ModalSystem(
            damping=damping, stiffness=1.0, quadratic=[[[0.1]]], cubic=[[[[0.5]]]], direct=[1.0]
        )
        diagram = explore(system, (2.5, 3.5), direct=0.01)
        (found,) = diagram.points("SH")  # |mu| = exp(-damping T / 2), whatever the motion
        exact = -np.pi * damping / np.log(0.9)
        assert abs(found.omega / exact - 1) < 1e-8
        levels = (0.005, 0.05)
        curve = locus(system, found, 0.01, 0.0, omega=(2.5, 3.5), level=levels, at=[0.02])
        assert curve.type == "SH" and np.ptp(curve.level) > 0.04
        assert np.abs(curve.omega / exact - 1).max() < 1e-8
        curve = locus(
            system, found, 0.01, 0.0, omega=(2.5, 3.5), level=(0.9, 1.1), parameter="damping"
        )
        assert np.abs(curve.omega / (curve.level * exact) - 1).max() < 1e-8
        cubic = np.zeros((2, 2, 2, 2))  # the same mode, and one that moves with it
        cubic[0, 0, 0, 0], cubic[1, 0, 0, 0] = 0.5, 0.05
        cubic[0, 0, 0, 1] = cubic[0, 0, 1, 0] = cubic[0, 1, 0, 0] = 0.05
        quadratic = np.zeros((2, 2, 2))
        quadratic[0, 0, 0] = 0.1
        whole = ModalSystem(
            damping=[damping, 0.2], stiffness=[1.0, 30.0], quadratic=quadratic, cubic=cubic,
            direct=[1.0, 0.0],
        )
        larger = LargerSystem(whole, np.arange(1), 0.01, 0.0)
        points = [p for p in of_level(0, diagram, 2) if p.type == "SH"]
        (error,) = [estimate(larger, point) for point in points]
        there = error.point.orbit.omega * (1 + error.omega)
        near = [p.omega for p in explore(whole, (2.9, 3.1), direct=0.01).points("SH")]
        assert error.found and min(abs(omega / there - 1) for omega in near) < 1e-8
    """,
    "kind of file": """
        from nanorom.files import stored
        from nanorom.results.noted import Noted
        Noted(frequency=np.array([1e6, 2e6])).save("noted.h5")
        assert np.array_equal(stored.load("noted.h5").frequency, [1e6, 2e6])
        assert main(["info", "noted.h5"]) == 0
        assert main(["plot", "noted.h5"]) == 0
    """,
    "format of export": """
        nanorom.reduce(drum()).save("rom.h5")
        assert main(["export", "rom.h5", "--to", "plain"]) == 0
        assert float(open("rom.txt").read()) > 1e6
    """,
    "unknown of the fit": """
        from nanorom.measurement.data import Resonances
        from nanorom.measurement.identify import identify
        scene = drum().with_(modes=3)
        measured = Resonances(nanorom.reduce(scene).frequency, ("", "", ""))
        start = scene.with_(tension=nanorom.Tension(0.35))
        found = identify(start, measured, unknowns=("stress",))
        assert abs(found.value["stress"] / (0.3 / 1e-8) - 1) < 1e-3
    """,
    "model of the film": """
        from nanorom.workflow import plan
        def string(model):
            held = nanorom.Support({"left": "simply_supported", "right": "simply_supported"})
            return nanorom.Scene(
                geometry=nanorom.String(length=1e-5, width=1e-6),
                plate=nanorom.Plate(thickness=1e-9, model=model),
                material=nanorom.Material(4e11, 0.16, 2267.0),
                tension=nanorom.Tension(0.3),
                support=held,
                modes=nanorom.Modes(2),
            )
        skin, beam = nanorom.reduce(string("skin")), nanorom.reduce(string("beam"))
        for name in ("frequency", "mass", "cubic"):  # bending is 1e-5 of the tension
            one, two = getattr(skin, name), getattr(beam, name)
            assert np.allclose(one, two, rtol=1e-4, atol=1e-9 * np.abs(two).max()), name
        assert np.allclose(skin.drive["pressure"], beam.drive["pressure"], rtol=1e-4, atol=1e-18)
        assert "a skin: " in plan(string("skin"))
    """,
}


@pytest.fixture(scope="module")
def house(tmp_path_factory):
    return moved_in(tmp_path_factory.mktemp("house"))


@pytest.mark.parametrize("newcomer", PROGRAMS)
def test_newcomer_is_one_room_and_one_row(newcomer, house, tmp_path):
    program = BEGIN + textwrap.dedent(PROGRAMS[newcomer])
    environment = os.environ | {"PYTHONPATH": str(house)}
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
