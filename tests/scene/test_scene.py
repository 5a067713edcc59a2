"""Scenes from files and from Python are the same, frozen, and survive being written."""

import pickle

import attrs
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nanorom.errors import SceneError
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import (
    Damping,
    Excitation,
    Frequency,
    Sweep,
)
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import (
    Disc,
    MeshFile,
    Rectangle,
    String,
)
from nanorom.scene.material import Material
from nanorom.scene.scene import (
    Accuracy,
    Modes,
    Reduction,
    Scene,
)
from nanorom.scene.support import Support

GRAPHENE = Material(youngs_modulus="410 GPa", poisson_ratio=0.16, density="2267 kg/m^3")


def scene_of(geometry, **sections):
    given = {
        "plate": Plate(thickness="10 nm"),
        "material": GRAPHENE,
        "tension": Tension.isotropic("0.3 N/m"),
        "modes": Modes(count=3),
    }
    return Scene(geometry=geometry, **{**given, **sections})


def test_file_and_python_give_the_same_scene(drum_toml):
    from_file = Scene.from_toml(drum_toml)
    from_python = Scene(
        geometry=Disc(radius="2.5 um"),
        plate=Plate(thickness="10 nm"),
        material=GRAPHENE,
        tension=Tension(x="0.321 N/m", y="0.257 N/m"),
        support=Support("clamped"),
        modes=Modes(count=3),
        damping=Damping(180),
        drive=Drive(direct=["5 Pa", "20 Pa"]),
        sweep=Sweep("0.9 f1", "1.2 f1"),
    )
    assert from_file == from_python
    assert from_file.geometry.radius == 2.5e-6
    assert from_file.tension.y == 0.257


positive = st.floats(1e-300, 1e300)
kinds = st.sampled_from(["clamped", "simply_supported", "free"])
geometries = st.one_of(
    st.builds(Disc, positive),
    st.builds(Rectangle, positive, positive),
    st.builds(lambda a, b: String(max(a, b), min(a, b)), positive, positive),
)
scenes = st.builds(
    scene_of,
    geometries,
    plate=st.builds(Plate, positive, st.sampled_from(["auto", "plate"])),
    material=st.builds(
        Material, positive, st.floats(-1, 0.5, exclude_min=True, exclude_max=True), positive
    ),
    tension=st.builds(Tension, st.floats(-1e9, 1e9), st.floats(-1e9, 1e9)),
    modes=st.one_of(
        st.builds(Modes, count=st.integers(1, 100)),
        st.builds(Modes, select=st.sets(st.integers(1, 1000), min_size=1, max_size=20).map(list)),
    ),
    reduction=st.builds(
        Reduction,
        st.sampled_from(["direct", "step", "tangent"]),
        st.sampled_from(["free", "fixed"]),
        st.none() | positive,
    ),
    accuracy=st.one_of(
        st.builds(Accuracy, tolerance=st.floats(1e-13, 0.5)),
        st.builds(Accuracy, degree=st.integers(2, 8), mesh_size=positive),
    ),
    damping=st.just(Damping(180)),
    drive=st.builds(Drive, direct=st.lists(positive, min_size=1, max_size=4)),
    sweep=st.builds(Sweep, st.floats(1, 2), st.floats(3, 4)),
)


@given(scenes)
def test_toml_round_trip_gives_an_equal_scene(scene):
    assert Scene.from_toml(scene.to_toml()) == scene


@pytest.mark.parametrize("edge", ["clamped", {"left": "clamped", "default": "free"}])
def test_supports_survive_the_round_trip(edge):
    scene = scene_of(Rectangle("2 um", "1 um"), support=Support(edge))
    assert Scene.from_toml(scene.to_toml()) == scene


def test_scenes_can_be_sent_between_processes(drum_toml):
    scene = Scene.from_toml(drum_toml)
    assert pickle.loads(pickle.dumps(scene)) == scene


def test_scenes_are_frozen(drum_toml):
    with pytest.raises(attrs.exceptions.FrozenInstanceError):
        Scene.from_toml(drum_toml).plate.thickness = 1.0


def test_stress_times_thickness_is_tension(drum_toml):
    text = drum_toml.replace('x = "0.321 N/m"\ny = "0.257 N/m"', 'stress = "200 MPa"')
    tension = Scene.from_toml(text).tension
    assert tension.x == tension.y == 200e6 * 10e-9


def test_one_tension_is_isotropic(drum_toml):
    text = drum_toml.replace('x = "0.321 N/m"\ny = "0.257 N/m"', 'value = "0.3 N/m"')
    assert Scene.from_toml(text).tension == Tension(0.3, 0.3)


