"""The film of the live page in a browser: it moves as the model does, in fewer triangles."""

import numpy as np
import pytest
from scipy.spatial import Delaunay

from nanorom.rom import motion
from tests.report import live
from tests.report.live import SINGLE, click_point, point_of

pytestmark = live.needs_chromium

PIXEL = 1.0  # of the screen; charts are 300 wide, films of this size move by 60


def test_moving_film_is_the_sum_of_the_shapes(opened, model, response):
    of, orbit, _ = point_of(response, click_point(opened, 1, 10))
    for theta in np.linspace(0, 2 * np.pi, 7):
        moved = opened.evaluate(f"""(() => {{
            const {{ film }} = nanorom;
            film.theta = {theta};
            film.draw();
            const {{ places, base }} = film.stage;
            const high = Array.from(film.values, (_, i) => places[3 * i + 2] - base[3 * i + 2]);
            return [[...film.values], high, film.magnified, film.largest];
        }})()""")
        values, heights, magnified, largest = map(np.array, moved)
        time = theta / (2 * np.pi) * orbit.period
        expected = motion.deflection(model, orbit, time)
        assert np.abs(values - expected).max() < 5 * SINGLE * largest
        assert np.abs(heights - magnified * expected).max() < 1e-5 * magnified * largest
    instants = np.arange(motion.INSTANTS) * orbit.period / motion.INSTANTS
    most = np.abs(motion.deflection(model, orbit, instants)).max()
    assert largest == pytest.approx(most, rel=1e-6)


def test_film_that_stands_still_shows_its_largest_deflection(opened, model, response):
    """Where the reader's system asks for no motion, as it does here."""
    click_point(opened, 1, 20)
    shown, largest = opened.evaluate(
        "[Math.max(...nanorom.film.values.map(Math.abs)), nanorom.film.largest]"
    )
    assert shown == pytest.approx(largest, rel=1e-6)


def test_rim_moves_with_the_film_where_its_edge_is_free(opened, response):
    click_point(opened, 1, 10)
    rim, film, moved = opened.evaluate("""(() => {
        const { film } = nanorom;
        const { stage } = film, { geometry } = stage.rim;
        film.theta = 1;
        film.draw();
        const pairs = Array.from(geometry.index.array);
        const rim = pairs.map((i) => geometry.attributes.position.getZ(i));
        const own = film.stage.film.edges.map((i) => stage.places[3 * i + 2]);
        return [rim, own, own.map((z, k) => z - stage.base[3 * pairs[k] + 2])];
    })()""")
    assert rim == film
    assert np.ptp(moved) > 0  # the edge of this made-up film moves


def test_only_the_film_is_drawn_anew_while_it_moves(opened, response):
    click_point(opened, 1, 10)
    drawn = opened.evaluate("""new Promise((done) => {
        const { film, motion, response } = nanorom;
        let [charts, pictures, calm] = [0, 0, 0];
        const places = [];
        for (const { plot } of [motion.time.chart, motion.spectrum.chart, response.chart])
            plot.hooks.draw.push(() => { charts += 1; });
        const step = (left) => {
            film.theta = left / 2;
            film.draw();
            const mark = motion.time.chart.line.getBoundingClientRect().left;
            const over = motion.time.chart.plot.over.getBoundingClientRect();
            places.push([left / 2 / (2 * Math.PI), (mark - over.left) / over.width]);
            if (left) requestAnimationFrame(() => step(left - 1));
            else done([charts, film.pictures - pictures, places]);
        };
        const settle = () => {  // what the click has changed may be drawn some frames later
            calm = charts ? 0 : calm + 1;
            [charts, pictures] = [0, film.pictures];
            requestAnimationFrame(calm < 10 ? settle : () => step(10));
        };
        settle();
    })""")
    charts, pictures, places = drawn
    assert (charts, pictures) == (0, 11)
    phase, place = np.array(places).T
    assert np.abs(phase - place).max() < PIXEL / 300


def flat(points, cells):
    """Twice the areas of triangles, turned as they are."""
    a, b, c = (points[cells[:, k]] for k in range(3))
    (x, y), (u, v) = (b - a).T, (c - a).T
    return x * v - y * u


def wave(points):
    x, y = points.T
    return np.sin(np.pi * x) * np.cos(2 * np.pi * y)


def rim(cells):
    """Edges that one triangle has alone."""
    edges = np.sort(cells[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    edges, count = np.unique(edges, axis=0, return_counts=True)
    return edges[count == 1]


@pytest.mark.parametrize("seed", range(4))
def test_fewer_triangles_cover_the_same_film(opened, seed):
    """Random points in a square with a round hole: outline, area and turn stay, heights nearly."""
    rng = np.random.default_rng(seed)
    angle = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    side = np.linspace(-0.5, 0.5, 30)
    across = np.column_stack([side, np.full(30, 0.5)])
    square = np.vstack([across, -across, across[:, ::-1], -across[:, ::-1]])
    hole = 0.2 * np.column_stack([np.cos(angle), np.sin(angle)])
    within = rng.uniform(-0.49, 0.49, size=(6000, 2))
    within = within[np.hypot(*within.T) > 0.21]
    points = np.unique(np.vstack([square, hole, within]).round(9), axis=0)
    cells = Delaunay(points).simplices
    cells = cells[np.hypot(*points[cells].mean(axis=1).T) > 0.2 * np.cos(np.pi / 60) ** 2]
    cells = np.where((flat(points, cells) < 0)[:, None], cells[:, ::-1], cells)
    cells = cells[flat(points, cells) > 1e-12]
    fixed = np.zeros(len(points), dtype=int)
    fixed[rim(cells)] = 1
    places = np.column_stack([points, 0 * points[:, 0]])
    given = (
        f"new Float32Array({places.ravel().tolist()}), new Uint32Array({cells.ravel().tolist()})"
    )
    found = opened.evaluate(
        f"import('thinned').then((part) => [...part.thinned({given}, {fixed.tolist()}, 1 / 48)])"
    )
    fewer = np.array(found).reshape(-1, 3)
    assert len(fewer) < len(cells) / 2
    area = flat(points, fewer)
    assert area.min() > 0
    assert area.sum() == pytest.approx(flat(points, cells).sum(), rel=1e-12)
    assert np.array_equal(rim(fewer), rim(cells))
    middle = points[fewer].mean(axis=1)
    assert np.abs(wave(points)[fewer].mean(axis=1) - wave(middle)).max() < PIXEL / 60


def test_each_mode_of_the_gallery_moves_in_its_shape(opened, model):
    for mode in range(model.size):
        tiles = "document.querySelectorAll('.tile')"
        opened.evaluate(f"{tiles}[{mode}].click()")
        values = opened.evaluate(
            "(nanorom.film.theta = 1, nanorom.film.draw(), [...nanorom.film.values])"
        )
        assert np.allclose(values, np.cos(1) * model.shapes.values[mode], rtol=0, atol=1e-6)
        name = opened.evaluate(f"{tiles}[{mode}].textContent")
        assert name.startswith(model.label[mode])
    opened.evaluate("nanorom.selection.set(nanorom.selection.place)")
