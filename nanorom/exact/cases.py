"""Scenes whose frequencies and tensors are known without finite elements."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable
from functools import cache
from pathlib import Path

import attrs
import numpy as np
from scipy.optimize import brentq

from nanorom.exact import drum as spectral
from nanorom.rom.model import ReducedModel
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Disc, Rectangle, String
from nanorom.scene.material import Material
from nanorom.scene.scene import Accuracy, Modes, Scene
from nanorom.scene.support import Support
from nanorom.types import Array

DATA = Path(__file__).parent / "data"

RADIUS, THICKNESS, MODULUS, DENSITY, NU = 2.5e-6, 10e-9, 410e9, 2267.0, 0.16
BUCKLING = 14.681970642123893  # -T R^2/D of a clamped disc: the square of J_1's first zero
EQUAL_DIGITS = 11  # of the logarithm of frequencies that are one
SMALL_STRAIN = 1e-3  # in-plane resonances are far above those of the deflection


@attrs.frozen(eq=False)
class Case:
    """A scene and its exact solution.

    frequency: () -> (L,) Hz; cubic: () -> (L, L, L, L) N/m^3; both are computed when asked for.
    signs_free: the exact shapes' signs follow another rule than the model's.
    """

    name: str
    scene: Scene
    frequency: Callable[[], Array]
    cubic: Callable[[], Array]
    signs_free: bool = False

    def errors(self, model: ReducedModel) -> tuple[float, float]:
        """Largest relative error of a frequency; of the tensor relative to its largest entry."""
        return self.errors_of(model.frequency, model.cubic)

    def errors_of(self, frequency: Array, cubic: Array) -> tuple[float, float]:
        """The same of plain arrays."""
        # models rank near ones by name
        ranks = np.argsort(np.argsort(np.round(np.log(frequency), EQUAL_DIGITS), kind="stable"))
        exact = self.cubic()[np.ix_(ranks, ranks, ranks, ranks)]
        if self.signs_free:
            cubic = with_signs_of(cubic, exact)
        frequency_error = np.abs(frequency / self.frequency()[ranks] - 1).max()
        return float(frequency_error), float(np.abs(cubic - exact).max() / np.abs(exact).max())


def with_signs_of(cubic: Array, exact: Array) -> Array:
    """The tensor with the signs of shapes that bring it nearest to another."""
    best = cubic
    for signs in itertools.product((1.0, -1.0), repeat=len(cubic) - 1):
        s = np.array([1.0, *signs])
        turned = np.einsum("rjkl,r,j,k,l->rjkl", cubic, s, s, s, s)
        if np.abs(turned - exact).max() < np.abs(best - exact).max():
            best = turned
    return best


# -- drums ----------------------------------------------------------------------------------------


@attrs.frozen
class Film:
    """A round film: radius, thickness (m), Young's modulus (Pa), Poisson's ratio."""

    radius: float = RADIUS
    thickness: float = THICKNESS
    modulus: float = MODULUS
    nu: float = NU

    @property
    def rigidity(self) -> float:
        """Bending stiffness D in N m."""
        return self.modulus * self.thickness**3 / (12 * (1 - self.nu**2))

    @property
    def tension_unit(self) -> float:
        """D/R^2 in N/m."""
        return self.rigidity / self.radius**2

    def scene(self, tension: Tension, count: int, model: str = "plate") -> Scene:
        """Clamped drum of this film."""
        return Scene(
            geometry=Disc(radius=self.radius),
            plate=Plate(thickness=self.thickness, model=model),
            material=Material(youngs_modulus=self.modulus, poisson_ratio=self.nu, density=DENSITY),
            tension=tension,
            modes=Modes(count=count),
        )

    def in_si(
        self, solution: Callable[[], spectral.Drum], stiffness: float
    ) -> tuple[Callable[[], Array], Callable[[], Array]]:
        """Frequencies and tensor of a solution in units of some stiffness (N/m)."""
        scale = np.sqrt(stiffness / (DENSITY * self.thickness)) / self.radius / (2 * np.pi)
        unit = self.modulus * self.thickness / self.radius**2
        return (
            cache(lambda: scale * solution().omega),
            cache(lambda: unit * solution().tensor(self.nu)),
        )


GRAPHENE = Film()


def drum(kappa: float, count: int = 11, film: Film | None = None) -> Case:
    """Clamped drum with T R^2/D = kappa; infinite for a membrane.

    Unless a film is given it is graphene's, or so thin that the tension stretches it little.
    """
    membrane = bool(np.isinf(kappa))
    if film is None:
        thin = RADIUS * np.sqrt(12 * SMALL_STRAIN / max(kappa, 1e-300))
        film = attrs.evolve(GRAPHENE, thickness=THICKNESS if membrane else min(THICKNESS, thin))
    tension = film.modulus * film.thickness * 1e-4 if membrane else kappa * film.tension_unit
    scene = film.scene(Tension(tension, tension), count, "membrane" if membrane else "plate")
    solution = cache(lambda: spectral.isotropic(kappa, count))
    name = "membrane drum" if membrane else f"drum, T R^2/D = {kappa:g}"
    return Case(name, scene, *film.in_si(solution, tension if membrane else film.tension_unit))


def unequal_drum(kappa_x: float, kappa_y: float, count: int = 11, film: Film = GRAPHENE) -> Case:
    """Clamped drum under different tensions along x and y."""
    unit = film.tension_unit
    scene = film.scene(Tension(kappa_x * unit, kappa_y * unit), count)
    solution = cache(lambda: spectral.anisotropic(kappa_x, kappa_y, count))
    name = f"drum, T R^2/D = {kappa_x:g}, {kappa_y:g}"
    return Case(name, scene, *film.in_si(solution, unit))


def paper_drum(count: int = 11) -> Case:
    """The graphene drum of the paper: E = 410 GPa, T_x = 0.321 and T_y = 0.257 N/m."""
    unit = GRAPHENE.tension_unit
    case = unequal_drum(0.321 / unit, 0.257 / unit, count)
    return attrs.evolve(case, name="paper's drum")


# -- square ---------------------------------------------------------------------------------------


def square(count: int = 6, longer: float = 0.0) -> Case:
    """Square membrane, nu = 0.25, immovable edges; along y it may be a little longer, relative.

    Its frequencies are then the rectangle's; its tensor is that of the square.

    Provenance of the tensor: Ritz' method with exact shapes and integrated Legendre polynomials
    for the in-plane displacement, extrapolated from N = 28, 40, 56, 80 (last change 2e-10).
    """
    data = json.loads((DATA / "square-membrane.json").read_text())
    side, thickness, modulus, tension = 1e-4, 1e-7, 1e11, 10.0
    scene = Scene(
        geometry=Rectangle(length=side, width=side * (1 + longer)),
        plate=Plate(thickness=thickness, model="membrane"),
        material=Material(youngs_modulus=modulus, poisson_ratio=data["nu"], density=DENSITY),
        tension=Tension(x=tension, y=tension),
        modes=Modes(count=count),
    )
    waves = np.array(data["modes"][:count]) / [1.0, 1.0 + longer]
    tensor = symmetric_tensor(data["T"], len(data["modes"]))[(slice(count),) * 4]
    speed = np.sqrt(tension / (DENSITY * thickness))
    return Case(
        "square membrane",
        scene,
        lambda: speed * np.linalg.norm(waves, axis=1) / (2 * side),
        lambda: modulus * thickness / side**2 * tensor,
        signs_free=True,
    )


def symmetric_tensor(entries: list, size: int) -> Array:
    """Dense tensor from [r, j, k, l, value] rows with 1-based r <= j <= k <= l."""
    tensor = np.zeros((size,) * 4)
    for *index, value in entries:
        for order in itertools.permutations(i - 1 for i in index):
            tensor[order] = value
    return tensor


# -- string ---------------------------------------------------------------------------------------


def string(
    count: int = 4, layer: float = 0.01, ends: str = "clamped", model: str = "plate"
) -> Case:
    """Narrow string, nu = 0, free sides, sqrt(D/T) = layer x length; layer 0: a membrane.

    Without lateral contraction nothing depends on y, so that beam theory is exact.  The stretching
    is uniform: B_rjkl = E A/(2 L) (s_rj s_kl + s_rk s_jl + s_rl s_jk)/3, s_jk = int phi_j' phi_k'.
    """
    length, thickness, modulus = 1e-4, 1e-7, 250e9
    width = min(1e-6, layer * length) if layer else 1e-6  # wider ones twist among these modes
    bending = modulus * thickness**3 / 12
    tension = bending / (layer * length) ** 2 if layer else 80.0
    scene = Scene(
        geometry=String(length=length, width=width),
        plate=Plate(thickness=thickness, model=model if layer else "membrane"),
        material=Material(youngs_modulus=modulus, poisson_ratio=0.0, density=DENSITY),
        tension=Tension(x=tension, y=0.0 if layer else tension),
        support=Support({"left": ends, "right": ends}),
        modes=Modes(count=count),
    )
    kappa = length**2 * tension / bending if layer else np.inf
    wave = [_beam_wave(kappa, n, ends) for n in range(1, count + 1)]
    square = np.array([b**2 * (1 + b**2 / kappa) for b, _ in wave])  # omega^2 rho A L^2/S
    slopes = _beam_slopes(wave)
    pairs = slopes[:, :, None, None] * slopes
    pairs = (pairs + pairs.transpose(0, 2, 1, 3) + pairs.transpose(0, 3, 2, 1)) / 3
    speed = np.sqrt(tension / (DENSITY * thickness))
    return Case(
        f"string as a {model}, {ends}, layer {layer:g}",
        scene,
        lambda: speed / length * np.sqrt(square) / (2 * np.pi),
        lambda: modulus * thickness * width / (2 * length**3) * pairs,
        signs_free=True,
    )


def _beam_wave(kappa: float, n: int, ends: str) -> tuple[float, float]:
    """Wavenumbers (b, g) times length of mode n: cos or sin(b x) and cosh or sinh(g x) about the
    middle; g is infinite where there is no layer."""
    if ends == "simply_supported" or np.isinf(kappa):
        return n * np.pi, np.inf

    def condition(b: float) -> float:
        g = np.sqrt(b**2 + kappa)
        if n % 2:  # even about the middle: b tan(b/2) + g tanh(g/2) = 0
            return float(b * np.sin(b / 2) + g * np.tanh(g / 2) * np.cos(b / 2))
        return float(g * np.sin(b / 2) - b * np.tanh(g / 2) * np.cos(b / 2))

    low, high = n * np.pi, (n + 1) * np.pi
    b = float(brentq(condition, low * (1 + 1e-9), high * (1 - 1e-9), xtol=1e-14, rtol=1e-14))
    return b, float(np.sqrt(b**2 + kappa))


def _beam_slopes(waves: list[tuple[float, float]]) -> Array:
    """int_0^1 phi_j' phi_k' dx of shapes with max |phi| = 1, by composite Gauss quadrature."""
    nodes, weights = np.polynomial.legendre.leggauss(20)
    # panels that shrink towards the ends, where the layers are
    edges = np.concatenate([[-0.5], -0.5 + 0.5 * 0.5 ** np.arange(16, -1, -1)])
    edges = np.concatenate([edges, -edges[-2::-1]])
    half = np.diff(edges) / 2
    x = (edges[:-1] + half)[:, None] + half[:, None] * nodes
    derivatives = [_beam_shape(n, *wave, x)[1] for n, wave in enumerate(waves, 1)]
    weighted = half[:, None] * weights
    return np.array([[np.sum(a * b * weighted) for b in derivatives] for a in derivatives])


def _beam_shape(n: int, b: float, g: float, x: Array) -> tuple[Array, Array]:
    """Shape and slope of mode n at x from -1/2 to 1/2, max |phi| = 1."""
    even = bool(n % 2)

    def raw(x: Array) -> tuple[Array, Array]:
        turn, across = (np.cos(b * x), -np.sin(b * x)) if even else (np.sin(b * x), np.cos(b * x))
        value, slope = turn, b * across
        if np.isfinite(g):
            # cosh(g x)/cosh(g/2) and sinh(g x)/sinh(g/2) without overflow
            rise, fall = np.exp(g * (x - 0.5)), np.exp(-g * (x + 0.5))
            sign = 1.0 if even else -1.0
            scale = 1 + sign * np.exp(-g)
            end = np.cos(b / 2) if even else np.sin(b / 2)
            value = value - end * (rise + sign * fall) / scale
            slope = slope - end * g * (rise - sign * fall) / scale
        return value, slope

    grid = np.linspace(-0.5, 0.5, 4000)
    slopes = raw(grid)[1]
    turns = np.flatnonzero(slopes[:-1] * slopes[1:] < 0)
    tops = [
        brentq(lambda y: float(raw(np.array(y))[1]), grid[i], grid[i + 1], xtol=1e-15)
        for i in turns
    ]
    values = raw(np.array(tops))[0]
    size = float(values[np.abs(values).argmax()])
    value, slope = raw(x)
    return value / size, slope / size


def with_scene(case: Case, scene: Scene) -> Case:
    """The same exact solution for a scene that differs in how it is solved."""
    return attrs.evolve(case, scene=scene)


def with_tolerance(case: Case, tolerance: float) -> Case:
    """The case with a tolerance in its scene."""
    return attrs.evolve(case, scene=case.scene.with_(tolerance=tolerance))


def by_hand(case: Case, degree: int, cells: float, length: float) -> Case:
    """The case with a degree and a mesh size of length/cells in its scene."""
    accuracy = Accuracy(degree=degree, mesh_size=length / cells)
    return attrs.evolve(case, scene=case.scene.with_(accuracy=accuracy))