def test_a_plate_needs_no_tension_and_may_be_compressed():
    assert scene_of(Disc("1 um"), tension=Tension(0, 0)).tension == Tension(0.0, 0.0)
    assert scene_of(Disc("1 um"), tension=Tension(-1e-3, 0)).tension.x == -1e-3


def test_films_are_clamped_unless_told_otherwise_and_strings_at_their_ends():
    assert scene_of(Disc("1 um")).supports == {"edge": "clamped"}
    assert scene_of(String("9 um", "1 um")).supports == {
        "left": "clamped",
        "right": "clamped",
        "bottom": "free",
        "top": "free",
    }


def test_sides_without_a_kind_get_the_default_or_are_free():
    rectangle = Rectangle("2 um", "1 um")
    partial = scene_of(rectangle, support=Support({"left": "clamped", "top": "free"}))
    assert partial.supports == {"left": "clamped", "right": "free", "bottom": "free", "top": "free"}
    rest = scene_of(rectangle, support=Support({"top": "free", "default": "simply_supported"}))
    assert rest.supports["left"] == "simply_supported"
    assert rest.supports["top"] == "free"


def test_mode_numbers_are_sorted_and_counted_from_one():
    assert Modes(count=3).numbers == (1, 2, 3)
    assert Modes(select=[15, 1, 6]).numbers == (1, 6, 15)
    assert Modes(select=[15, 1, 6]).highest == 15


def test_tolerance_is_the_default_accuracy():
    assert Accuracy().tolerance == 1e-6
    assert Accuracy(degree=4, mesh_size="1 um").tolerance is None


def test_overrides_replace_settings_and_are_validated(drum_toml):
    scene = Scene.from_toml(drum_toml)
    changed = scene.with_(method="step", in_plane="fixed", modes=[4, 1], tolerance=1e-3)
    assert changed.reduction == Reduction("step", "fixed")
    assert changed.modes.numbers == (1, 4)
    assert changed.accuracy.tolerance == 1e-3
    by_hand = scene.with_(degree=4, mesh_size="1 um").accuracy
    assert (by_hand.degree, by_hand.mesh_size, by_hand.tolerance) == (4, 1e-6, None)
    assert scene.with_(degree=4, mesh_size=1e-6).with_(degree=5).accuracy.mesh_size == 1e-6
    assert scene.with_() == scene
    with pytest.raises(SceneError, match=r"^reduction\.method"):
        scene.with_(method="fast")
    with pytest.raises(SceneError, match=r"^accuracy"):
        scene.with_(degree=4)


def test_mesh_files_are_found_beside_the_scene(tmp_path, drum_toml):
    (tmp_path / "film.geo").write_text("")
    disc, mesh = 'shape = "disc"\nradius = "2.5 um"', 'shape = "mesh"\nfile = "film.geo"'
    text = drum_toml.replace(disc, mesh)
    (tmp_path / "scene.toml").write_text(text)
    scene = Scene.from_file(tmp_path / "scene.toml")
    assert scene.geometry == MeshFile(tmp_path / "film.geo", scale=1.0)
    assert MeshFile(tmp_path / "film.geo", scale="1 um") == MeshFile(tmp_path / "film.geo", 1e-6)
    assert scene.supports == {"default": "clamped"}


def test_levels_go_together_or_one_serves_all():
    assert Drive(direct=[1, 2], parametric=[3, 4]).levels == ((1, 3), (2, 4))
    assert Drive(direct=["1 Pa", "2 Pa"], parametric="3 mN/m").levels == ((1, 3e-3), (2, 3e-3))
    assert Drive(parametric=["1 Pa/um"], parametric_pattern="paper").levels == ((0, 1e6),)


def test_quality_factors_are_one_for_all_or_one_per_mode():
    assert Damping(180).per_mode(3) == (180, 180, 180)
    assert Damping([1, 2, 3]).per_mode(3) == (1, 2, 3)


def test_sweep_ends_are_hertz_or_multiples_of_the_lowest_frequency():
    sweep = Sweep("0.8 f1", "30 MHz")
    assert sweep.start == Frequency(0.8, relative=True)
    assert sweep.hertz(20e6) == (16e6, 30e6)
    with pytest.raises(SceneError, match=r"^sweep\.to: found .* above sweep\.from"):
        sweep.hertz(40e6)


def test_excitation_round_trip():
    excitation = Excitation(drive=Drive([1, 2], 0.1), sweep=Sweep("0.8 f1", "3 f1", depth=2))
    text = excitation.to_toml()
    import tomllib

    assert Excitation.from_dict(tomllib.loads(text)) == excitation
