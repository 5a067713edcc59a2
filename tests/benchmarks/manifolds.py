"""Write manifolds.md: published manifolds beside ours, and ours beside all modes.

./run python -m tests.benchmarks.manifolds
"""

from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

import numpy as np
from scipy.interpolate import CubicSpline, griddata
from scipy.optimize import linear_sum_assignment

import nanorom
from nanorom import (
    Damping,
    Drive,
    Material,
    Modes,
    Plate,
    Rectangle,
    Scene,
    String,
    Support,
    Sweep,
    Tension,
)
from nanorom.continuation import ModalSystem, backbone, explore
from nanorom.scene.scene import Accuracy
from tests.rom.manifold.systems import one_to_two

DOCUMENT = Path(__file__).with_suffix(".md")
HEAD = """# Invariant manifolds

`./run python -m tests.benchmarks.manifolds` writes this page anew. "All modes": harmonic balance
and shooting of the same modal model (`explore`, `backbone`). Printed numbers are those of SSMTool
and MORFE, of meshes and elements of their own. Manifolds of solids and shells are of all
their degrees of freedom (`nanorom.manifold(scene)`), the others of modal models.

| problem | quantity | printed | manifold | order | all modes | of the printed one |
|---|---|---|---|---|---|---|
"""


def line(problem, quantity, printed, own, order, exact, why):
    told = "" if printed is None else f"{printed:g}"
    return f"| {problem} | {quantity} | {told} | {own} | {order} | {exact} | {why} |"


def beside(problem, printed, reduced, system, omega, direct, why):
    """Rows of special points: printed ones by type, those of the manifold, those of all modes."""
    found = reduced.response(omega, direct=direct)
    exact = explore(system, omega=omega, direct=direct)
    for kind, values in printed.items():
        own = paired(values, [point.omega for point in found.points(kind)])
        known = paired(own, [point.omega for point in exact.points(kind)])
        for told, here, there in zip(values, own, known):
            yield line(problem, kind, told, f"{here:.7g}", reduced.order, f"{there:.7g}", why)


def paired(values, others):
    """Of others, one for each value, as near as can be."""
    distance = np.abs(np.subtract.outer(values, others))
    return np.array(others)[linear_sum_assignment(distance)[1]]


def oscillators():
    system = one_to_two()
    reduced = nanorom.manifold(system, [1, 2], 7)
    printed = {"NS": (0.987743, 1.009667)}
    yield from beside("1:2 oscillators", printed, reduced, system, (0.9, 1.1), 0.01, "")


def beam(length, width, thickness, material, right, count):
    scene = Scene(
        geometry=String(length, width),
        plate=Plate(thickness, model="beam"),
        material=material,
        tension=Tension(0, 0),
        support=Support({"left": "clamped", "right": right}),
        modes=Modes(count=count),
        accuracy=Accuracy(tolerance=1e-8),
    )
    model = nanorom.reduce(scene)
    x = model.shapes.points[:, 0]
    middle = np.abs(x - (x.min() + x.max()) / 2).argmin()
    return model, model.shapes.values[:, middle]


def clamped_beam():
    """1000 x 10 x 24 um, bending across 10 um; midspan .25756 thicknesses."""
    model, middle = beam(1e-3, 24e-6, 1e-5, Material(160e9, 0.22, 2320), "clamped", 8)
    at = 0.25756e-5
    exact = backbone(model.system(damped=False), 0, amplitude=1.3 * at, tolerance=1e-11)
    reached = [np.abs(o.time_series(256, 1)[1] @ middle).max() for o in exact.orbits]
    known = CubicSpline(reached, exact.omega)(at) / (2 * np.pi * model.frequency[0])
    for order in (3, 5, 7):
        reduced, q = nanorom.manifold(model, [1], order), at
        for _ in range(20):
            motion = reduced.motions([q])[0]
            q *= at / (np.abs(motion.q @ middle).max() * reduced.equations.amplitude)
        own = reduced.backbone([q])[0][0] / (2 * np.pi * model.frequency[0])
        printed = 1.018217 if order == 3 else None
        why = "solid elements" if printed else ""
        yield line("clamped beam", "w/w1", printed, f"{own:.6f}", order, f"{known:.6f}", why)


def solid_beam():
    """The same of solid elements, every degree of freedom following; and twice as far."""
    ends = {"left": "clamped", "right": "clamped", "bottom": "free", "top": "free"}
    scene = Scene(
        geometry=Rectangle(1e-3, 24e-6),
        plate=Plate(1e-5, model="solid"),
        material=Material(160e9, 0.22, 2320),
        tension=Tension(0, 0),
        support=Support(ends),
        modes=Modes(count=6),
        damping=Damping(1000),
        accuracy=Accuracy(tolerance=1e-2),
    )
    for order in (3, 5, 7, 9):
        reduced = nanorom.manifold(scene, [1], order)
        shapes = reduced.model.shapes
        middle = shapes.values[:, np.hypot(*shapes.points[:, :2].T).argmin()]
        for times in (1, 2):
            at = q = times * 0.25756e-5
            for _ in range(20):
                motion = reduced.motions([q])[0]
                q *= at / (np.abs(motion.q @ middle).max() * reduced.equations.amplitude)
            own = reduced.backbone([q])[0][0] / (2 * np.pi * reduced.model.frequency[0])
            printed = 1.018217 if (order, times) == (3, 1) else None
            what = "w/w1" if times == 1 else "w/w1, twice as far"
            yield line("solid clamped beam", what, printed, f"{own:.6f}", order, "", "")


