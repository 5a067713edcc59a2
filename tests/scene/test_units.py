"""Quantities become the nearest number in SI, or an error that names the key."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nanorom.errors import SceneError
from nanorom.scene.units import place_with_unit, tabulated, to_si, with_unit


@pytest.mark.parametrize(
    ("text", "unit", "expected"),
    [
        ("2.5 um", "m", 2.5e-6),
        ("2.5um", "m", 2.5e-6),
        ("5 \u00b5m", "m", 5e-6),  # micro sign
        ("5 \u03bcm", "m", 5e-6),  # Greek letter
        ("1 angstrom", "m", 1e-10),
        ("410 GPa", "Pa", 410e9),
        ("-1.5e2 mbar", "Pa", -15000.0),
        ("0.3 N/m", "N/m", 0.3),
        ("3 mN/m", "N/m", 3e-3),
        ("1 J/m^2", "N/m", 1.0),
        ("2.267 g/cm**3", "kg/m^3", 2267.0),
        ("2.267 g cm^-3", "kg/m^3", 2267.0),
        ("20 MHz", "Hz", 2e7),
        ("20 1/s", "Hz", 20.0),
        ("0.16", "1", 0.16),
    ],
)
def test_text_with_a_unit_becomes_the_nearest_float_in_si(text, unit, expected):
    assert to_si(text, unit, "section.key") == expected


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_plain_numbers_are_taken_as_si(number):
    assert to_si(number, "m", "section.key") == number
    assert to_si(np.float64(number), "m", "section.key") == number


def test_pint_quantities_are_accepted():
    import pint

    assert to_si(pint.UnitRegistry().Quantity(2.5, "um"), "m", "section.key") == 2.5e-6


@pytest.mark.parametrize(
    ("value", "unit"),
    [
        ("410 kg", "Pa"),
        ("5 m", "1"),
        ("5", "m"),
        ("five um", "m"),
        ("5 foo", "m"),
        ("", "m"),
        ("5 m**9**9", "m"),
        ("9**9**9 m", "m"),
        ("5 m; 3", "m"),
        ("5 __class__", "m"),
        ("5 dB", "1"),
        ("5 degC", "m"),
        ("1e8 rad/s", "Hz"),
        ("100 rpm", "Hz"),
        ("nan m", "m"),
        ("1e999 m", "m"),
        ("1" * 200 + " m", "m"),
        (math.nan, "m"),
        (math.inf, "m"),
        (10**400, "m"),
        (True, "1"),
        (None, "m"),
        ([1.0], "m"),
        ({"value": 1}, "m"),
        (1j, "m"),
    ],
)
def test_anything_else_is_refused_in_one_line_that_names_the_key(value, unit):
    with pytest.raises(SceneError, match=r"^section\.key: found ") as caught:
        to_si(value, unit, "section.key")
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 250


@given(st.text(max_size=30))
def test_no_text_does_anything_but_give_a_finite_number_or_a_scene_error(text):
    try:
        assert math.isfinite(to_si(text, "m", "section.key"))
    except SceneError as error:
        assert "\n" not in str(error)


def in_si(text, name):
    """A number of a table in SI, from the unit that the table names."""
    power, _, unit = name.rpartition(" ") if name.startswith("1e") else ("1", "", name)
    return float(text) * float(power) * to_si(f"1 {unit}", SI[unit.lstrip("afpnµmkMGT")], "unit")


SI = {
    "Hz": "Hz",
    "": "m",
    "g": "kg",
    "N/m": "N/m",
    "Pa": "Pa",
    "V": "V",
    "N": "N",
    "N/m^2": "N/m^2",
}


@pytest.mark.parametrize("unit", ["Hz", "m", "N/m", "Pa", "V", "N", "N/m^2"])
def test_tables_say_their_values_in_units_that_are_read_back(unit):
    rng = np.random.default_rng(7)
    for _ in range(20):
        sizes = 10 ** rng.uniform(-18, 17) * 10 ** rng.uniform(-3, 0, size=5)
        values = sizes * rng.choice([-1.0, 1.0], size=5)
        cells, name = tabulated(values, unit, 7)
        assert [in_si(cell, name) for cell in cells] == pytest.approx(values.tolist(), rel=1e-6)
        if "^" not in unit and 1e-18 < abs(values).max() < 1e14:
            assert 0.999 <= max(abs(float(cell)) for cell in cells) < 1000.1


def test_masses_are_in_grams_and_what_is_no_number_is_a_dash():
    assert tabulated([9.42242e-17, 8.84e-17], "kg", 3) == (["94.2", "88.4"], "fg")
    assert with_unit(1e-3, "kg") == "1 g"
    assert with_unit(2e-12, "m^2") == "2 µm^2"  # the prefix is squared with the metre
    assert with_unit(1e-30, "m") == "1e-30 m"
    assert with_unit(2.5e-12, "Hz") == "2.5e-12 Hz"  # and not 2.5 pHz
    assert tabulated([2e-12, 5e-13], "Hz", 2) == (["2.0", "0.5"], "1e-12 Hz")
    assert tabulated([2e-6, 5e-7], "Hz", 2) == (["2.0", "0.5"], "µHz")
    assert place_with_unit((2.5e-6, -1e-6)) == "(2.5, -1) µm"
    assert tabulated([np.nan, 0.0, 2e-9, np.inf], "m", 3) == (["-", "0", "2.00", "-"], "nm")
    assert tabulated([180.0], "1") == (["180"], "1")
    assert tabulated([1.697e15, 2e16], "N/m^3", 4) == (["1.697", "20.00"], "1e15 N/m^3")
