"""Write docs/outside.md: published tables and other codes' printed results beside ours.

./run python -m tests.benchmarks.outside
"""

import tempfile
from pathlib import Path

import attrs
import numpy as np

import nanorom
from nanorom import Disc, Material, Modes, Plate, Rectangle, Scene, Support, Tension
from nanorom.continuation import ModalSystem, explore
from nanorom.fem.plan import Plan
from nanorom.fem.routes import shell
from nanorom.fem.solvers.groups import alone
from nanorom.fem.stopwatch import Stopwatch
from nanorom.scene.scene import Accuracy

DOCUMENT = Path(__file__).parents[2] / "docs" / "outside.md"
SHELLS = 1e-3  # aim of their mesh: theirs errs by more
HEAD = """# Numbers of others

What others printed, beside what this package computes; `./run python -m tests.benchmarks.outside`
writes this page anew, and the suite holds it against a new computation. Every printed number was
read in the public source named with it; where a difference is more than the printed digits, the
last column says whose it is. Beside these: the paper's Table 1 (`demos/table1.py`), its Table 4
entry by entry (`demos/table4.py`), and five nonlinear shells (`tests/benchmarks/shells`). Plates:
omega L^2 (rho h/D)^(1/2), L the side; nu = .3 but where another is told.

Sources: code_aster's validation manual V2.03.001 (SDLS01, after Barton 1951), page "Benchmark
solution"; SSMTool 2 (jain-shobhit/SSMTool), what its live scripts vonKarmanPlateBook.mlx and
vonKarmanPlate_parallel.mlx (of examples/vonKarmanPlate) and vonKarmanShellWorkbook.mlx (of
examples/vonKarmanShell and examples/vonKarmanShellIRs) have printed; Table 1 of Davidovikj et al.
2017.

| problem | quantity | printed | ours | difference | of the difference |
| --- | --- | --- | --- | --- | --- |
"""
ASTER = "code_aster V2.03.001"
# with that damping (Ritz' displacements in the plane) the last fold is 799.48, that before 780.19
RESPONSE = (
    "its damping acts in the plane too: .12 % of the last fold; the rest grows with amplitude and "
    "is not separated: 20000 flat triangles, a series of order 5 with the drive to first order"
)


@attrs.frozen
class Row:
    """One printed number and ours; why: what makes the difference."""

    problem: str
    quantity: str
    printed: float
    ours: float
    why: str

    def line(self) -> str:
        """Of the table."""
        difference = f"{100 * (self.ours / self.printed - 1):+.3f} %"
        cells = self.problem, self.quantity, f"{self.printed:g}", f"{self.ours:.6g}", difference
        return f"| {' | '.join((*cells, self.why))} |"


def film(geometry, edge, count, nu=0.3, **changes):
    """A plate of thickness .01 without units, and what its angular frequencies are measured in."""
    fields = {
        "geometry": geometry,
        "plate": Plate(0.01, model="plate"),
        "material": Material(1.0, nu, 1.0),
        "support": Support(edge),
        "modes": Modes(count=count),
        "accuracy": Accuracy(tolerance=1e-6),
    }
    scene = Scene(**(fields | changes))
    h, material = scene.plate.thickness, scene.material
    bending = material.youngs_modulus * h**3 / 12 / (1 - nu**2)
    return nanorom.reduce(scene), np.sqrt(bending / (material.density * h))


def plates():
    """Linear frequencies omega L^2 (rho h/D)^(1/2), L the side."""
    cantilever = {"left": "clamped", "default": "free"}
    beams = "the printed ones are of a few beam functions (Ritz), above the exact ones"
    tables = (
        ("square clamped on one side", cantilever, (3.492, 8.525, 21.43, 27.33, 31.11, 54.44)),
        ("free square", "free", (13.49, 19.79, 24.43, 35.02, 35.02)),
    )
    for problem, edge, printed in tables:
        model, unit = film(Rectangle(1, 1), edge, len(printed))
        for place, value in enumerate(printed):
            ours = 2 * np.pi * model.frequency[place] / unit
            yield Row(f"{problem} ({ASTER})", f"mode {place + 1}", value, float(ours), beams)


def square_of_ssmtool():
    """1 m square, 10 mm, E 70 GPa, rho 2700, nu .33, u = v = w = 0 on the edges."""
    model, _ = film(
        Rectangle(1, 1), "simply_supported", 5, 0.33, material=Material(70e9, 0.33, 2700)
    )
    why = "its mesh of 200 flat triangles; exact are 307.357, 768.392 (twice), 1229.43, 1536.78"
    for place, printed in enumerate((306.7, 763.6, 767.7, 1218.8, 1531.1)):
        ours = 2 * np.pi * model.frequency[place]
        problem = "supported square (SSMTool), rad/s"
        yield Row(problem, f"mode {place + 1}", printed, float(ours), why)


