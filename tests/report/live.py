"""What tests of the live page do with it: click a point, read which one is selected."""

import pytest

from nanorom.continuation import Diagram
from tests.report.browser import executable

needs_chromium = pytest.mark.skipif(
    executable() is None, reason="there is no Chromium here (apt-get install chromium)"
)

SINGLE = 2e-7  # relative: numbers that the page holds in binary32


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
