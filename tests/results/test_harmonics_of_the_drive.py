"""Drives with harmonics from a scene to the response, its file and what is refused."""

from __future__ import annotations

import re

import numpy as np
import pytest

import nanorom
from nanorom.continuation import Drive as Term
from nanorom.continuation import explore
from nanorom.errors import SceneError
from nanorom.results.response import Response
from nanorom.rom.patterns import driven
from nanorom.scene.excitation import Excitation

SECTIONS = """
[drive]
direct = "0.5 Pa"
parametric = "1 mN/m"
harmonics = [
    { harmonic = 1, direct = 1.0 },
    { harmonic = 2, parametric = 1.0, phase = "90 deg" },
]
[sweep]
from = "0.95 f1"
to = "1.05 f1"
"""


def test_scene_is_read_and_written_with_its_harmonics():
    found = Excitation.from_dict(nanorom.scene.fields.parse_toml(SECTIONS))
    one, two = found.drive.harmonics
    assert (one.harmonic, one.direct, one.parametric, one.phase) == (1, 1.0, 0.0, 0.0)
    assert (two.harmonic, two.direct, two.phase) == (2, 0.0, pytest.approx(np.pi / 2))
    assert Excitation.from_dict(nanorom.scene.fields.parse_toml(found.to_toml())) == found
    python = nanorom.Drive(
        direct="0.5 Pa",
        parametric="1 mN/m",
        harmonics=[
            nanorom.Harmonic(1, direct=1),
            nanorom.Harmonic(2, parametric=1, phase="90 deg"),
        ],
    )
    assert python == found.drive


def test_response_of_a_pumped_model_is_that_of_its_equations(make_model, tmp_path):
    model = make_model(2)
    excitation = Excitation.from_dict(nanorom.scene.fields.parse_toml(SECTIONS))
    drive, sweep = excitation.drive, excitation.sweep
    path = tmp_path / "response.h5"
    response = nanorom.respond(model, drive, sweep, processes=1, path=path)
    plain = model.system()
    system = nanorom.continuation.ModalSystem(
        mass=plain.mass,
        damping=plain.damping,
        stiffness=plain.stiffness,
        quadratic=plain.quadratic,
        cubic=plain.cubic,
        direct=plain.direct,
        drives=[Term(2, np.pi / 2, parametric=plain.parametric)],
    )
    omega = 2 * np.pi * model.frequency[0] * np.array([0.95, 1.05])
    exact = explore(system, tuple(omega), 0.5, 1e-3)
    (found,) = response.diagrams
    assert found.branches[0].amplitude == pytest.approx(exact.branches[0].amplitude, rel=1e-6)
    again = Response.load(path)
    assert again.drive == drive
    unpumped = driven(model, nanorom.Drive(direct="0.5 Pa"))
    assert not unpumped.drives and unpumped.direct.any()


@pytest.mark.parametrize(
    ("harmonics", "message"),
    [
        ("1", "drive.harmonics: found 1; allowed: a list such as"),
        ("[]", "drive.harmonics: found []"),
        ("[{ direct = 1 }]", "drive.harmonics.harmonic: missing"),
        ("[{ harmonic = 21, direct = 1 }]", "drive.harmonics.harmonic: found 21; allowed: 0 to 20"),
        ("[{ harmonic = 0, direct = 1, phase = 1 }]", "drive.harmonics.phase: found 1.0"),
        ('[{ harmonic = 1, direct = 1, phase = "1 m" }]', "drive.harmonics.phase: found '1 m'"),
        ("[{ harmonic = 1, parametric = 1 }]", "drive.harmonics: none has direct"),
        ("[{ harmonic = 1, direct = 1, level = 2 }]", "drive.harmonics.level: unknown key"),
    ],
)
def test_wrong_harmonics_are_refused_in_one_line(harmonics, message):
    text = f'direct = "1 Pa"\nharmonics = {harmonics}\n'
    with pytest.raises(SceneError, match=re.escape(message)):
        sections = {"drive": nanorom.scene.fields.parse_toml(text)}
        Excitation.from_dict(sections | {"sweep": {"from": "0.9 f1", "to": "1.1 f1"}})
