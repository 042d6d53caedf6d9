"""A headless Chromium for tests, spoken to over pipes by the DevTools protocol.

In: a page on disk. Out: what it asked the network for, what it wrote to the console as an error,
values of expressions in it, and pictures of it. The network is off: every name fails to resolve.
"""

from __future__ import annotations

import base64
import json
import os
import select
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

NAMES = ("chromium", "chromium-browser", "google-chrome")
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
    "--host-resolver-rules=MAP * ~NOTFOUND",
    "--remote-debugging-pipe",
)
DRAWING = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
NO_DRAWING = ("--disable-gpu", "--disable-3d-apis")
PATIENCE = 120.0  # s, for one answer; so long that only a browser that hangs exceeds it


def program() -> str | None:
    """The browser of this machine, or None."""
    return next((found for name in NAMES if (found := shutil.which(name))), None)


class Page:
    """One page in a browser of its own. Use it as a context manager.

    Attributes:
      requests: addresses that the page asked for, its own and data addresses apart.
      errors: texts of console errors and of exceptions that nothing caught.
    """

    def __init__(self, path: Path, width: int = 1200, height: int = 900, webgl: bool = True):
        self.requests: list[str] = []
        self.errors: list[str] = []
        self._path, self._size = Path(path).resolve(), (width, height)
        self._drawing = DRAWING if webgl else NO_DRAWING
        self._count, self._rest = 0, b""

    def __enter__(self) -> Page:
        self._profile = tempfile.mkdtemp(prefix="browser-")
        to_browser, from_browser = os.pipe(), os.pipe()
        width, height = self._size

        def wire() -> None:  # the browser reads from 3 and writes to 4
            read, write = os.dup(to_browser[0]), os.dup(from_browser[1])
            os.dup2(read, 3), os.dup2(write, 4)

        self._process = subprocess.Popen(
            [
                program(),
                *FLAGS,
                *self._drawing,
                f"--user-data-dir={self._profile}",
                f"--window-size={width},{height}",
                "about:blank",
            ],
            preexec_fn=wire,
            close_fds=False,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(to_browser[0]), os.close(from_browser[1])
        self._write, self._read = to_browser[1], from_browser[0]
        self._session = None
        try:
            self._open(width, height)
        except BaseException:
            self.__exit__()
            raise
        return self

    def _open(self, width: int, height: int) -> None:
        """A page of our own: the browser's first one may not be there yet."""
        target = self._ask("Target.createTarget", url="about:blank")["targetId"]
        attached = self._ask("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Network", "Runtime", "Log", "Page"):
            self._ask(f"{domain}.enable")
        self._ask(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=False,
        )
        self._ask("Page.navigate", url=self._path.as_uri())
        self.wait("document.readyState === 'complete'")

    def __exit__(self, *_: object) -> None:
        try:
            self._session = None
            self._ask("Browser.close")
            self._process.wait(PATIENCE)
        except Exception:
            self._process.kill()
            self._process.wait()
        os.close(self._write), os.close(self._read)
        shutil.rmtree(self._profile, ignore_errors=True)

    def value(self, expression: str):
        """The value of an expression, awaited where it is a promise."""
        answer = self._ask(
            "Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True
        )
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def wait(self, expression: str) -> None:
        """Return once the expression is true in the page."""
        deadline = time.monotonic() + PATIENCE
        while not self.value(expression):
            assert time.monotonic() < deadline, f"never true: {expression}"
            time.sleep(0.05)

    def press(self, key: str) -> None:
        """A key, down and up."""
        text = {"text": key} if len(key) == 1 else {}
        self._ask("Input.dispatchKeyEvent", type="keyDown", key=key, **text)
        self._ask("Input.dispatchKeyEvent", type="keyUp", key=key)

    def mouse(self, kind: str, x: float, y: float) -> None:
        """A mouse event: mousePressed, mouseMoved or mouseReleased, at a place in pixels."""
        more = {} if kind == "mouseMoved" else {"button": "left", "clickCount": 1}
        self._ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def touch(self, kind: str, points: list[tuple[float, float]]) -> None:
        """A touch: touchStart, touchMove or touchEnd, with the fingers' places in pixels."""
        fingers = [{"x": x, "y": y, "id": k} for k, (x, y) in enumerate(points)]
        self._ask("Input.dispatchTouchEvent", type=kind, touchPoints=fingers)

    def picture(self) -> bytes:
        """The window as PNG."""
        return base64.b64decode(self._ask("Page.captureScreenshot", format="png")["data"])

    def _ask(self, method: str, **given: object) -> dict:
        self._count += 1
        message = {"id": self._count, "method": method, "params": given}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._write, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == self._count:
                assert "error" not in answer, f"{method}: {answer['error']}"
                return answer["result"]
            self._note(answer)

    def _next(self) -> dict:
        while b"\0" not in self._rest:
            ready, _, _ = select.select([self._read], [], [], PATIENCE)
            assert ready, "the browser does not answer"
            more = os.read(self._read, 1 << 20)
            assert more, "the browser has gone"
            self._rest += more
        line, _, self._rest = self._rest.partition(b"\0")
        return json.loads(line)

    def _note(self, event: dict) -> None:
        method, given = event.get("method", ""), event.get("params", {})
        if method == "Network.requestWillBeSent":
            url = given["request"]["url"]
            own = url.split("#")[0] == self._path.as_uri()
            if not own and not url.startswith(("data:", "about:")):
                self.requests.append(url)
        elif method == "Runtime.consoleAPICalled" and given["type"] in ("error", "assert"):
            self.errors.append(str(given["args"]))
        elif method == "Runtime.exceptionThrown":
            self.errors.append(str(given["exceptionDetails"]))
        elif method == "Log.entryAdded" and given["entry"]["level"] == "error":
            self.errors.append(given["entry"]["text"])