def arc():
    """1 x 2 m, 10 mm, sagitta .1 m, 10 N at a quarter of its length, Q 250: a shell."""
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(-1.001, 1.001, 201), (-0.51, 0.0, 0.51)))
    radius = (1 + 0.1**2) / 0.2
    height = np.sqrt(radius**2 - x**2) - (radius - 0.1)
    with TemporaryDirectory() as folder:
        file = Path(folder) / "arc.csv"
        np.savetxt(file, np.column_stack([x, y, height]), delimiter=",")
        held = {"left": "simply_supported", "right": "simply_supported"}
        scene = Scene(
            geometry=Rectangle(2.0, 1.0),
            plate=Plate(0.01, "shell", file),
            material=Material(70e9, 0.33, 2700),
            tension=Tension(0, 0),
            support=Support(held | {"bottom": "free", "top": "free"}),
            modes=Modes(4),
            damping=Damping(250),
            drive=Drive(10.0, direct_pattern="point", position=["-0.5 m", "0 m"]),
            sweep=Sweep("0.98 f1", "1.01 f1"),
            accuracy=Accuracy(degree=5, mesh_size=0.5),
        )
        for order in (3, 5, 7, 9):
            reduced = nanorom.manifold(scene, [1], order)
            first = 2 * np.pi * reduced.model.frequency[0]
            found = reduced.response((0.96 * first, 1.02 * first), direct=10.0)
            folds = sorted(point.omega / first for point in found.points("LP"))
            for told, own in zip((0.99145, 0.99396), folds):
                printed, why = (told, "its mesh; not taken apart") if order == 7 else (None, "")
                yield line("shallow arc, shell", "LP by w1", printed, f"{own:.5f}", order, "", why)


def pinned_beam():
    """2700 x 10 x 10 mm, a spring of 37 N/m and 20 mN at midspan, C = 2e-4/9 K."""
    material = Material(45e9, 0.3, 1780)
    model, middle = beam(2.7, 0.01, 0.01, material, "simply_supported", 8)
    stiffness = model.stiffness + 37 * np.outer(middle, middle)
    system = ModalSystem(
        mass=model.mass,
        damping=2e-4 / 9 * stiffness,
        stiffness=stiffness,
        cubic=model.cubic,
        direct=middle,
    )
    reduced = nanorom.manifold(system, [1, 2], 7)
    printed = {"LP": (33.522, 33.523), "NS": (33.841, 34.028)}
    why = "its mesh; not taken apart"
    yield from beside("clamped-pinned beam, 1:3", printed, reduced, system, (32.5, 35), 0.02, why)


def square_plate():
    """1 m, 10 mm, simply supported; 50 N at (.2, .3), C = M + 4e-6 K; the pair split along the
    diagonals, as a mesh of triangles does, or not.
    """
    scene = Scene(
        geometry=Rectangle(1, 1),
        plate=Plate(0.01, model="plate"),
        material=Material(70e9, 0.33, 2700),
        support=Support("simply_supported"),
        modes=Modes(count=11),
    )
    model = nanorom.reduce(scene)
    places = model.shapes.points[:, :2] - model.shapes.points[:, :2].min(axis=0)
    push = [griddata(places, v, [(0.2, 0.3)], method="cubic")[0] for v in model.shapes.values]
    turn = np.array([[1, -1], [1, 1]]) / np.sqrt(2)
    for name, pair in (("split", (767.2, 768.2)), ("exact pair", None)):
        stiffness = np.array(model.stiffness)
        if pair is not None:
            stiffness[1:3, 1:3] = model.mass[1] * turn.T @ np.diag(np.square(pair)) @ turn
        system = ModalSystem(
            mass=model.mass,
            damping=np.diag(model.mass) + 4e-6 * stiffness,
            stiffness=stiffness,
            cubic=model.cubic,
            direct=push,
        )
        reduced = nanorom.manifold(system, [2, 3], 7)
        printed = {"LP": (776.69, 778.19, 778.50, 799.34), "NS": (778.89, 781.90)}
        why = "its mesh of flat triangles" if pair else "its mesh splits the pair by .13 %"
        yield from beside(f"square plate, {name}", printed, reduced, system, (750, 830), 50, why)


def cost():
    """A film-like model of forty modes: a sum of squares of quadratic forms, as stretching is."""
    random, modes = np.random.default_rng(1), 40
    frequency = np.sort(random.uniform(1, 9, modes))
    frequency[0] = 1.0
    forms = random.standard_normal((60, modes, modes)) / modes
    forms = forms + forms.transpose(0, 2, 1)
    squares = np.einsum("sij,skl->ijkl", forms, forms, optimize=True)
    cubic = squares + squares.transpose(0, 2, 1, 3) + squares.transpose(0, 3, 2, 1)
    system = ModalSystem(
        damping=frequency / 100, stiffness=frequency**2, cubic=cubic / cubic[0, 0, 0, 0]
    )
    begin = process_time()
    reach = nanorom.manifold(system, [1], 7).validity
    return (
        f"\nForty modes, one master, order 7, with its range (to {reach:.3g} of the displacement\n"
        f"at which cubic and linear force are equal): {process_time() - begin:.1f} s CPU.\n"
    )


if __name__ == "__main__":
    parts = (oscillators, clamped_beam, solid_beam, arc, pinned_beam, square_plate)
    table = "\n".join(row for part in parts for row in part())
    DOCUMENT.write_text(HEAD + table + "\n" + cost(), encoding="utf-8")
