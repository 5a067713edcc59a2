"""Rooms and rows that move into a copy of the house, as CONTRIBUTING.md says they may.

Each newcomer is files (or a class at the end of one) and rows; `test_newcomers` uses it there.
"""

import shutil
from pathlib import Path

HOUSE = Path(__file__).parents[2] / "nanorom"

RING = '''"""A ring of light: a dummy."""

import attrs
import numpy as np

from nanorom.scene import fields as v
from nanorom.scene.patterns.pattern import POSITION, Areal


@attrs.frozen
class Ring(Areal):
    """A pressure p d^2/rim^2 exp(-d^2/rim^2) at a distance d from ``position``."""

    name = "ring"
    unit = "Pa"

    position: tuple[float, float] = attrs.field(metadata=POSITION)
    rim: float = attrs.field(metadata=v.quantity("drive.rim", "m", about="of the ring"))

    @property
    def centre(self):
        return self.position

    @property
    def size(self):
        return self.rim

    @property
    def reach(self):
        return 6 * self.rim

    def density(self, points):
        square = np.sum((points - np.asarray(self.position)) ** 2, axis=-1) / self.rim**2
        return square * np.exp(-square)
'''

SHARE = '''"""A part of a tension: a dummy."""

import attrs

from nanorom.scene import fields as v
from nanorom.scene.patterns.pattern import Stretch


@attrs.frozen
class Share(Stretch):
    """A share of a modulation of the tension; its level is the whole amplitude in N/m."""

    name = "share"
    unit = "N/m"

    share: float = attrs.field(metadata=v.quantity("drive.share", "1", about="of the tension"))

    def stiffness(self, work, force):
        return work.stretch(self.share)
'''

SHRINKING = '''

@attrs.frozen
class Shrinking(Condition):
    """A complex pair has a given modulus: a dummy, which a damped oscillator meets."""

    radius: float
    conjugate = True

    @property
    def growth(self):
        return float(np.log(self.radius))

    def candidates(self, multipliers):
        return multipliers[multipliers.imag > REAL]

    def distances(self, multipliers):
        return np.abs(np.abs(self.candidates(multipliers)) - self.radius)

    def crossing(self, multipliers):
        return float(np.abs(multipliers).max() - self.radius)

    def test(self, eigenvalues, slopes, pairs):
        first, second = pairs
        return signed_log_product(eigenvalues[:, first] * eigenvalues[:, second] - self.radius**2)

    def critical(self, symmetric, multiplicity=1):
        return lambda eigenvalues, slope: float(np.log(np.abs(eigenvalues[0]) / self.radius))

    def among(self, nearest):
        return np.zeros(len(nearest), dtype=bool)
'''

STRESS = '''

class Stress(Unknown):
    """Stress of the film, the same along x and y: a dummy."""

    name, unit, sets = "stress", "Pa", PAIR
    stiffens, pulls = 1, True

    def of(self, film):
        return super().of(film) / film.thickness

    def put(self, film, value):
        return super().put(film, value * film.thickness)

    def slope(self, film):
        return np.array([film.thickness, film.thickness, 0.0, 0.0])
'''

NOTED = '''"""Marks along a frequency axis: a dummy kind of file."""

from typing import ClassVar

import attrs
import numpy as np

from nanorom.files import hdf5, layout, schema, stored
from nanorom.files.schema import array


@layout.documented
@attrs.frozen(eq=False, kw_only=True)
class Noted:
    """Marks."""

    FORMAT: ClassVar[str] = "nanorom-noted"
    FORMAT_VERSION: ClassVar[int] = 1

    frequency: np.ndarray = attrs.field(metadata=array("n", "Hz", "where the marks are"))

    def __attrs_post_init__(self):
        schema.check(self)

    def save(self, path):
        stored.save(self, path)

    @classmethod
    def load(cls, path):
        with hdf5.opened(path, cls.FORMAT, cls.FORMAT_VERSION) as file:
            return stored.read(cls, file)

    def text(self):
        return f"{len(self.frequency)} marks"

    def draw(self, path, folder, measured):
        return []
'''
NOTED_ROW = """    "nanorom-noted": Kind(
        "noted.h5",
        "nanorom.results.noted:Noted.load",
        "nanorom.results.noted:Noted.text",
        "nanorom.results.noted:Noted.draw",
        "nanorom.results.noted:Noted.text",
        "nanorom.results.noted:Noted.text",
    ),
    "nanorom-loadcurve": Kind("""

PLAIN = '''"""Frequencies as plain text: a dummy format."""


def write_plain(model, path):
    path.write_text("".join(f"{frequency:.9e}\\\\n" for frequency in model.frequency))
'''.replace("\\\\n", "\\n")

SKIN = '''"""A string that does not bend, in closed form: a dummy film model."""

import attrs
import numpy as np

from nanorom.rom.shapes import Shapes


@attrs.frozen
class Skin:
    """Shapes sin(k (x + length/2)), k = n pi/length; tension and stretching in N, mass in kg/m."""

    length: float
    width: float
    tension: float
    stretching: float
    mass: float

    def waves(self, numbers):
        return numbers * np.pi / self.length

    def slope(self, numbers):
        return np.diag(self.waves(numbers) ** 2) * self.length / 2

    def area(self, numbers):
        return (1 - np.cos(np.pi * numbers)) / self.waves(numbers)

    def cubic(self, numbers):
        slope = self.slope(numbers)
        return self.stretching / (2 * self.length) * np.einsum("rj,kl->rjkl", slope, slope)

    def shapes(self, numbers):
        x = np.linspace(-self.length / 2, self.length / 2, 201)
        n, y = len(x), np.repeat([-self.width / 2, self.width / 2], len(x))
        points = np.column_stack([np.tile(x, 2), y, 0 * y])
        left = np.arange(n - 1)
        cells = [[left, left + 1, n + left], [left + 1, n + left + 1, n + left]]
        values = np.sin(np.outer(self.waves(numbers), x + self.length / 2))
        cells = np.concatenate([np.stack(c, axis=1) for c in cells])
        return Shapes(points, cells, np.tile(values, 2))
'''

