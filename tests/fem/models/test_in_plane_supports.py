"""Supports in the plane of their own, free plates, sheared tension: exact and Ritz' solutions.

All scenes are without units: radius or length 1, E = rho = 1, thickness .01, nu = .3.
"""

import numpy as np
import pytest
from numpy.polynomial import legendre, polynomial
from scipy.linalg import eigh
from scipy.optimize import brentq
from scipy.special import iv, ivp, jv, jvp

import nanorom
from nanorom.scene.scene import (
    Accuracy,
    Disc,
    Edge,
    Material,
    Modes,
    PlaneSpring,
    Plate,
    Rectangle,
    Reduction,
    Scene,
    Support,
    Tension,
)

NU, H = 0.3, 0.01
D = H**3 / 12 / (1 - NU**2)
TOLERANCE = 1e-6  # asked for
RATIO = 3.0  # of a true error to the estimate that is told
ROUNDING = 1e-11
RITZ = 1e-10  # of Ritz' polynomials where the solution has corners, by their own convergence


def scene(geometry, edge, count=1, tension=(0.0, 0.0, 0.0), model="plate", **more):
    return Scene(
        geometry=geometry,
        plate=Plate(thickness=H, model=model),
        material=Material(youngs_modulus=1, poisson_ratio=NU, density=1),
        tension=Tension(*tension),
        support=Support(edge=edge),
        modes=Modes(count=count),
        **{"accuracy": Accuracy(tolerance=TOLERANCE)} | more,
    )


def check(model, i, exact, known=ROUNDING):
    """The diagonal cubic entry of a mode is one known from elsewhere, as nearly as is told."""
    error = abs(model.cubic[i, i, i, i] / exact - 1)
    assert error < TOLERANCE
    assert error < RATIO * model.diagnostics["error_tensor"] + known


# -- rectangle of sides 1 and .8, simply supported: w = sin(pi x/a) sin(pi y/b) --------------------

SIDES = np.array([1.0, 0.8])


def movement_held_across():
    """Airy's function of immovable edges without shear: two cosines and two mean tensions."""
    (a, b), (p, q) = SIDES, (np.pi / SIDES) ** 2
    mean = (p**2 + q**2 + 2 * NU * p * q) / (128 * (1 - NU**2))
    return 4 * a * b * H * ((p**2 + q**2) / 256 + mean)


def movement_held_along():
    """Airy's function of edges without normal tension that do not move along: a double series."""
    (a, b), (p, q) = SIDES, (np.pi / SIDES) ** 2
    m = np.arange(1, 400, 2)
    mean, twice = 2 / (np.pi * m), 2 * m / (np.pi * (m**2 - 4.0))  # of 1 and of cos(2 pi s)
    load = H * p * q / 2 * a * b * (np.outer(twice, mean) + np.outer(mean, twice))
    k = ((m * np.pi / a) ** 2)[:, None] + (m * np.pi / b) ** 2
    return 4 * np.sum((4 / (a * b) * load / k) ** 2) * a * b / 4 / (2 * H)


def movement_free(n=30):
    """Airy's function that vanishes with its slope: Ritz' of the complementary energy."""
    (a, b), (p, q) = SIDES, (np.pi / SIDES) ** 2
    s, weight = legendre.leggauss(2 * n + 20)
    square = polynomial.polymul([1, 0, -1], [1, 0, -1])
    values = []
    for k in range(0, n, 2):
        c = polynomial.polymul(square, legendre.leg2poly(np.eye(k + 1)[k]))
        values.append(
            [polynomial.polyval(s, polynomial.polyder(c, d) if d else c) for d in range(3)]
        )
    f0, f1, f2 = np.array(values).transpose(1, 0, 2)
    t = (s + 1) / 2

    def gram(f, g):
        return np.einsum("iq,jq,q->ij", f, g, weight)

    x, y = 2 / a, 2 / b
    k = (
        x**4 * np.kron(gram(f2, f2), gram(f0, f0))
        + y**4 * np.kron(gram(f0, f0), gram(f2, f2))
        + x**2 * y**2 * (np.kron(gram(f2, f0), gram(f0, f2)) + np.kron(gram(f0, f2), gram(f2, f0)))
    )
    curl = np.cos(2 * np.pi * t)
    one, wave = np.einsum("iq,q->i", f0, weight), np.einsum("iq,q,q->i", f0, curl, weight)
    load = p * q / 2 * (np.kron(wave, one) + np.kron(one, wave))
    area = a * b / 4
    return 4 * H / 2 * area * load @ np.linalg.solve(k, load)


