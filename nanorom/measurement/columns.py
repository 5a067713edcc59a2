"""What the columns of a laboratory's table mean: names, units, missing values."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import attrs

from nanorom.errors import SceneError
from nanorom.scene.units import to_si

# what a heading, or a word of it, is taken for; the longest habits of lock-ins and analysers
SYNONYMS: dict[str, tuple[str, ...]] = {
    "frequency": ("frequency", "freq", "f", "fd", "fdrive", "frequenz", "frequence", "fréquence"),
    "time": ("time", "t", "zeit", "temps"),
    "phase": ("phase", "theta", "phi"),  # before "S21", which is a word of "S21 phase", too
    "amplitude": (
        *("amplitude", "amp", "ampl", "magnitude", "mag", "r", "displacement", "signal"),
        *("s21", "s12", "s11", "s22", "voltage", "spannung"),
    ),
    "x": ("x", "in-phase", "inphase", "real", "re"),
    "y": ("y", "quadrature", "imag", "im"),
    "level": ("level", "power", "drive", "excitation", "pegel", "leistung"),
    "sweep": ("sweep", "direction", "dir"),
    "label": ("label", "mode", "name"),
    "uncertainty": ("uncertainty", "error", "sigma", "std", "stderr"),
}
MISSING = {"", "nan", "-", "--", "n/a", "na", "#n/a", "none", "null", "inf", "+inf", "-inf"}
POINT = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d{1,4})?")  # D is FORTRAN's
COMMA = re.compile(r"[-+]?(?:\d{1,3}(?:\.\d{3})+|\d+)?,\d+(?:[eE][-+]?\d{1,4})?")
DEGREES = ("°", "º", "deg.", "degree", "degrees")  # other ways to write the unit deg
_UNITS_BEHIND = re.compile(r"(.*?)\s*[(\[{]\s*([^)\]}]*?)\s*[)\]}]\s*")
_UNITS_AFTER = re.compile(r"(.*?)(?:\s*[/,]\s*|[_\s]+)([^\s/,_]+)")
_DECIBELS = re.compile(r"dB(?:[mVu]|mV|uV|µV|FS)?", re.IGNORECASE)
_ARBITRARY = {"a.u.", "au", "arb", "arb.", "arb. u.", "arb. units", "arb.u.", "counts"}


def _usual(unit: str) -> str:
    return "deg" if unit.lower() in DEGREES else unit


@attrs.frozen
class Heading:
    """Name of a column in lower case, as it stands in the file, and its unit or ""."""

    name: str
    text: str
    unit: str = attrs.field(converter=_usual)

    @classmethod
    def of(cls, text: str) -> Heading:
        """From "Frequency (MHz)", "f/MHz", "freq_MHz" or "frequency"."""
        text = text.strip()
        found = _UNITS_BEHIND.fullmatch(text)
        if found:
            return cls(found[1].strip().lower(), text, found[2])
        found = _UNITS_AFTER.fullmatch(text)
        if found and is_unit(found[2]):
            return cls(found[1].strip().lower(), text, found[2])
        return cls(text.lower(), text, "")

    @property
    def words(self) -> set[str]:
        """Its words; digits at their ends, as channels have, do not count; "f01" is a mode."""
        words = set(re.split(r"[\s_.:|]+", self.name))
        plain = {word.rstrip("0123456789") for word in words}
        return words | {word for word in plain if len(word) > 1}


def is_unit(text: str) -> bool:
    """Whether a text is a unit that amplitudes or frequencies are given in."""
    if is_decibel(text) or text.lower() in (*_ARBITRARY, *DEGREES):
        return True
    if len(text) == 1 and text.lower() in SYNONYMS:  # "x" is no unit, nor is "t" meant as one
        return False
    return any(_reads(text, unit) for unit in ("Hz", "m", "V", "rad", "N", "Pa", "N/m"))


def is_decibel(unit: str) -> bool:
    """Whether a unit is logarithmic."""
    return _DECIBELS.fullmatch(unit) is not None


def _reads(text: str, unit: str) -> bool:
    try:
        to_si(f"1 {text}", unit, "unit")
    except SceneError:  # of another dimension, or unknown
        return False
    return True


def is_length(unit: str) -> bool:
    """Whether a unit is one of length."""
    return _reads(unit, "m")


def is_missing(cell: str) -> bool:
    """Whether a cell says that there is no value."""
    return cell.lower() in MISSING


def is_number(cell: str) -> bool:
    """Whether a cell is a plain number, with a decimal point or comma, or a missing one."""
    return bool(POINT.fullmatch(cell) or COMMA.fullmatch(cell)) or is_missing(cell)


def meant(headings: Sequence[Heading], chosen: Mapping[str, str]) -> dict[str, list[int]]:
    """Which columns each quantity of SYNONYMS may be, more than one where it is not clear.

    chosen : quantity -> heading or number from 1, as the user has said.  A heading that is a name
    in full goes before one that has it among its words; no column is taken twice.
    """
    found: dict[str, list[int]] = {}
    for quantity, column in chosen.items():
        found[quantity] = [
            i
            for i, heading in enumerate(headings)
            if column.lower() in (heading.name, heading.text.lower(), str(i + 1))
        ]
    taken = {i for own in found.values() for i in own}
    for whole in (True, False):
        for quantity, names in SYNONYMS.items():
            if quantity in found:
                continue
            own = [
                i
                for i, heading in enumerate(headings)
                if i not in taken
                and (heading.name in names if whole else heading.words & set(names))
            ]
            exact = [i for i in own if headings[i].name == quantity]
            if own:
                found[quantity] = exact or own
                taken |= set(own)
    return found
