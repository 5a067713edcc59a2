"""Quantities with units to SI numbers and back, at the border of the program and nowhere else."""

from __future__ import annotations

import math
import numbers
import re
from decimal import Decimal
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from nanorom.errors import SceneError

# SI unit -> what it measures, and an example as a user would write it
MEANINGS = {
    "1": ("a plain number", "0.16"),
    "m": ("a length", "2.5 um"),
    "Pa": ("a pressure", "410 GPa"),
    "kg/m^3": ("a density", "2267 kg/m^3"),
    "N/m": ("a tension", "0.3 N/m"),
    "N/m^2": ("a stiffness per length", "1 MN/m^2"),
    "N": ("a force", "10 nN"),
    "V": ("a voltage", "5 V"),
    "Hz": ("a frequency", "20 MHz"),
    "rad": ("an angle", "90 deg"),
    "Pa/m": ("a pressure per length", "1 Pa/nm"),
    "J": ("a bending stiffness", "1.5 eV"),
    "W": ("a power", "1 mW"),
    "Pa*s": ("a viscosity", "18 uPa s"),
    "N*s/m^2": ("an impedance per length", "10 kN s/m^2"),
    "V/m": ("a responsivity", "2 mV/nm"),
    "ohm": ("an impedance", "50 ohm"),
    "kg": ("a mass", "1 fg"),
    "K": ("a temperature", "293 K"),
    "1/K": ("an expansion", "2.3e-6 1/K"),
    "W/m/K": ("a conductivity", "3 W/m/K"),
    "J/kg/K": ("a specific heat", "700 J/kg/K"),
    "kg/mol": ("a molar mass", "4 g/mol"),
}

PREFIXES = {
    -18: "a",
    -15: "f",
    -12: "p",
    -9: "n",
    -6: "µ",
    -3: "m",
    0: "",
    3: "k",
    6: "M",
    9: "G",
    12: "T",
}

LEAST = {"Hz": -6}  # smallest prefix in use, as a power of ten: nobody says pHz

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,4})?"
_UNIT = r"[^\W\d_][^\W\d]*(?:\s*(?:\^|\*\*)\s*-?\d|[²³])?"
_QUANTITY = re.compile(rf"({_NUMBER})\s*((?:1\s*/\s*)?{_UNIT}(?:\s*[*/·\s]\s*{_UNIT})*)?")
_LONGEST = 80  # characters of a quantity; more is a mistake, and parsing must stay cheap


@lru_cache(maxsize=1)
def _registry() -> Any:
    """The pint registry, made when the first unit is read: pint is slow to load."""
    import pint

    return pint.UnitRegistry(non_int_type=Decimal)  # "2.5 um" is then exactly the float 2.5e-6


def to_si(value: Any, unit: str, key: str) -> float:
    """Read a quantity as a finite SI number.

    Parameters
    ----------
    value : string with a unit ("2.5 um"), pint quantity, or real number already in ``unit``.
    unit : the SI unit of the result, "1" for plain numbers.
    key : where the value stands, for the message ("material.youngs_modulus").

    Raises
    ------
    SceneError
        If the value is no number, not finite, or of another dimension.
    """
    if isinstance(value, str):
        number = _from_text(value, unit, key)
    elif hasattr(value, "to_base_units"):
        number = _from_text(f"{float(value.magnitude)!r} {value.units:C}", unit, key)
    elif isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise wrong(key, value, _allowed(unit))
    else:
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
    if not math.isfinite(number):
        raise wrong(key, value, f"{_allowed(unit)}, and finite")
    return number


def of_any_dimension(value: Any, key: str) -> tuple[float, str]:
    """A quantity in SI and its SI unit, "" for a plain number; raises SceneError."""
    match = _QUANTITY.fullmatch(value.strip()) if isinstance(value, str) else None
    if match is None or match[2] is None:
        return to_si(value, "1", key), ""
    dimension = _factor(match[2], key)[1]
    for unit in MEANINGS:
        if dimension == ({} if unit == "1" else _factor(unit, key)[1]):
            return to_si(value, unit, key), unit
    raise wrong(key, value, f"a quantity in one of {', '.join(MEANINGS)}")


def wrong(key: str, found: Any, allowed: str) -> SceneError:
    """The error every bad value gets: the key, what was found, what is allowed."""
    return SceneError(f"{key}: found {_shown(found)}; allowed: {allowed}")


