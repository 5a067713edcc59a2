"""What tests of the live page do with it: click a point, read which one is selected."""

import re

import pytest

from nanorom.continuation import Diagram
from tests.report.browser import executable

needs_chromium = pytest.mark.skipif(
    executable() is None, reason="there is no Chromium here (apt-get install chromium)"
)

SINGLE = 2e-7  # relative: numbers that the page holds in binary32
PREFIXES = {"f": 1e-15, "p": 1e-12, "n": 1e-9, "µ": 1e-6, "m": 1e-3, "": 1, "k": 1e3, "M": 1e6}


def click_point(browser, branch, index):
    """Click where the page draws a point of a branch (by its place in the list of all)."""
    browser.evaluate("nanorom.response.chart.zoom(0)")
    place = browser.evaluate(f"""(() => {{
        const {{ chart }} = nanorom.response;
        const branch = nanorom.response.response.branches[{branch}];
        chart.plotted.scrollIntoView({{ block: "center" }});
        const box = chart.plot.over.getBoundingClientRect();
        const x = nanorom.response.x(branch.omega[{index}]);
        const y = nanorom.response.y(branch.amplitude[{index}]);
        return [box.left + chart.plot.valToPos(x, "x"), box.top + chart.plot.valToPos(y, "y")];
    }})()""")
    browser.click(*place)
    return selected(browser)


def selected(browser):
    return browser.evaluate("""(() => {
        const { branch, index, special } = nanorom.selection.place;
        const of = branch ?? special;
        const [number, point] = [branch?.number ?? null, special?.index ?? null];
        return { level: of.level, branch: number, index, special: point };
    })()""")


def point_of(response, found) -> tuple[Diagram, object, int]:
    diagram = response.diagrams[found["level"]]
    if found["special"] is None or found["branch"] is not None:
        branch = diagram.branches[found["branch"]]
        return branch, branch.orbit(found["index"]), found["index"]
    point = diagram.special_points[found["special"]]
    return point, point.orbit, None


def amount(text):
    """A number of the page with its unit, "21.15 MHz", in SI."""
    number, unit = text.replace("−", "-").split()
    return float(number) * PREFIXES[re.sub("(Hz|N/m|m|V|Pa|N)$", "", unit)]


def facts(browser):
    rows = browser.evaluate(
        "[...document.querySelectorAll('.beside .facts tr')].map((row) => "
        "[...row.cells].map((cell) => cell.textContent))"
    )
    return dict(rows)