def response_of_ssmtool():
    """The same square driven near its second and third mode, frequency against amplitude.

    50 N cos(omega t) at .2 m and .3 m from two sides, damping 1/s M + 4e-6 s K: the two modes of
    one frequency take energy from each other.
    """
    model, _ = film(
        Rectangle(1, 1), "simply_supported", 6, 0.33, material=Material(70e9, 0.33, 2700)
    )
    waves = np.array([name.strip("()").split(",") for name in model.label], dtype=int)
    force = np.abs(np.sin(waves * np.pi * [0.2, 0.3]).prod(axis=1))
    force *= np.sign(model.shapes.at((-0.3, -0.2)))
    mass = np.diag(model.mass)
    system = ModalSystem(
        mass=mass,
        damping=mass + 4e-6 * model.stiffness,
        stiffness=model.stiffness,
        cubic=model.cubic,
        direct=force,
    )
    pair = 2 * np.pi * model.frequency[1]
    diagram = explore(system, omega=(0.95 * pair, 1.1 * pair), direct=50.0)
    for kind, name, every in (
        ("LP", "fold", (776.92, 779.29, 780.09, 797.49)),
        ("NS", "onset of beats", (779.56, 788.27)),
    ):
        found = [point.omega for point in diagram.special_points if point.type == kind]
        for printed in every:
            ours = min(found, key=lambda omega: abs(omega - printed))
            problem = "supported square, 50 N at .2, .3 m (SSMTool), rad/s"
            yield Row(problem, name, printed, float(ours), RESPONSE)


def shells_of_ssmtool(folder):
    """Arcs, 1 m wide, of span 2 m, 10 mm, E 70 GPa, rho 2700, nu .33, hinged at their ends."""
    for height, printed in (
        (0.1, (147.45, 315.98, 413.19, 545.15, 596.01)),
        (0.041, (149.22, 298.78, 339.73, 353.56, 426.17)),
    ):
        radius = (height**2 + 1) / (2 * height)
        x, y = (values.ravel() for values in np.meshgrid([-0.5, 0.0, 0.5], np.linspace(-1, 1, 401)))
        arc = Path(folder) / f"arc{height}.csv"
        np.savetxt(arc, np.column_stack([x, y, np.sqrt(radius**2 - y**2)]), delimiter=",")
        ends = dict.fromkeys(("bottom", "top"), "simply_supported")
        scene = Scene(
            geometry=Rectangle(1, 2),
            plate=Plate(0.01, model="shell", initial_shape=arc),
            material=Material(70e9, 0.33, 2700),
            tension=Tension(0, 0),
            support=Support(ends | {"default": "free"}),
            modes=Modes(count=len(printed)),
            accuracy=Accuracy(tolerance=1e-4),
        )
        plan = Plan.of(scene)
        modes = shell.solve(alone(), plan, SHELLS, Stopwatch(None)).modes
        ours = 2 * np.pi * plan.scales.frequency(modes.eigenvalues)
        for place, value in enumerate(printed):
            problem = f"arc of height {height} m (SSMTool), rad/s"
            why = "its mesh of 400 flat triangles"
            yield Row(problem, f"mode {place + 1}", value, float(ours[place]), why)


def drum_of_davidovikj():
    """Cubic stiffness of a graphene drum's first mode by its radius and E h."""
    nu, radius, h = 0.16, 2.5e-6, 5e-9
    model, _ = film(
        Disc(radius),
        "clamped",
        1,
        nu,
        plate=Plate(h, model="membrane"),
        material=Material(1e12, nu, 2267),
        tension=Tension(0.3),
    )
    printed = np.pi / (1.27 - 0.97 * nu - 0.27 * nu**2)
    yield Row(
        "graphene drum, nu .16 (Davidovikj et al. 2017, doi:10.1038/s41467-017-01351-4)",
        "k3 by E h/R^2",
        round(float(printed), 4),
        float(model.cubic[0, 0, 0, 0] * radius**2 / (1e12 * h)),
        "its formula is rounded to two digits",
    )


def rows():
    """All of them."""
    with tempfile.TemporaryDirectory() as folder:
        shells = list(shells_of_ssmtool(folder))
    return [
        *plates(),
        *square_of_ssmtool(),
        *response_of_ssmtool(),
        *shells,
        *drum_of_davidovikj(),
    ]


def page():
    """The page's text."""
    return HEAD + "\n".join(row.line() for row in rows()) + "\n"


if __name__ == "__main__":
    DOCUMENT.write_text(page(), encoding="utf-8")
