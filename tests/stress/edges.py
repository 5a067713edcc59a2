"""Errors told of rectangles beside those by hp elements, on random supports with seeds.

Edges are clamped, supported, free or elastic, from nearly free to nearly rigid, and in the plane
fixed, sliding, free or elastic; tension is sheared and relaxes, up to the verge of buckling; a
rectangle of another thickness lies somewhere.  Length, modulus and density are 1.

./run python -m tests.stress.edges [COUNT]
"""

import itertools
import warnings

import attrs
import numpy as np

from nanorom.bench import bounded, report
from nanorom.errors import AccuracyWarning, NanoromError
from nanorom.fem.reduce import reduce_scene
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Rectangle
from nanorom.scene.material import Material
from nanorom.scene.outlines import RectangleRegion
from nanorom.scene.scene import Accuracy, Modes, Scene
from nanorom.scene.support import Edge, PlaneSpring, Spring, Support
from tests.fem.hp import SIDES, Film, Solver

SEED = 1201
KINDS = {"c": "clamped", "s": "simply_supported", "f": "free"}
FAMILIES = ("springs", "plane", "slender", "patch", "buckled")
ORDERS = ((6, 4), (7, 5))  # degree and layers of the solution held against, and of the better one
STEPPED = ((5, 2), (7, 3))  # the same with a patch, whose lines double the elements
SETTLED = 0.5  # of their difference: what may be left of the better one's error
ROUNDING = 1e-11


@attrs.frozen
class Case:
    """A film; errors of frequencies and tensor, those told, and the larger ratio of the two."""

    seed: int
    film: str
    tolerance: float
    frequency: float
    told_frequency: float
    tensor: float
    told_tensor: float
    ratio: float
    verdict: str


def rigidity(film):
    return film.thickness**3 / 12 / (1 - film.nu**2)


def drawn(seed):
    """Family, film, number of modes and tolerance of a seed."""
    random = np.random.default_rng([SEED, seed])
    family = FAMILIES[seed % len(FAMILIES)]
    film = Film(
        1.0,
        float(random.uniform(0.05, 0.25) if family == "slender" else random.uniform(0.3, 1.1)),
        float(random.choice([1e-2, 1e-3, 1e-4])),
        float(random.uniform(-0.3, 0.48)),
        dict.fromkeys(SIDES, "f"),
        dict.fromkeys(SIDES, "free"),
    )
    held = random.permutation(SIDES)[: random.integers(2, 4)]
    kinds = [_deflection(random, rigidity(film), family == "springs") for _ in held]
    kinds[0] = "c" if family != "springs" or random.random() < 0.5 else kinds[0]
    film = attrs.evolve(
        film,
        deflection=film.deflection | dict(zip(held, kinds)),
        in_plane=film.in_plane | dict.fromkeys(held, "fixed"),
    )
    if family in ("plane", "buckled"):
        moves = {side: _in_plane(random, film.thickness) for side in SIDES}
        film = attrs.evolve(film, in_plane=moves | {held[0]: "fixed"})
    pull = rigidity(film) * 10.0 ** random.uniform(0, 3.5) * random.uniform(0.2, 1, 2)
    shear = random.uniform(-0.6, 0.6) * np.sqrt(pull.prod()) if family == "plane" else 0.0
    if family == "buckled":
        pull *= -1.0
    if family == "springs":
        pull *= 0.0
    film = attrs.evolve(film, tension=(*map(float, pull), float(shear)))
    tolerance = float(10.0 ** -random.integers(3, 8))
    if family == "patch":
        film = attrs.evolve(film, patch=_patch(random, film.b))
    if family == "buckled":
        share = random.choice([0.9, 0.99, 0.999])
        critical = Solver(film, 7, 3).buckling()
        factor = share * critical if np.isfinite(critical) else 0.0  # it relaxes wholly
        film = attrs.evolve(film, tension=tuple(factor * t for t in film.tension))
        tolerance = max(tolerance, 1e-6)
    return family, film, int(random.integers(1, 5)), tolerance


def _deflection(random, unit, extreme):
    kind = str(random.choice(["c", "s", "e"]))
    if kind != "e":
        return kind
    low, high = ((-2, 0), (6, 8)) if extreme else ((0, 2), (2, 5))
    span = low if random.random() < 0.5 else high
    return tuple(float(unit * 10.0 ** random.uniform(*span) * share) for share in (1.0, 0.1))


