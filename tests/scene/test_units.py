"""Quantities become the nearest number in SI, or an error that names the key."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nanorom.errors import SceneError
from nanorom.scene.units import to_si


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
