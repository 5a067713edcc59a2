"""Time of a picture of the live page's moving film without a graphics card.

    python -m tests.benchmarks.frames PAGE...      pages of `nanorom run` or `nanorom view`

Chromium draws WebGL by SwiftShader in both rows of a page; it puts the page together by the
processor's own code ("Skia"), or by SwiftShader, too, which is dearer. Time of the processor is
that of all processes of the browser.
"""

import contextlib
import itertools
import os
import sys
import tempfile
import time
from pathlib import Path

from tests.report import browser as browsers

PICTURES = 60
SETTLED = 6.0  # seconds until the gallery has its pictures
ASKED = 1000 / 30
WAYS = {
    "Skia": ("--disable-gpu",),
    "SwiftShader": ("--use-gl=angle", "--use-angle=swiftshader", "--ignore-gpu-blocklist"),
}
PLAY = f"""new Promise((done) => {{
    const {{ film }} = nanorom;
    const context = film.stage.renderer.getContext();
    const start = performance.now();
    const step = (left) => {{
        film.theta += 0.1;
        film.draw();
        if (left) return requestAnimationFrame(() => step(left - 1));
        context.readPixels(0, 0, 1, 1, context.RGBA, context.UNSIGNED_BYTE, new Uint8Array(4));
        return done((performance.now() - start) / {PICTURES});
    }};
    requestAnimationFrame(() => step({PICTURES}));
}})"""


def processor(root: int) -> float:
    """Seconds of a process and of those that it started and theirs."""
    parent, seconds = {}, {}
    for entry in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):  # it has ended
            fields = entry.read_text().rpartition(")")[2].split()
            parent[int(entry.parent.name)] = int(fields[1])
            seconds[int(entry.parent.name)] = sum(map(int, fields[11:13]))
    family = {root}
    while more := {one for one, of in parent.items() if of in family} - family:
        family |= more
    return sum(seconds.get(one, 0) for one in family) / os.sysconf("SC_CLK_TCK")


def measure(page: Path, way: str) -> tuple[float, float]:
    """Milliseconds per picture: as they follow one another, and of the processor."""
    usual = tuple(s for s in browsers.SWITCHES if s != "--disable-gpu")
    browsers.SWITCHES = usual + WAYS[way]
    with tempfile.TemporaryDirectory() as folder:
        browser = browsers.Browser(Path(folder))
        try:
            browser.open(page)
            browser.evaluate("nanorom.film.canvas.scrollIntoView({ block: 'center' })")
            time.sleep(SETTLED)
            before = processor(browser.process.pid)
            apart = float(browser.evaluate(PLAY))
            used = processor(browser.process.pid) - before
        finally:
            browser.close()
    return apart, 1000 * used / PICTURES


def main() -> None:
    load = os.getloadavg()[0]
    print(f"Load of the machine {load:.1f}, {os.cpu_count()} cores; {ASKED:.0f} ms are asked.\n")
    print("| page | page by | ms between pictures | ms of the processor |\n|---|---|---|---|")
    for name, way in itertools.product(sys.argv[1:], WAYS):
        apart, used = measure(Path(name), way)
        print(f"| {Path(name).name} | {way} | {apart:.1f} | {used:.1f} |", flush=True)


if __name__ == "__main__":
    main()
