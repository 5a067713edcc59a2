"""A browser without a window, told what to do through a pipe (Chrome DevTools Protocol)."""

from __future__ import annotations

import base64
import itertools
import json
import os
import shutil
import subprocess
import time
from pathlib import Path
from typing import Any

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
SWITCHES = (
    "--headless=new",
    "--remote-debugging-pipe",
    "--no-first-run",
    "--disable-gpu",
    "--enable-unsafe-swiftshader",
    "--disable-dev-shm-usage",
    "--disable-extensions",
    "--disable-background-networking",
)
PATIENCE = 120  # seconds in which a page must be ready, on a machine with much else to do
LOCAL = ("file:", "data:", "blob:", "about:")


def executable() -> str | None:
    """Of a browser on this machine, if there is one."""
    return next((path for path in map(shutil.which, NAMES) if path), None)


class Browser:
    """One page of a browser: opens files, clicks, types, evaluates, and notes all that is wrong."""

    def __init__(self, folder: Path) -> None:
        command = [executable(), *SWITCHES, f"--user-data-dir={folder}"]
        command += ["--no-sandbox"] * (os.geteuid() == 0)
        ours, theirs = os.pipe(), os.pipe()
        redirected = f'exec "$@" 3</dev/fd/{ours[0]} 4>/dev/fd/{theirs[1]}'
        self.process = subprocess.Popen(
            ["/bin/sh", "-c", redirected, "sh", *map(str, command)],
            pass_fds=(ours[0], theirs[1]),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(ours[0])
        os.close(theirs[1])
        self.outgoing, self.incoming = open(ours[1], "wb"), open(theirs[0], "rb")
        self.numbers = itertools.count(1)
        self.complaints: list[str] = []
        self.requests: list[str] = []
        self.session: str | None = None
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)[
            "sessionId"
        ]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Do something and wait for its result."""
        number = next(self.numbers)
        message: dict[str, Any] = {"id": number, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        self.outgoing.write(json.dumps(message).encode() + b"\0")
        self.outgoing.flush()
        while True:
            answer = self._read()
            if answer.get("id") == number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']['message']}")
                result: dict[str, Any] = answer["result"]
                return result
            self._note(answer.get("method", ""), answer.get("params", {}))

    def _read(self) -> dict[str, Any]:
        text = bytearray()
        while (byte := self.incoming.read(1)) != b"\0":
            if not byte:
                raise RuntimeError("the browser has ended")
            text += byte
        answer: dict[str, Any] = json.loads(text)
        return answer

    def _note(self, event: str, details: dict[str, Any]) -> None:
        if event == "Runtime.consoleAPICalled":
            self.complaints.append(" ".join(str(a.get("value")) for a in details["args"]))
        elif event == "Runtime.exceptionThrown":
            self.complaints.append(json.dumps(details["exceptionDetails"])[:500])
        elif event == "Log.entryAdded":
            entry = details["entry"]
            if entry["source"] != "rendering":  # what a driver says of its own speed
                self.complaints.append(entry["text"])
        elif event == "Network.requestWillBeSent":
            self.requests.append(details["request"]["url"])

    @property
    def foreign(self) -> list[str]:
        """What was asked for that is not on this machine."""
        return [url for url in self.requests if not url.startswith(LOCAL)]

    def open(self, path: Path, width: int = 1280, dark: bool = False) -> None:
        """Show a page of nanorom and wait until it is ready."""
        self.complaints.clear()
        self.requests.clear()
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
        self.call("Emulation.setDeviceMetricsOverride", **size)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        still = {"name": "prefers-reduced-motion", "value": "reduce"}  # films wait to be played
        self.call("Emulation.setEmulatedMedia", features=[scheme, still])
        self.call("Page.navigate", url=path.resolve().as_uri())
        self.wait_for_page(path.name)

    def wait_for_page(self, name: str) -> None:
        """Until the page of a name is ready."""
        here = f"location.pathname.endsWith({json.dumps('/' + name)})"
        for _ in range(PATIENCE):
            try:
                return self.wait(f"{here} && document.body?.dataset.ready === 'true'")
            except RuntimeError:  # the page before it has gone while it was asked
                time.sleep(1)
        raise RuntimeError("the page does not become ready")

    def wait(self, condition: str) -> None:
        """Until an expression is true."""
        polled = f"""new Promise((done, fail) => {{
            const start = performance.now();
            const look = () => {{
                if ({condition}) done(true);
                else if (performance.now() - start > {1000 * PATIENCE}) fail(new Error("too late"));
                else setTimeout(look, 20);
            }};
            look();
        }})"""
        self.evaluate(polled)

    def evaluate(self, expression: str) -> Any:
        """The value of an expression in the page; a promise is waited for."""
        options = {"awaitPromise": True, "returnByValue": True}
        answer = self.call("Runtime.evaluate", expression=expression, **options)
        if "exceptionDetails" in answer:
            raise RuntimeError(json.dumps(answer["exceptionDetails"])[:500])
        return answer["result"].get("value")

    def click(self, x: float, y: float) -> None:
        """At a place of the window, in pixels."""
        at = {"x": x, "y": y}
        self.call("Input.dispatchMouseEvent", type="mouseMoved", **at)
        for kind in ("mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=kind, button="left", clickCount=1, **at)

    def key(self, name: str) -> None:
        """Press a key, to what has the focus."""
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=name)

    def picture(self) -> bytes:
        """What the window shows, as PNG."""
        return base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])

    def close(self) -> None:
        """End the browser."""
        try:
            self.session = None
            self.call("Browser.close")
        except (RuntimeError, OSError):
            self.process.kill()
        self.outgoing.close()
        self.incoming.close()
        self.process.wait()
