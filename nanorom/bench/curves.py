"""Run time against error over degree x mesh x route, beside bare DOLFINx and NGSolve."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from nanorom.bench import measure, ngsolve_drum
from nanorom.bench.measure import Row
from nanorom.exact import cases, polar
from nanorom.exact.cases import Case
from nanorom.scene.geometry import Disc

TOLERANCES = tuple(10.0**-n for n in range(3, 10))
ROUTES = ("direct", "tangent", "step")
# degree -> cells per radius, or per side of a square
MESHES = {2: (6, 12, 24), 4: (3, 6, 12), 6: (2, 4, 6), 8: (1.5, 2.5, 4)}
BASELINES = {2: ((5, 10, 20, 40), (1, 2)), 3: ((3, 6, 12, 24), (1, 3))}  # cells, orders of the map
NGSOLVE = {4: (3, 6, 12), 6: (2.5, 4, 6), 8: (1.8, 2.5, 3.5, 4.3, 5.2)}
KAPPA = 100.0


def rows(quick: bool = False) -> Iterator[Row]:
    """Every line of the table; quick: a few of each kind, to see that all of it works."""
    if quick:
        few = cases.drum(KAPPA, count=3)
        yield from reductions(few, (1e-3, 1e-6), {4: (3,)}, ("direct", "step"))
        yield from bare_dolfinx(few, {2: ((4,), (1,)), 3: ((3,), (3,))})
        yield from ngsolve(few, {4: (3,)})
        return
    drum = cases.drum(KAPPA)
    yield from reductions(drum, TOLERANCES, MESHES, ROUTES)
    yield from ngsolve(drum, NGSOLVE)
    yield from bare_dolfinx(drum, BASELINES)
    yield from reductions(cases.paper_drum(), TOLERANCES, {}, ROUTES)
    yield from reductions(cases.square(), TOLERANCES, {4: MESHES[4], 8: MESHES[8]}, ROUTES)
    yield from reductions(cases.string(), (1e-3, 1e-4, 1e-5, 1e-6), {}, ROUTES)
    yield from reductions(cases.string(model="beam"), (1e-3, 1e-6, 1e-9), {}, ("direct",))


def reductions(
    case: Case,
    tolerances: tuple[float, ...],
    meshes: Mapping[int, tuple[float, ...]],
    routes: tuple[str, ...],
) -> Iterator[Row]:
    """nanorom: meshes of its own choice for tolerances, then given degrees and meshes."""
    geometry = case.scene.geometry
    length = geometry.radius if isinstance(geometry, Disc) else geometry.length  # type: ignore[union-attr]
    for route in routes:
        scene = case.scene.with_(method=route)
        for tolerance in tolerances:
            chosen = cases.with_tolerance(cases.with_scene(case, scene), tolerance)
            yield measure.reduction(chosen, f"tolerance {tolerance:.0e}")
        for degree, sizes in meshes.items() if route == "direct" else ():
            for cells in sizes:
                by_hand = cases.by_hand(cases.with_scene(case, scene), degree, cells, length)
                yield measure.reduction(by_hand, f"h = 1/{cells:g}")


def bare_dolfinx(
    case: Case, meshes: Mapping[int, tuple[tuple[int, ...], tuple[int, ...]]]
) -> Iterator[Row]:
    """P2 and P3 on straight and curved cells."""
    from nanorom.bench import dolfinx_drum

    count = case.scene.modes.highest
    diameters = polar.nodal_diameters(KAPPA, count)
    for degree, (sizes, orders) in meshes.items():
        for order in orders:
            for cells in sizes:

                def solve(
                    degree: int = degree, cells: int = cells, order: int = order
                ) -> tuple[int, np.ndarray, np.ndarray]:
                    return _in_si(
                        *dolfinx_drum.solve(
                            KAPPA, cases.NU, diameters, count, degree, 1 / cells, order
                        )
                    )

                shape = "straight" if order == 1 else "curved"
                yield measure.baseline(case, "DOLFINx", shape, degree, solve)


def ngsolve(case: Case, meshes: Mapping[int, tuple[float, ...]]) -> Iterator[Row]:
    """C0 interior penalty on curved cells, where NGSolve is installed."""
    if not ngsolve_drum.available():
        return
    count = case.scene.modes.highest
    diameters = polar.nodal_diameters(KAPPA, count)
    for degree, sizes in meshes.items():
        for cells in sizes:

            def solve(
                degree: int = degree, cells: float = cells
            ) -> tuple[int, np.ndarray, np.ndarray]:
                return _in_si(
                    *ngsolve_drum.solve(KAPPA, cases.NU, diameters, count, degree, 1 / cells)
                )

            yield measure.baseline(case, "NGSolve", "direct", degree, solve)


def _in_si(dofs: int, omega: np.ndarray, cubic: np.ndarray) -> tuple[int, np.ndarray, np.ndarray]:
    film = cases.Film()
    mass = cases.DENSITY * film.thickness
    scale = np.sqrt(film.tension_unit / mass) / film.radius / (2 * np.pi)
    return dofs, scale * omega, film.modulus * film.thickness / film.radius**2 * cubic