@pytest.mark.parametrize(
    ("in_plane", "exact"),
    [
        ("normal", movement_held_across),
        ("tangential", movement_held_along),
        ("free", movement_free),
    ],
)
def test_supported_rectangle_of_movable_edges_meets_airys_function(in_plane, exact):
    edge = Edge(w="simply_supported", in_plane=in_plane)
    check(nanorom.reduce(scene(Rectangle(*SIDES), edge)), 0, exact(), RITZ)


def test_step_and_tangent_move_edges_as_direct_condensation_does():
    edges = {
        "left": Edge(w="clamped", in_plane="free"),
        "top": Edge(w="simply_supported", in_plane={"normal": 2e-3, "tangential": 1e-2}),
        "default": "clamped",
    }
    one, two, three = (
        nanorom.reduce(
            scene(
                Rectangle(*SIDES),
                edges,
                count=3,
                reduction=Reduction(method=method),
                accuracy=Accuracy(degree=6, mesh_size=0.4),
            )
        ).cubic
        for method in ("direct", "step", "tangent")
    )
    assert np.abs(two - one).max() < ROUNDING * np.abs(one).max()
    assert np.abs(three - one).max() < ROUNDING * np.abs(one).max()


# -- disc ------------------------------------------------------------------------------------------


def plate_mode(p, free=False):
    """w(r), w'(r) of the lowest mode of p nodal diameters, max |w| = 1, and lambda^2."""

    def rows(k):
        """Edge conditions (2, 2) of J_p(k r), I_p(k r)."""
        found = []
        for f, fp, sign in ((jv, jvp, -1), (iv, ivp, 1)):
            w, d1 = f(p, k), k * fp(p, k)
            if not free:
                found.append((w, d1))
                continue
            laplacian = sign * k**2 * w  # of J_p and I_p
            moment = laplacian - (1 - NU) * (d1 - p**2 * w)
            found.append((moment, sign * k**2 * d1 - (1 - NU) * p**2 * (d1 - w)))
        return np.array(found).T

    grid = np.linspace(2.0, 12.0, 2001)
    values = [np.linalg.det(rows(k) / iv(p, k)) for k in grid]
    first = next(i for i in range(2000) if values[i] * values[i + 1] < 0)
    k = brentq(
        lambda k: np.linalg.det(rows(k) / iv(p, k)), grid[first], grid[first + 1], xtol=1e-14
    )
    (a, b), _ = rows(k)
    c = np.array([b, -a])
    r = np.linspace(0, 1, 20001)
    size = np.abs(c[0] * jv(p, k * r) + c[1] * iv(p, k * r)).max()
    c /= size

    def w(r):
        return c[0] * jv(p, k * r) + c[1] * iv(p, k * r)

    def slope(r):
        return k * (c[0] * jvp(p, k * r) + c[1] * ivp(p, k * r))

    return w, slope, k**2