def _in_plane(random, unit):
    kind = str(random.choice(["fixed", "normal", "tangential", "free", "e", "e"]))
    return tuple(unit * 10.0 ** random.uniform(-2, 3, 2)) if kind == "e" else kind


def _patch(random, width):
    x = np.sort(random.uniform(0.1, 0.9, 2)) + [-0.08, 0.08]
    y = np.array([0.0, width]) if random.random() < 0.5 else width * np.array([0.25, 0.7])
    return *map(float, x), *map(float, y), float(random.uniform(0.4, 2.5))


def scene(film, count, tolerance):
    """The film as a scene."""

    def edge(side):
        kind, plane = film.deflection[side], film.in_plane[side]
        w = KINDS[kind] if isinstance(kind, str) else Spring(spring=kind[0], rotational=kind[1])
        return Edge(w=w, in_plane=plane if isinstance(plane, str) else PlaneSpring(*plane))

    regions = []
    if film.patch is not None:
        x0, x1, y0, y1, factor = film.patch
        regions.append(
            RectangleRegion(
                length=x1 - x0,
                width=y1 - y0,
                position=((x0 + x1 - film.a) / 2, (y0 + y1 - film.b) / 2),
                thickness=factor * film.thickness,
            )
        )
    return Scene(
        geometry=Rectangle(film.a, film.b),
        plate=Plate(thickness=film.thickness, model="plate"),
        material=Material(youngs_modulus=1.0, poisson_ratio=film.nu, density=1.0),
        tension=Tension(*film.tension),
        support=Support({side: edge(side) for side in SIDES}),
        modes=Modes(count=count),
        accuracy=Accuracy(tolerance=tolerance),
        regions=regions,
    )


def apart(one, other):
    """Largest difference of two tensors by the largest entry, whatever the signs of the modes."""
    signs = (np.array(s) for s in itertools.product((1, -1), repeat=len(one)))
    turned = (np.einsum("ijkl,i,j,k,l->ijkl", one, s, s, s, s) for s in signs)
    return min(np.abs(t - other).max() for t in turned) / np.abs(other).max()


def held(film, count, tolerance, orders=None):
    """Errors (2,) of frequencies and tensor, those told (2,), and unknowns of w."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AccuracyWarning)
        model = reduce_scene(scene(film, count, tolerance))
    orders = orders or (ORDERS if film.patch is None else STEPPED)
    rough, fine = (Solver(film, *order).solve(count) for order in orders)
    frequency = np.abs(2 * np.pi * model.frequency / fine.omega - 1).max()
    known = np.abs(rough.omega / fine.omega - 1).max(), apart(rough.cubic, fine.cubic)
    errors = np.array([frequency, apart(model.cubic, fine.cubic)]) - SETTLED * np.array(known)
    told = np.array([model.diagnostics[key] for key in ("error_frequency", "error_tensor")])
    return np.maximum(errors, 0.0), told, int(model.diagnostics["dofs"])


def case(seed):
    """A seed's film held against hp elements, or what became of it."""
    family, film, count, tolerance = drawn(seed)
    unit = rigidity(film)
    kinds = "".join(k if isinstance(k, str) else "e" for k in film.deflection.values())
    tension = ", ".join(f"{t / unit:.3g}" for t in film.tension)
    text = f"{family} 1 x {film.b:.2f}, {kinds}, T {tension}, nu {film.nu:.2f}, {count} modes"
    nothing = [np.nan] * 5
    try:
        errors, told, _ = held(film, count, tolerance)
    except NanoromError as error:
        return Case(seed, text, tolerance, *nothing, f"refused: {error}")
    ratio = float((errors / np.maximum(told, ROUNDING)).max())
    numbers = errors[0], told[0], errors[1], told[1]
    return Case(
        seed,
        text,
        tolerance,
        *map(float, numbers),
        ratio,
        "ok" if told.max() <= tolerance else "not met",
    )


def bounded_case(seed):
    """The same in a process of its own, which is ended where it takes too much."""
    try:
        return bounded.bounded(case, seed)
    except bounded.Bound as error:
        return Case(seed, FAMILIES[seed % len(FAMILIES)], *[np.nan] * 6, f"unfinished: {error}")


if __name__ == "__main__":
    report.tabled(bounded_case, "tests.stress.edges", 40)