def _shown(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    text = " ".join(repr(value).split())
    return text if len(text) <= _LONGEST else text[: _LONGEST - 3] + "..."


def _allowed(unit: str) -> str:
    meaning, example = MEANINGS[unit]
    return meaning if unit == "1" else f'{meaning} such as "{example}", or a number in {unit}'


def _from_text(text: str, unit: str, key: str) -> float:
    match = _QUANTITY.fullmatch(text.strip()) if len(text) <= _LONGEST else None
    if match is None:
        raise wrong(key, text, _allowed(unit))
    number, name = Decimal(match[1]), match[2]
    if name is None:
        if unit == "1":
            return float(number)
        raise SceneError(f"{key}: found {text!r} without a unit; allowed: {_allowed(unit)}")
    try:
        factor, dimension = _factor(name, key)
    except SceneError as error:
        raise SceneError(f"{error}; allowed: {_allowed(unit)}") from None
    expected = {} if unit == "1" else _factor(unit, key)[1]
    if dimension != expected:
        kind = "an angular unit" if "[angle]" in dimension else "of another dimension"
        raise SceneError(f"{key}: found {text!r}, {kind}; allowed: {_allowed(unit)}")
    return float(number * factor)


@lru_cache(maxsize=256)
def _factor(name: str, key: str) -> tuple[Decimal, dict[str, float]]:
    """Factor to SI and dimension of a unit; an angle counts as one, else rad/s would pass as Hz."""
    import pint

    micro = name.replace("\u03bc", "\u00b5").replace("·", "*")  # the Greek letter and the sign
    try:
        unit, double = (_registry().Quantity(Decimal(n), micro).to_base_units() for n in (1, 2))
    except pint.UndefinedUnitError:
        raise SceneError(f"{key}: found unknown unit {name!r}") from None
    except (pint.errors.PintError, ArithmeticError, ValueError, TypeError, AttributeError):
        raise SceneError(f"{key}: found {name!r}, which cannot be read as a unit") from None
    if double.magnitude != 2 * unit.magnitude:
        raise SceneError(f"{key}: found {name!r}, a unit with an offset or a logarithmic one")
    dimension = {str(k): float(v) for k, v in dict(unit.dimensionality).items()}
    if "radian" in str(unit.units):
        dimension["[angle]"] = 1.0
    return Decimal(unit.magnitude), dimension


def scaled(values: ArrayLike, unit: str) -> tuple[float, str]:
    """Factor and prefixed unit in which the largest of the values is 1 ... 1000.

    A ratio, of unit "1", stays what it is; the prefix of an area is squared with its metre.
    """
    if unit in ("", "1"):
        return 1.0, ""
    if unit == "kg":  # whose prefixes are those of g
        factor, name = scaled(1e3 * np.asarray(values, dtype=float), "g")
        return 1e3 * factor, name
    times = 2 if unit == "m^2" else 1
    sizes = np.abs(np.asarray(values, dtype=float)) ** (1 / times)
    power = int(np.clip(_thousands(sizes), LEAST.get(unit, min(PREFIXES)), max(PREFIXES)))
    return 10.0 ** (-times * power), PREFIXES[power] + unit


def _thousands(values: ArrayLike) -> int:
    """Power of ten, a multiple of three, in which the largest of the values is 1 ... 1000."""
    sizes = np.abs(np.asarray(values, dtype=float))
    largest = float(sizes.max(initial=0.0, where=np.isfinite(sizes)))
    return int(3 * np.floor(np.log10(largest) / 3 + 1e-9)) if largest > 0 else 0


def common_unit(values: ArrayLike, unit: str) -> tuple[float, str]:
    """Factor and unit over a column or beside an axis, in which the largest value is 1 ... 1000.

    Units that take no prefix, as N/m^3 does not, get a power of ten: "1e15 N/m^3"; so does what no
    prefix in use brings near 1.
    """
    power = _thousands(values)
    if "^" in unit or power < LEAST.get(unit, power):
        return 10.0**-power, f"1e{power} {unit}" if power else unit
    return scaled(values, unit)


def tabulated(values: ArrayLike, unit: str, digits: int = 6) -> tuple[list[str], str]:
    """Numbers of a column with that many digits, and the unit that all of them are in.

    What is no finite number is "-".
    """
    values = np.asarray(values, dtype=float).ravel()
    if unit in ("", "1"):
        return [_positional(value, digits, "-") for value in values.tolist()], unit
    factor, name = common_unit(values, unit)
    return [_positional(value * factor, digits, "k") for value in values.tolist()], name


def _positional(value: float, digits: int, trim: Literal["k", "-"]) -> str:
    """A number with so many digits, with or without zeros at its end; "-" for none."""
    if not math.isfinite(value):
        return "-"
    if value == 0.0:
        return "0"
    return np.format_float_positional(
        value, precision=digits, unique=False, fractional=False, trim=trim
    ).removesuffix(".")


def with_unit(value: float, unit: str, digits: int = 4, trim: Literal["k", "-"] = "-") -> str:
    """A value with prefixed unit, "21.15 MHz"; trim "k" keeps trailing zeros.

    What no prefix brings near 1 is written "1e-30 m".
    """
    factor, name = scaled(value, unit)
    if value and name and not 1e-3 <= abs(value * factor) < 1e6:
        return f"{value:.{digits}g} {unit}"
    return f"{_positional(value * factor, digits, trim)} {name}".rstrip()


def place_with_unit(place: ArrayLike, digits: int = 6) -> str:
    """A place, of coordinates in m, with prefixed unit: "(2.5, -1) µm"."""
    factor, name = scaled(place, "m")
    at = ", ".join(_positional(float(x) * factor, digits, "-") for x in np.asarray(place))
    return f"({at}) {name}"