def ritz_of_disc(p, in_plane, spring=0.0, free=False, n=14):
    """B of the mode w(r) cos(p theta), displacements of harmonics 0 and 2p as polynomials."""
    w, slope, _ = plate_mode(p, free)
    r, weight = legendre.leggauss(80)
    r, weight = (r + 1) / 2, weight / 2
    wr, wt = slope(r), p * w(r) / r
    total = 0.0

    def inner(a, b):
        form = a[0] @ (weight * r * b[0]).T + a[1] @ (weight * r * b[1]).T
        form += NU * (a[0] @ (weight * r * b[1]).T + a[1] @ (weight * r * b[0]).T)
        return H / (1 - NU**2) * (form + 2 * (1 - NU) * a[2] @ (weight * r * b[2]).T)

    for q in (0, 2 * p) if p else (0,):
        # slopes squared, their parts of harmonic q: cos^2 = (1 + cos 2p)/2, sin^2 = (1 - cos)/2
        half = 1.0 if p == 0 else 0.5
        sign = 1.0 if q == 0 else -1.0
        strain = [0.5 * half * wr**2, 0.5 * half * sign * wt**2, -0.5 * half * wr * wt * (q > 0)]
        around = 2 * np.pi if q == 0 else np.pi
        powers = np.arange(1, 2 * n, 2)
        radial, hoop = [np.array([r**k for k in powers]) for _ in range(2)]
        d_radial = np.array([k * r ** (k - 1.0) for k in powers])
        d_hoop = d_radial.copy()
        bubble, d_bubble = 1 - r**2, -2 * r
        if in_plane in ("fixed", "normal"):
            radial, d_radial = radial * bubble, d_radial * bubble + radial * d_bubble
        if in_plane in ("fixed", "tangential"):
            hoop, d_hoop = hoop * bubble, d_hoop * bubble + hoop * d_bubble
        rr = np.vstack([d_radial, 0 * hoop])
        tt = np.vstack([radial, q * hoop]) / r
        rt = np.vstack([-q * radial / r, d_hoop - hoop / r]) / 2
        if q == 0:
            rr, tt, rt = rr[:n], tt[:n], 0 * rt[:n]
        basis = (rr, tt, rt)
        k = around * inner(basis, basis)
        edge = np.concatenate([np.ones(n), np.zeros(len(rr) - n)])
        k += spring * around * np.outer(edge, edge)
        load = around * inner(basis, strain)
        total += around * inner(strain, strain) - load @ np.linalg.lstsq(k, load, rcond=1e-15)[0]
    return 2 * total  # V4 = B/4 q^4 is half of the product


@pytest.mark.parametrize("in_plane", ["fixed", "normal", "tangential", "free"])
def test_clamped_disc_meets_ritz_whatever_its_edge_does_in_the_plane(in_plane):
    model = nanorom.reduce(scene(Disc(1), Edge(w="clamped", in_plane=in_plane), count=2))
    check(model, 0, ritz_of_disc(0, in_plane))
    check(model, 1, ritz_of_disc(1, in_plane))


@pytest.mark.parametrize("stiffness", [1e-4, 1e-2, 10.0])
def test_edge_springs_in_the_plane_lead_from_free_to_fixed(stiffness):
    edge = Edge(w="clamped", in_plane=PlaneSpring(normal=stiffness))
    model = nanorom.reduce(scene(Disc(1), edge))
    check(model, 0, ritz_of_disc(0, "free", spring=stiffness))


def test_tension_relaxes_as_far_as_the_edge_gives_way():
    tension, stiffness = 4e-6, 0.02
    left = tension * stiffness / (stiffness + H / (1 - NU))  # u = -c r, N + k c = 0 at the edge
    for in_plane, acting in (
        (PlaneSpring(normal=stiffness), left),
        ("tangential", 0.0),
        ("normal", tension),
    ):
        edge = Edge(w="clamped", in_plane=in_plane)
        loose = nanorom.reduce(scene(Disc(1), edge, 2, (tension, tension, 0.0)))
        held = nanorom.reduce(scene(Disc(1), edge, 2, (0.0, 0.0, 0.0)))
        known = nanorom.reduce(scene(Disc(1), "clamped", 2, (acting, acting, 0.0)))
        assert np.abs(loose.frequency / known.frequency - 1).max() < TOLERANCE
        if acting == 0.0:
            check(loose, 0, held.cubic[0, 0, 0, 0])


def test_free_disc_has_the_exact_frequencies_without_its_rigid_motions():
    model = nanorom.reduce(scene(Disc(1), "free", count=5))
    assert model.label == ("f20c", "f20s", "f01", "f30c", "f30s")
    exact = [plate_mode(p, free=True)[2] for p in (2, 2, 0, 3, 3)]
    found = 2 * np.pi * model.frequency * np.sqrt(H / D)
    assert np.abs(found / exact - 1).max() < 1e-9
    check(model, 2, ritz_of_disc(0, "free", free=True))


