"""Orbits of beams in all their degrees of freedom: exact motions, published backbones, drives."""

import attrs
import numpy as np
import pytest
from scipy.special import ellipk

import nanorom
from nanorom.continuation.drive import CARRIER
from nanorom.errors import AccuracyWarning, SceneError
from nanorom.verification.assemble import assemble
from nanorom.verification.compare import VERIFIED
from nanorom.verification.driven import DrivenFilm

LENGTH, WIDTH, THICKNESS, DENSITY = 1e-3, 24e-6, 1e-5, 2320.0
QUALITY = 2000.0
EXACT = 3 / QUALITY**2  # of a frequency: how far the fold of a resonance lies beside its backbone
ROUND_OFF = 1e-10
DRIVE = {"drive": nanorom.Drive([1.5]), "sweep": nanorom.Sweep("0.99 f1", "1.15 f1")}


def beam(ends, modes=1, quality=QUALITY, **sections):
    """The beam of SSMTool's and MORFE's example, without tension."""
    return nanorom.Scene(
        geometry=nanorom.String(length=LENGTH, width=WIDTH),
        plate=nanorom.Plate(thickness=THICKNESS, model="beam"),
        material=nanorom.Material(160e9, 0.22, DENSITY),
        tension=nanorom.Tension(0.0, 0.0),
        support=nanorom.Support({"left": ends, "right": ends}),
        modes=nanorom.Modes(modes),
        damping=nanorom.Damping(quality),
        **sections,
    )


def peak(scene):
    """Model, and the film's orbit at the upper fold of its only branch."""
    model = nanorom.reduce(scene)
    response = nanorom.respond(model, scene.drive, scene.sweep, processes=1)
    diagram = response.diagrams[0]
    fold = max(
        (p for p in diagram.special_points if p.type == "LP"), key=lambda p: p.amplitude.max()
    )
    kept = attrs.evolve(diagram, special_points=[fold])
    table = nanorom.verify(scene, attrs.evolve(response, diagrams=(kept,)), points=2)
    row = table.type.index("LP")
    assert table.residual[row] <= VERIFIED
    return model, table, row


def test_hinged_beam_moves_as_an_elliptic_function():
    """One sine is a motion of its own (Woinowsky-Krieger 1950): the folds lie on its backbone."""
    model, table, row = peak(beam("simply_supported", **DRIVE))
    amplitude, first = table.full[row, 0], 2 * np.pi * model.frequency[0]
    # of w = a cn(..) sin(pi x/L): EA pi^4/(8 L^3) a^3 on the mass rho A L/2
    cubic = 160e9 * np.pi**4 / (4 * DENSITY * LENGTH**4) * amplitude**2
    exact = np.pi * np.sqrt(first**2 + cubic) / (2 * ellipk(cubic / (2 * (first**2 + cubic))))
    assert amplitude > 0.2 * THICKNESS
    assert exact > 1.02 * first
    assert table.omega_full[row] == pytest.approx(exact, rel=EXACT)
    assert table.outside[row].max() < 1e-3 * amplitude


def test_clamped_beam_is_on_the_published_backbone():
    """Order three is 5e-4 above; the film is where a manifold of order seven in six modes is."""
    scene = beam("clamped", **DRIVE | {"drive": nanorom.Drive([6.64])})
    model, table, row = peak(scene)
    first, middle = 2 * np.pi * model.frequency[0], table.deflection[row, 0]
    assert middle == pytest.approx(0.25756 * THICKNESS, rel=0.01)
    # published to order three, where 1 - omega/omega_1 goes with the square
    published = 1 + 0.018217 * (middle / (0.25756 * THICKNESS)) ** 2
    assert table.omega_full[row] / first == pytest.approx(published, abs=6e-4)
    with pytest.warns(AccuracyWarning, match="in-plane"):
        many = nanorom.reduce(beam("clamped", modes=6))
    centre = np.abs(many.shapes.points[:, 0]).argmin()
    reduced, q = nanorom.manifold(many, [1], 7), middle
    for _ in range(8):
        motion = reduced.motions([q])[0]
        at = np.abs(motion.q @ many.shapes.values[:, centre]).max() * reduced.equations.amplitude
        q *= middle / at
    assert table.omega_full[row] == pytest.approx(reduced.backbone([q])[0][0], rel=1e-5)


@pytest.mark.parametrize(
    "aim",
    [
        {"direct_pattern": "pressure"},
        {"direct_pattern": "acceleration"},
        {"direct_pattern": "point", "position": [0.2e-3, 0.0]},
        {"direct_pattern": "spot", "position": [0.1e-3, 3e-6], "radius": 8e-6},
    ],
    ids=lambda aim: aim["direct_pattern"],
)
@pytest.mark.parametrize("pattern", ["tension", "paper"])
def test_drives_of_the_film_are_the_model_s_on_its_modes(aim, pattern):
    drive = nanorom.Drive(1.0, 1.0, parametric_pattern=pattern, **aim)
    scene = beam("clamped", modes=3, drive=drive, sweep=DRIVE["sweep"])
    model = nanorom.reduce(scene)
    force, stiffness = model.patterns(aim["direct_pattern"], pattern)
    driven = DrivenFilm(assemble(scene), drive, 1.0, 1.0)
    scale, unit = driven.film.scale[:3], driven.film.units.energy
    found = driven.system.direct_drive[:3, CARRIER] * unit / scale
    assert found == pytest.approx(force, abs=ROUND_OFF * np.abs(force).max())
    found = driven.system.parametric_drive[:3, :3, CARRIER] * unit / np.outer(scale, scale)
    assert found == pytest.approx(stiffness, abs=ROUND_OFF * np.abs(stiffness).max())


def test_spot_smaller_than_the_beam_is_wide_is_integrated_across_it():
    spot = {"direct_pattern": "spot", "position": [0.0, 0.0], "radius": 2e-6}
    scene = beam("clamped", drive=nanorom.Drive(1.0, **spot), sweep=DRIVE["sweep"])
    model = nanorom.reduce(scene)
    # all of the light falls on the beam where it moves most: int exp(-2 r^2/radius^2) dA
    assert model.drive["spot"][0] == pytest.approx(np.pi * (2e-6) ** 2 / 2, rel=1e-4)


def test_viscous_material_damps_the_beam_as_it_damps_the_model():
    """A single sine of a hinged beam: the film's orbit is the model's."""
    scene = beam("simply_supported", **DRIVE)
    scene = scene.with_(damping=nanorom.Damping(QUALITY, material_time=2e-10))
    _, table, row = peak(scene)
    assert table.omega_full[row] == pytest.approx(table.omega[row], rel=1e-8)
    _, elastic, at = peak(beam("simply_supported", **DRIVE))
    assert table.full[row, 0] < 0.95 * elastic.full[at, 0]


def test_beam_with_a_load_is_refused():
    with pytest.raises(SceneError, match=r"load: found beside plate.model = beam"):
        assemble(beam("clamped", load=nanorom.Load(pressure=1.0), **DRIVE))
