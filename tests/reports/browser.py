"""A headless Chromium for tests, driven over the DevTools protocol through two pipes: nothing to install
beside the browser.

`Page` opens a file, runs JavaScript in it, presses the mouse, and keeps where it is, what the console said
and what was asked of the network.
"""

from __future__ import annotations

import base64
import contextlib
import json
import os
import select
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

_NAMES = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
)
_CHOSEN = "IDENTIFY_BROWSER"
_FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--use-angle=swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
    "--hide-scrollbars",
    "--remote-debugging-pipe",
)
_PATIENCE_S = 60.0
_CLICKS = 10


def chromium() -> str:
    """The browser's path, from IDENTIFY_BROWSER or under its usual names; skips the calling test where there
    is none.
    """
    names = [os.environ[_CHOSEN]] if _CHOSEN in os.environ else list(_NAMES)
    found = next(filter(None, map(shutil.which, names)), None)
    if found is None:
        pytest.skip(
            f"no browser is here (one of {', '.join(names)}; `make browser` installs one on Debian): the page"
            " is not opened"
        )
    return found


class Page:
    """One tab; `console` holds errors and warnings of the page, `requests` the addresses it asked for."""

    def __init__(self, write: int, read: int) -> None:
        self._write, self._read, self._buffer, self._count, self._session = write, read, b"", 0, ""
        self.console: list[str] = []
        self.requests: list[str] = []
        self.at: Path | None = None
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        """Call a method of the DevTools protocol and return its result."""
        self._count += 1
        message: dict[str, Any] = {"id": self._count, "method": method, "params": params}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._write, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._message()
            if answer.get("id") == self._count:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return dict(answer["result"])
            self._note(answer)

    def open(self, path: Path, width: int = 1280, height: int = 900, dark: bool = False) -> None:
        """Open a file from disk and wait until the page says that everything is drawn."""
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=False,
        )
        self.theme(dark)
        self.at = path
        self.call("Page.navigate", url=path.resolve().as_uri())
        self.wait("document.documentElement?.dataset.ready !== undefined")

    def theme(self, dark: bool) -> None:
        """What the system prefers."""
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", features=[scheme])

    def run(self, script: str) -> Any:
        """The value of a JavaScript expression; promises are awaited."""
        answer = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in answer:
            raise RuntimeError(f"{script}: {answer['exceptionDetails']}")
        return answer["result"].get("value")

    def wait(self, condition: str, patience_s: float = _PATIENCE_S) -> None:
        """Wait until a JavaScript expression is true."""
        end = time.monotonic() + patience_s
        while not self.run(condition):
            if time.monotonic() > end:
                raise TimeoutError(f"{condition} stayed false; the console says {self.console}")
            time.sleep(0.05)

    def click_until(self, condition: str, selector: str, right: float, down: float) -> None:
        """Click on a place of an element, as shares of its width and height, until a JavaScript expression
        is true: a plot that is still settling its margins moves away from under the mouse.
        """
        for _ in range(_CLICKS):
            self.run(f"document.querySelector({selector!r}).scrollIntoView()")
            left, top, width, height = self.box(selector)
            x, y = left + right * width, top + down * height
            self.mouse("mouseMoved", x, y)
            self.mouse("mouseMoved", x + 1, y)
            self.mouse("mousePressed", x + 1, y, button="left", clickCount=1)
            self.mouse("mouseReleased", x + 1, y, button="left", clickCount=1)
            with contextlib.suppress(TimeoutError):
                return self.wait(condition, _PATIENCE_S / _CLICKS)
        raise TimeoutError(f"{condition} stayed false after {_CLICKS} clicks")

    def box(self, selector: str) -> list[float]:
        """Left, top, width and height of an element in the window, px."""
        corners = "(b => [b.left, b.top, b.width, b.height])"
        return list(self.run(f"{corners}(document.querySelector({selector!r}).getBoundingClientRect())"))

    def mouse(self, kind: str, x: float, y: float, **params: Any) -> None:
        """One mouse event (mousePressed, mouseMoved, mouseReleased, mouseWheel) at a place of the window,
        px.
        """
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **params)

    def screenshot(self, path: Path, whole: bool = False) -> None:
        """A PNG of the window, or of the whole page."""
        data = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=whole)["data"]
        path.write_bytes(base64.b64decode(data))

    def pdf(self, path: Path) -> None:
        """The page as it is printed."""
        path.write_bytes(
            base64.b64decode(
                self.call("Page.printToPDF", printBackground=True, preferCSSPageSize=True)["data"]
            )
        )

    def _message(self) -> dict[str, Any]:
        while b"\0" not in self._buffer:
            if not select.select([self._read], [], [], _PATIENCE_S)[0]:
                raise TimeoutError("the browser does not answer")
            chunk = os.read(self._read, 1 << 20)
            if not chunk:
                raise RuntimeError("the browser ended")
            self._buffer += chunk
        text, _, self._buffer = self._buffer.partition(b"\0")
        return dict(json.loads(text))

    def _note(self, event: dict[str, Any]) -> None:
        params = event.get("params", {})
        method = event.get("method")
        if method == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert"):
            self.console.append(" ".join(str(a.get("value", a.get("description"))) for a in params["args"]))
        elif method == "Runtime.exceptionThrown":
            self.console.append(json.dumps(params["exceptionDetails"]))
        elif method == "Log.entryAdded" and params["entry"]["level"] in ("error", "warning"):
            self.console.append(params["entry"]["text"])
        elif method == "Network.requestWillBeSent":
            self.requests.append(params["request"]["url"])


@contextlib.contextmanager
def browser() -> Iterator[Page]:
    """A browser with one tab, ended with the block; skips the calling test where no browser is installed."""
    program = chromium()
    to_browser, write = os.pipe()
    read, from_browser = os.pipe()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        command = f'exec "$0" "$@" 3<&{to_browser} 4>&{from_browser}'
        process = subprocess.Popen(
            ["/bin/bash", "-c", command, program, *_FLAGS, f"--user-data-dir={profile}"],
            pass_fds=(to_browser, from_browser),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        os.close(to_browser)
        os.close(from_browser)
        try:
            yield Page(write, read)
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGTERM)
            process.wait(timeout=20)
            os.close(write)
            os.close(read)
