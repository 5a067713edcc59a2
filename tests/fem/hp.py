"""Rectangles by hp elements that are products of one-dimensional ones: an independent solution.

Deflections are products of Hermite's cubics and bubbles, continuous with their slopes, in-plane
displacements of hats and bubbles; element lines shrink geometrically towards sides and region
lines, where corners are singular.  Supports of any kind, springs, pre-stress that relaxes,
thickness by region; strong conditions, no penalty, Gauss rules exact.  E = rho = 1.
"""

import attrs
import numpy as np
from scipy.linalg import eigh
from scipy.ndimage import maximum_filter
from scipy.optimize import minimize
from scipy.sparse import bmat, csc_matrix, diags, kron
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh, splu

from tests.fem.hp_lines import Axis, lines

SIDES = ("left", "right", "bottom", "top")
GRID, HIGH, MOST_TOPS = 81, 0.97, 12  # points of a side; share of the highest; tops looked at
NOTHING = 1e-13  # by a stiffness
ROUNDED = 1e-9  # part of a tension's stiffness that is none
SMOOTH = 3  # layers of the deflection: rounding bounds them, and its corners are less singular
KEPT = {"c": (False, False), "s": (False, True), "f": (True, True)}  # value and slope at an end


@attrs.frozen
class Film:
    """A rectangle (0, a) x (0, b) and what holds it.

    deflection: by side c, s, f or (spring, rotational), None for a held value; in_plane: by side
    "fixed", "normal", "tangential", "free" or (normal, tangential) stiffnesses; tension: x, y, xy
    before it relaxes; patch: (x0, x1, y0, y1, factor of thickness).
    """

    a: float
    b: float
    thickness: float
    nu: float
    deflection: dict
    in_plane: dict
    tension: tuple = (0.0, 0.0, 0.0)
    patch: tuple | None = None


def kept_in_plane(kind, side):
    """Whether u and v move at a side."""
    if not isinstance(kind, str):
        return True, True
    across = kind not in ("fixed", "normal")
    along = kind not in ("fixed", "tangential")
    return (across, along) if side in ("left", "right") else (along, across)


@attrs.frozen
class Found:
    """omega (n,), mass (n,), tensor (n, n, n, n) of modes with largest value 1."""

    omega: np.ndarray
    mass: np.ndarray
    cubic: np.ndarray


@attrs.frozen(eq=False)
class Stiffness:
    """Of the deflection: its matrix, and what it does by fields, to more digits.

    fields: wxx, wyy, wxy, wx, wy; bending, tension: their weights; edge: of springs.
    """

    fields: list
    bending: np.ndarray
    tension: np.ndarray
    nu: float
    edge: object

    @classmethod
    def of(cls, solver, tension):
        film = solver.film
        fields = solver.fields(solver.w, solver.x, solver.y, (2, 0), (0, 2), (1, 1), (1, 0), (0, 1))
        bending = solver.weight * solver.h**3 / 12 / (1 - film.nu**2)

        def springs(side):
            kind = film.deflection[side]
            return [] if isinstance(kind, str) else list(enumerate(kind))

        return cls(
            fields, bending, tension * solver.weight, film.nu, solver.edges(solver.w, springs)
        )

    @property
    def matrix(self):
        xx, yy, xy, x, y = self.fields
        d, (nx, ny, nxy) = diags(self.bending), map(diags, self.tension)
        mixed, shear = xx.T @ d @ yy, x.T @ nxy @ y
        bent = xx.T @ d @ xx + yy.T @ d @ yy + self.nu * (mixed + mixed.T)
        bent = bent + 2 * (1 - self.nu) * (xy.T @ d @ xy)
        return (bent + x.T @ nx @ x + y.T @ ny @ y + shear + shear.T + self.edge).tocsc()

    def laws(self, fields):
        """Moments and tensions (q, n) of curvatures and slopes, by weight."""
        d, nx, ny, nxy = (part[:, None] for part in (self.bending, *self.tension))
        xx, yy, xy, x, y = fields
        moments = d * (xx + self.nu * yy), d * (yy + self.nu * xx), d * 2 * (1 - self.nu) * xy
        return *moments, nx * x + nxy * y, ny * y + nxy * x

    def force(self, v):
        laws = self.laws([part @ v for part in self.fields])
        return sum(part.T @ each for part, each in zip(self.fields, laws)) + self.edge @ v

    def energy(self, v):
        fields = [part @ v for part in self.fields]
        return sum(a.T @ b for a, b in zip(fields, self.laws(fields))) + v.T @ (self.edge @ v)


