"""Write the tables of a scene's keys into docs/scene.md, from what the classes declare.

./run python -m tests.scene.keys
"""

import re
from pathlib import Path

import attrs

from nanorom.scene.cavity import Cavity
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Damping, Sweep
from nanorom.scene.film import Plate, Tension
from nanorom.scene.gate import Gate
from nanorom.scene.geometry import SHAPES
from nanorom.scene.instrument import Instrument
from nanorom.scene.layers import Layer
from nanorom.scene.load import Load
from nanorom.scene.mass import AddedMass
from nanorom.scene.material import Gas, Material
from nanorom.scene.outlines import REGIONS
from nanorom.scene.patterns import DIRECT, PARAMETRIC
from nanorom.scene.region import Region
from nanorom.scene.request import Accuracy, Modes, Reduction
from nanorom.scene.spread import Spreads
from nanorom.scene.support import Edge, PlaneSpring, Spring, Support
from nanorom.scene.waves import Harmonic
from nanorom.scene.wrinkles import Unevenness, Wrinkles

DOCUMENT = Path(__file__).parents[2] / "docs" / "scene.md"
SECTIONS = {f"geometry, {name}": kind for name, kind in SHAPES.items()} | {
    "plate": Plate,
    "plate, initial_shape": Wrinkles,
    "material": Material,
    "tension": Tension,
    "tension, variation": Unevenness,
    "support": Support,
    "support, springs": Spring,
    "support, in_plane": Edge,
    "support, springs in the plane": PlaneSpring,
    "modes": Modes,
    "reduction": Reduction,
    "accuracy": Accuracy,
    "layer": Layer,
    "mass": AddedMass,
    "region": Region,
    **{f"region, {name}": kind for name, kind in REGIONS.items()},
    "load": Load,
    "load, gate": Gate,
    "gas": Gas,
    "damping": Damping,
    "drive": Drive,
    "drive, harmonics": Harmonic,
    "drive, cavity": Cavity,
    "sweep": Sweep,
    "readout": Instrument,
    "spread": Spreads,
}
TABLE = re.compile(r"(<!-- (keys of ([\w, ]+)|patterns) -->\n).*?(<!-- end -->)", re.DOTALL)


def fields(kind):
    """Attributes of a section that are keys of a file."""
    return [field for field in attrs.fields(kind) if "key" in field.metadata]


def default(field) -> str:
    if field.default is attrs.NOTHING:
        return "needed"
    if field.default is None:
        return ""
    if isinstance(field.default, attrs.Factory):
        return "made from others"
    return f"`{str(field.default).removeprefix('(').removesuffix(')')}`"


def row(field) -> tuple[str, ...]:
    told = field.metadata
    unit = "" if told["unit"] == "1" else told["unit"] or ""
    return (
        f"`{told['key']}`",
        unit,
        default(field),
        told["allowed"].replace("|", "\\|"),
        told["about"],
    )


def table(head, rows) -> str:
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def keys(section: str) -> str:
    head, found = ("key", "unit", "if left out", "allowed", "meaning"), fields(SECTIONS[section])
    if section.startswith("region, "):  # those of all regions stand in a table of their own
        every = attrs.fields_dict(Region)
        found = [field for field in found if field.name not in every]
    return table(head, map(row, found))


def patterns() -> str:
    """The table of drive patterns: what a level of each is, and what it needs beside it."""
    rows = []
    for kind, known in (("direct_pattern", DIRECT), ("parametric_pattern", PARAMETRIC)):
        for name, pattern in known.items():
            about = (pattern.__doc__ or "").split("\n")[0].replace("``", "`")
            needed = ", ".join(f"`{key}`" for key in pattern.keys())
            rows.append((f'`{kind} = "{name}"`', pattern.unit, needed, about))
    return table(("pattern", "unit of a level", "needs", "meaning"), rows)


def with_tables(text: str) -> str:
    """The document with its tables made anew."""

    def made(match: re.Match) -> str:
        return f"{match[1]}\n{keys(match[3]) if match[3] else patterns()}\n\n{match[4]}"

    return TABLE.sub(made, text)


if __name__ == "__main__":
    DOCUMENT.write_text(with_tables(DOCUMENT.read_text("utf-8")), "utf-8")
