"""Formulas compute what they say, with exact derivatives, and let nothing else in."""

import numpy as np
import pytest

from nanorom.devices.expression import Condition, Expression
from nanorom.errors import ModelError, NanoromError

UNITS = {"plate.thickness": "m", "layer.2.thickness": ""}
KEYS = list(UNITS)
KNOWN = {"f(f11c)": 3.1, "f1": 1.9, "b112@2": -2.5, "Q1": 180.0, "plate.thickness": 1e-8}
KNOWN |= {"layer.2.thickness": 2e-8, "f((1,2)-(2,1))": 4.0, "J1.pressure": 0.3}
FORMULAS = {
    "f(f11c) / f1 - 2": lambda k: k["f(f11c)"] / k["f1"] - 2,
    "-f1^2 + 2**-1": lambda k: -(k["f1"] ** 2) + 0.5,
    "log(Q1) * sqrt(f1) * exp(-f1)": lambda k: (
        np.log(k["Q1"]) * np.sqrt(k["f1"]) * np.exp(-k["f1"])
    ),
    "abs(b112@2) / J1.pressure": lambda k: abs(k["b112@2"]) / k["J1.pressure"],
    "plate.thickness / layer.2.thickness": lambda k: (
        k["plate.thickness"] / k["layer.2.thickness"]
    ),
    "(f((1,2)-(2,1)) + 1) ** f1": lambda k: (k["f((1,2)-(2,1))"] + 1) ** k["f1"],
}
STEP = 1e-5  # relative, of central differences: the square is their error


@pytest.mark.parametrize("text", FORMULAS)
def test_values_and_derivatives_are_those_of_the_formula(text):
    found = Expression.read(text, KEYS, "minimize")
    plain = FORMULAS[text]
    assert found.value(KNOWN) == pytest.approx(plain(KNOWN), rel=1e-14)
    names = (*found.names, *found.keys)
    unit = dict(zip(names, np.diag([KNOWN[n] for n in names])))
    slopes = found.slope(KNOWN, unit)
    for name, slope in zip(names, slopes):
        ends = [plain(KNOWN | {name: KNOWN[name] * (1 + side * STEP)}) for side in (1, -1)]
        assert slope == pytest.approx((ends[0] - ends[1]) / (2 * STEP), rel=1e-8), name


@pytest.mark.parametrize(
    "text",
    ["__import__('os')", "plate.size", "[f1]", "lambda: 1", "f1 if f1 else 2", "os", "1j * f1",
     "g1 + 2", "f1 and 2", "log(f1, 2)", "f1 +", "", "_0 + f1", "True + f1", "f1 < 2", "f1" * 999,
     "'a'"],
)  # fmt: skip
def test_nothing_but_formulas_is_let_in(text):
    with pytest.raises(NanoromError, match="minimize: found") as error:
        Expression.read(text, KEYS, "minimize")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "text", ["1 / (f1 - f1)", "log(f1 - f1)", "exp(Q1 * Q1)", "sqrt(0 * f1) / 0"]
)
def test_formulas_without_a_value_are_told(text):
    with pytest.raises(ModelError, match="has no value here"):
        Expression.read(text, KEYS, "minimize").value(KNOWN)


def test_conditions_have_gaps_widths_and_units():
    equal = Condition.read("f(f11c)/f1 = 2 +- 0.5 %", UNITS, "conditions[1]")
    assert equal.width == pytest.approx(0.01)
    assert equal.gap(KNOWN) == pytest.approx(3.1 / 1.9 - 2)
    above = Condition.read("f1 >= 2 MHz", UNITS, "conditions[1]")
    assert above.right.value({}) == 2e6
    assert above.gap({"f1": 3e6}) == pytest.approx(1e6)
    below = Condition.read("plate.thickness <= 20 nm", UNITS, "conditions[1]")
    assert below.gap(KNOWN) == pytest.approx(1e-8)
    assert below.slope(KNOWN, {"plate.thickness": np.array([1.0])}) == pytest.approx(-1.0)
    assert below.violation(KNOWN) == 0 and above.violation({"f1": 1e6}) == pytest.approx(0.5)


@pytest.mark.parametrize(
    "text",
    ["f1", "f1 == 2", "f1 < 2", "1 <= f1 <= 2", "f1 >= 2 +- 1 %", "f1 >= 2 nm", "f1 = m1", 3],
)
def test_what_is_no_condition_is_told(text):
    with pytest.raises(NanoromError, match=r"conditions\[1\]: found"):
        Condition.read(text, UNITS, "conditions[1]")