def lowest(stiffness, mass, count, more=3, rounds=4, mended=2):
    """Squared frequencies (count,) and vectors of the lowest modes.

    Inverse iteration whose solutions are mended by residuals of fields: entries of the matrix,
    which are their squares, have too few digits where elements are small.
    """
    matrix = stiffness.matrix
    scale = diags(1 / np.sqrt(np.abs(matrix.diagonal())))
    scaled = (scale @ matrix @ scale).tocsc()
    factor = splu(scaled)
    inverse = LinearOperator(matrix.shape, matvec=factor.solve)
    small = (scale @ mass @ scale).tocsc()
    _, found = eigsh(scaled, count + more, small, sigma=0.0, tol=1e-10, OPinv=inverse)
    found = scale @ found
    for _ in range(rounds):
        load = mass @ found
        moved = scale @ factor.solve(scale @ load)
        for _ in range(mended):
            moved += scale @ factor.solve(scale @ (load - stiffness.force(moved)))
        values, turn = eigh(stiffness.energy(moved), moved.T @ (mass @ moved))
        found = moved @ turn
    return values[:count], found[:, :count]


class Solver:
    """Matrices of a film of some degree and layers of elements towards its sides."""

    def __init__(self, film, p=8, layers=3):
        self.film, self.p = film, p
        steps = ((), ()) if film.patch is None else (film.patch[:2], film.patch[2:4])
        inside = [
            tuple(s for s in step if 0 < s < side) for step, side in zip(steps, (film.a, film.b))
        ]
        both = list(zip((film.a, film.b), inside))
        self.grids = [lines(side, s, layers) for side, s in both]
        coarser = [lines(side, s, min(layers, SMOOTH)) for side, s in both]
        ends = [self._end(side) for side in SIDES]
        self.w = [
            Axis(grid, p, True, ends[2 * i], ends[2 * i + 1]) for i, grid in enumerate(coarser)
        ]
        self.plane = []
        for component in (0, 1):
            moves = [kept_in_plane(film.in_plane[side], side)[component] for side in SIDES]
            self.plane.append(
                [
                    Axis(grid, p, False, [moves[2 * i]], [moves[2 * i + 1]])
                    for i, grid in enumerate(self.grids)
                ]
            )
        rules = [axis.rule(p + 2) for axis in self.plane[0]]
        (self.x, wx), (self.y, wy) = rules
        self.weight = np.outer(wx, wy).ravel()
        self.ratio = np.ones_like(self.weight)
        if film.patch is not None:
            x0, x1, y0, y1, factor = film.patch
            inside = np.outer((self.x > x0) & (self.x < x1), (self.y > y0) & (self.y < y1))
            self.ratio[inside.ravel()] = factor
        self.h = film.thickness * self.ratio
        c = self.h / (1 - film.nu**2)
        self.law = np.array([c, film.nu * c, (1 - film.nu) / 2 * c])

    def _end(self, side):
        kind = self.film.deflection[side]
        return KEPT[kind] if isinstance(kind, str) else (kind[0] is not None, True)

    @staticmethod
    def fields(axes, x, y, *orders):
        fx, fy = axes[0].at(x), axes[1].at(y)
        return [kron(fx[i], fy[j], format="csr") for i, j in orders]

    def stress(self, strain):
        """Of strains (3, q): xx, yy, 2 xy."""
        c, n, g = self.law
        return np.array(
            [c * strain[0] + n * strain[1], n * strain[0] + c * strain[1], g * strain[2]]
        )

    def edges(self, axes, value):
        """Matrix of sum over sides of int value(side) f f, value None where nothing acts."""
        size = axes[0].size * axes[1].size
        total = csc_matrix((size, size))
        ends = {
            "left": (0, 0.0),
            "right": (0, self.film.a),
            "bottom": (1, 0.0),
            "top": (1, self.film.b),
        }
        for side, (axis, at) in ends.items():
            for order, stiffness in value(side):
                if not stiffness:
                    continue
                end = axes[axis].at(np.array([at]))[order]
                line, weight = axes[1 - axis].rule(self.p + 2)
                along = axes[1 - axis].at(line)[0]
                one, other = end.T @ end, along.T @ diags(weight) @ along
                total = total + stiffness * (kron(one, other) if axis == 0 else kron(other, one))
        return total

    def in_plane(self):
        """Displacement gradients and the factored stiffness of the plane."""
        (ux, uy), (vx, vy) = (
            self.fields(axes, self.x, self.y, (1, 0), (0, 1)) for axes in self.plane
        )
        zero = csc_matrix
        rows = [
            [ux, zero((ux.shape[0], vx.shape[1]))],
            [zero((ux.shape[0], ux.shape[1])), vy],
            [uy, vx],
        ]
        strain = bmat(rows, format="csr")
        c, n, g = (diags(self.weight * part) for part in self.law)
        law = bmat([[c, n, None], [n, c, None], [None, None, g]], format="csr")
        matrix = (strain.T @ law @ strain).tocsc()

        def spring(component):
            def value(side):
                kind = self.film.in_plane[side]
                if isinstance(kind, str):
                    return []
                across = (side in ("left", "right")) == (component == 0)
                return [(0, kind[0] if across else kind[1])]

            return value

        springs = [self.edges(axes, spring(i)) for i, axes in enumerate(self.plane)]
        springs = bmat([[springs[0], None], [None, springs[1]]], format="csc")
        matrix = matrix + springs
        # rigid motions that nothing resists are held by next to nothing: no force moves them
        factor = splu((matrix + NOTHING * diags(matrix.diagonal())).tocsc())

        def solve(load):
            moved = factor.solve(load)
            for _ in range(2):
                field = law @ (strain @ moved)
                moved = moved + factor.solve(load - strain.T @ field - springs @ moved)
            return moved

        return strain, solve

    def prestress(self, plane):
        """Tension (3, q): xx, yy, xy after it relaxed."""
        strain, solve = plane
        x, y, xy = (t * self.ratio for t in self.film.tension)
        force = strain.T @ np.concatenate([x * self.weight, y * self.weight, xy * self.weight])
        if not np.any(force):
            return np.array([x, y, xy])
        moved = (strain @ solve(-force)).reshape(3, -1)
        return np.array([x, y, xy]) + self.stress(moved)

    def solve(self, count):
        """The lowest modes; the film has to be stable."""
        plane = self.in_plane()
        stiffness = Stiffness.of(self, self.prestress(plane))
        w = self.fields(self.w, self.x, self.y, (0, 0))[0]
        mass = (w.T @ diags(self.weight * self.h) @ w).tocsc()
        values, vectors = lowest(stiffness, mass, count)
        vectors = vectors / np.array([self.peak(v) for v in vectors.T])
        modal = np.einsum("in,in->n", vectors, mass @ vectors)
        slopes = (part @ vectors for part in stiffness.fields[3:])
        return Found(np.sqrt(values), modal, self.tensor(plane, *slopes))

    def buckling(self):
        """Multiple of the tension at which the film buckles, inf if none is found."""
        acting = Stiffness.of(self, self.prestress(self.in_plane()))
        bent = attrs.evolve(acting, tension=0 * acting.tension).matrix
        pulled = acting.matrix - bent
        scale = diags(1 / np.sqrt(bent.diagonal()))
        own, other = ((scale @ each @ scale).tocsc() for each in (bent, -pulled))
        try:
            found = eigsh(
                other, 1, own, which="LA", ncv=60, maxiter=12, return_eigenvectors=False
            ).item()
        except ArpackNoConvergence:
            return np.inf
        return 1 / found if found > ROUNDED else np.inf

    def peak(self, vector):
        """Largest value, looked for from the highest points of a grid."""
        shape = vector.reshape(self.w[0].size, self.w[1].size)
        sides = self.film.a, self.film.b
        x, y = (np.union1d(np.linspace(0, side, GRID), w.lines) for side, w in zip(sides, self.w))
        values = np.abs(self.w[0].at(x)[0] @ shape @ self.w[1].at(y)[0].T)
        near = maximum_filter(values, 3, mode="nearest")
        tops = np.argwhere((values == near) & (values > HIGH * values.max()))[:MOST_TOPS]

        def below(place):
            one, other = (w.at(np.array([at]))[0] for w, at in zip(self.w, place))
            return -abs((one @ shape @ other.T).item())

        found = []
        for top in tops:
            place = [line[i] for line, i in zip((x, y), top)]
            box = [
                (line[max(i - 1, 0)], line[min(i + 1, len(line) - 1)])
                for line, i in zip((x, y), top)
            ]
            options = {"xtol": 1e-10, "ftol": 1e-16}
            found.append(-minimize(below, place, bounds=box, method="Powell", options=options).fun)
        return max(found)

    def tensor(self, plane, wx, wy):
        """B (n, n, n, n) of shapes by their slopes (q, n)."""
        strain, solve = plane
        n = wx.shape[1]
        pairs = [(i, j) for i in range(n) for j in range(i, n)]
        number = np.empty((n, n), dtype=int)
        for k, (i, j) in enumerate(pairs):
            number[i, j] = number[j, i] = k
        x, y = wx.T, wy.T
        own = [
            np.array([x[i] * x[j], y[i] * y[j], x[i] * y[j] + x[j] * y[i]]) / 2 for i, j in pairs
        ]
        stress = [self.stress(each) for each in own]
        force = np.array([strain.T @ (each * self.weight).ravel() for each in stress]).T
        energy = np.array([[np.sum(s * e * self.weight) for e in own] for s in stress])
        energy -= force.T @ solve(force)
        full = energy[number[:, :, None, None], number]
        return 2 / 3 * (full + full.transpose(0, 2, 1, 3) + full.transpose(0, 3, 2, 1))