SKIN_ROUTE = '''"""From a string's scene to its model in closed form: a dummy."""

import numpy as np

from nanorom.fem.models.skin import Skin
from nanorom.fem.output.model import Parts
from nanorom.fem.routes.beam import BeamRoute
from nanorom.rom.patterns import DrawnWork, reduced


class SkinRoute(BeamRoute):
    """Strings that do not bend."""

    def cost(self, plan):
        return "a skin: closed forms"

    def parts(self, plan, team, watch, journal):
        scene, numbers = plan.scene, np.array(plan.scene.modes.numbers)
        film, h, width = scene.material, scene.plate.thickness, scene.geometry.width
        skin = Skin(
            scene.geometry.length,
            width,
            scene.tension.x * width,
            film.youngs_modulus * h * width,
            film.density * h * width,
        )
        slope, shapes = skin.slope(numbers), skin.shapes(numbers)
        mass = np.full(len(numbers), skin.mass * skin.length / 2)
        stiffness = skin.tension * slope
        work = DrawnWork(shapes, width * skin.area(numbers), width * slope)
        return Parts(
            frequency=np.sqrt(np.diag(stiffness) / mass) / (2 * np.pi),
            mass=mass,
            label=[f"({n},0)" for n in numbers],
            stiffness=stiffness,
            quadratic=np.zeros((len(numbers),) * 3),
            cubic=skin.cubic(numbers),
            patterns=reduced(work, None),
            shapes=shapes,
            method="direct",
            diagnostics={"asymmetry": 0.0},
        )
'''

# file -> new content, or what to put at its end, or (row as it is, with the newcomer)
FILES = {
    "scene/patterns/ring.py": RING,
    "scene/patterns/share.py": SHARE,
    "results/noted.py": NOTED,
    "export/plain.py": PLAIN,
    "fem/models/skin.py": SKIN,
    "fem/routes/skin.py": SKIN_ROUTE,
}
ENDS = {
    "continuation/orbits/conditions.py": SHRINKING,
}
CLASSES = {"measurement/unknowns.py": ("_ALL = (", STRESS.lstrip("\n") + "\n\n_ALL = (")}
ROWS = {
    "scene/patterns/__init__.py": [
        ("    Laser,\n)", "    Laser,\n    Ring,\n)"),
        ("    GateStiffness,\n)", "    GateStiffness,\n    Share,\n)"),
        (
            "from nanorom.scene.patterns.spot import Spot\n",
            "from nanorom.scene.patterns.ring import Ring\n"
            "from nanorom.scene.patterns.share import Share\n"
            "from nanorom.scene.patterns.spot import Spot\n",
        ),
    ],
    "continuation/orbits/bifurcations.py": [
        ("(FOLD, DOUBLING, TORUS, BRANCHING)", "(FOLD, DOUBLING, TORUS, BRANCHING, SHRINKS)"),
        ("KINDS = {", 'SHRINKS = Kind("SH", "shrinks", Shrinking(0.9), 0, "*")\nKINDS = {'),
        ("import At, Condition, OnCircle", "import At, Condition, OnCircle, Shrinking"),
    ],
    "measurement/unknowns.py": [("    MaterialTime(),\n", "    MaterialTime(),\n    Stress(),\n")],
    "files/stored.py": [('    "nanorom-loadcurve": Kind(', NOTED_ROW)],
    "export/formats.py": [
        (
            '    "vtk": Format(',
            '    "plain": Format(".txt", model="nanorom.export.plain:write_plain"),\n'
            '    "vtk": Format(',
        ),
    ],
    "scene/film.py": [
        ('    "beam": Model(', '    "skin": Model(bends=True, planar=False),\n    "beam": Model('),
    ],
    "fem/routes/registry.py": [
        ('    "beam": BeamRoute(),', '    "skin": SkinRoute(),\n    "beam": BeamRoute(),'),
        (
            "from nanorom.fem.routes.shell import ShellRoute\n",
            "from nanorom.fem.routes.shell import ShellRoute\n"
            "from nanorom.fem.routes.skin import SkinRoute\n",
        ),
    ],
}


def moved_in(folder: Path) -> Path:
    """A copy of the house in a folder, with all newcomers in their rooms and rows."""
    house = folder / "nanorom"
    shutil.copytree(HOUSE, house, ignore=shutil.ignore_patterns("__pycache__"))
    for name, text in FILES.items():
        (house / name).write_text(text, "utf-8")
    for name, text in ENDS.items():
        (house / name).write_text((house / name).read_text("utf-8") + text, "utf-8")
    for name, row in CLASSES.items():
        replace(house / name, *row)
    for name, rows in ROWS.items():
        for row in rows:
            replace(house / name, *row)
    return folder


def replace(path: Path, old: str, new: str) -> None:
    """Put a row into a table, where it has to be found once."""
    text = path.read_text("utf-8")
    assert text.count(old) == 1, (path, old, text.count(old))
    path.write_text(text.replace(old, new), "utf-8")