def test_free_square_has_the_frequencies_of_ritz_below_the_published_bounds():
    model = nanorom.reduce(scene(Rectangle(1, 1), "free", count=5))
    found = (2 * np.pi * model.frequency) ** 2 * H / D
    s, weight = legendre.leggauss(40)
    basis = [np.eye(k + 1)[k] for k in range(18)]
    f0, f1, f2 = (
        np.array([legendre.legval(s, legendre.legder(c, d)) for c in basis]) for d in range(3)
    )

    def gram(f, g):
        return f @ (weight * g).T

    def pair(f, g, p, q):
        return np.kron(gram(f, g), gram(p, q))

    mixed = pair(f2, f0, f0, f2)
    k = pair(f2, f2, f0, f0) + pair(f0, f0, f2, f2) + NU * (mixed + mixed.T)
    k += 2 * (1 - NU) * pair(f1, f1, f1, f1)
    squares = 16 * eigh(k, pair(f0, f0, f0, f0), eigvals_only=True, subset_by_index=(3, 7))
    assert np.abs(found / squares - 1).max() < 1e-7
    bounds = np.array([13.489, 19.789, 24.432, 35.024, 35.024])  # Ritz, 36 beam functions
    assert ((found < bounds**2) & (found > (0.99 * bounds) ** 2)).all()  # Leissa 1973


# -- sheared tension -------------------------------------------------------------------------------


def test_a_disc_does_not_tell_how_its_tension_is_turned():
    x, y, angle = 2e-5, 1e-5, 0.4
    c, s = np.cos(angle), np.sin(angle)
    turned = (c * c * x + s * s * y, s * s * x + c * c * y, c * s * (x - y))
    for model in ("plate", "membrane"):
        one = nanorom.reduce(scene(Disc(1), "clamped", 4, (x, y, 0.0), model))
        two = nanorom.reduce(scene(Disc(1), "clamped", 4, turned, model))
        assert np.abs(two.frequency / one.frequency - 1).max() < TOLERANCE
        for i in range(4):
            check(two, i, one.cubic[i, i, i, i])


def test_sheared_rectangular_membrane_meets_ritz():
    tension = (2e-5, 1e-5, 8e-6)
    model = nanorom.reduce(scene(Rectangle(*SIDES), "clamped", 3, tension, "membrane"))
    n = 36
    s, weight = legendre.leggauss(n + 10)
    values = []
    for k in range(n):
        f = (1 - s**2) * legendre.legval(s, np.eye(k + 1)[k])
        d = -2 * s * legendre.legval(s, np.eye(k + 1)[k])
        d = d + (1 - s**2) * legendre.legval(s, legendre.legder(np.eye(k + 1)[k]))
        values.append((f, d))
    f, d = np.array(values).transpose(1, 0, 2)
    mass, stiff, mixed = f @ (weight * f).T, d @ (weight * d).T, d @ (weight * f).T
    x, y = 2 / SIDES
    k = tension[0] * x * x * np.kron(stiff, mass) + tension[1] * y * y * np.kron(mass, stiff)
    cross = x * y * np.kron(mixed, mixed.T)
    k += tension[2] * (cross + cross.T)
    squares = eigh(k, H * np.kron(mass, mass), subset_by_index=(0, 2))[0]
    found = 2 * np.pi * model.frequency
    assert np.abs(found / np.sqrt(squares) - 1).max() < 1e-7


def test_what_a_film_cannot_be_held_by_is_told():
    for edge, tension, more, told in (
        ("free", (1e-5, 1e-5, 0.0), {}, "a free film bears no tension"),
        ("clamped", (1e-5, 1e-5, 2e-5), {"model": "membrane"}, "greater than 0 in every direction"),
        (Edge(w="clamped", in_plane="free"), (0.0, 0.0, 0.0), {"model": "shell"}, "in_plane"),
        ("clamped", (1e-5, 1e-5, 1e-6), {"model": "shell"}, "tension.xy"),
    ):
        with pytest.raises(nanorom.NanoromError, match=told):
            scene(Disc(1), edge, 1, tension, **more)
