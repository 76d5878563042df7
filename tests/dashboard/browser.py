"""A headless Chromium, driven by its DevTools protocol over the websocket library: no other tool is needed."""

from __future__ import annotations

import base64
import json
import os
import shutil
import subprocess
import time
import urllib.request
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any

from websockets.sync.client import ClientConnection, connect

PROGRAMS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
LONG_S = 60.0
OPTIONS = (
    "--headless=new",
    "--remote-debugging-port=0",
    "--remote-allow-origins=*",
    "--no-first-run",
    "--disable-extensions",
    "--disable-background-networking",
    "--disable-dev-shm-usage",
    "--hide-scrollbars",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)


def program() -> str | None:
    """Path of the browser that is installed here."""
    return next((path for name in PROGRAMS if (path := shutil.which(name))), None)


class Browser:
    """One page of a browser with a profile of its own. Use it as a context.

    Attributes:
        console: What the page wrote to the console or could not load, and exceptions of its scripts.
    """

    def __init__(self, folder: Path, width: int = 1280, height: int = 800, dark: bool = True) -> None:
        self.console: list[str] = []
        self._folder = folder
        self._size = (width, height)
        self._dark = dark
        self._number = 0
        self._connection: ClientConnection | None = None

    def __enter__(self) -> Browser:
        found = program()
        assert found is not None
        options = [*OPTIONS, f"--user-data-dir={self._folder}", *(["--no-sandbox"] if os.geteuid() == 0 else [])]
        self._process = subprocess.Popen(
            [found, *options, "about:blank"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        try:
            self._open()
        except BaseException:
            self.__exit__(None, None, None)
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._connection is not None:
            self._connection.close()
        self._process.terminate()
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def begin(self) -> None:
        """An empty page of the first size; what was said on the console is forgotten."""
        self.open("about:blank")
        self.resize(*self._size)
        self.appearance(self._dark)
        self.console.clear()

    def open(self, link: str) -> None:
        """Loads a page."""
        answer = self.call("Page.navigate", url=link)
        assert "errorText" not in answer, answer

    def run(self, script: str) -> Any:
        """Value of a JavaScript expression in the page."""
        answer = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def until(self, script: str, what: str) -> Any:
        """Waits until an expression is true and returns its value."""
        return self.wait(lambda: self.run(script), what)

    def wait(self, holds: Callable[[], Any], what: str) -> Any:
        """Waits until `holds` returns something true."""
        end_s = time.monotonic() + LONG_S
        while not (value := holds()):
            assert time.monotonic() < end_s, f"{what}; console: {self.console}; page: {self.text()}"
            self.run("new Promise((done) => setTimeout(done, 50, true))")
        return value

    def text(self) -> str:
        """Text of the page."""
        return str(self.run("document.body.innerText"))

    def click(self, selector: str) -> None:
        """Clicks with the mouse on the middle of an element."""
        box = f"(() => {{ const b = document.querySelector({json.dumps(selector)}).getBoundingClientRect();"
        x, y = self.run(box + " return [b.x + b.width / 2, b.y + b.height / 2]; })()")
        for kind in ("mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def press(self, key: str, code: str) -> None:
        """Presses a key."""
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=code)

    def resize(self, width: int, height: int, scale: float = 1.0) -> None:
        """Gives the page another size, px."""
        self.call(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale, mobile=False
        )

    def appearance(self, dark: bool) -> None:
        """What the person prefers: dark or light."""
        value = "dark" if dark else "light"
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": value}])

    def shot(self, path: Path, whole: bool = False) -> None:
        """Writes a picture of the page."""
        answer = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(answer["data"]))

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """One command of the DevTools protocol; events that come in between are kept if they tell of an error."""
        assert self._connection is not None
        self._number += 1
        self._connection.send(json.dumps({"id": self._number, "method": method, "params": parameters}))
        while True:
            message = json.loads(self._connection.recv(LONG_S))
            if message.get("id") == self._number:
                assert "error" not in message, (method, message["error"])
                return dict(message["result"])
            self._event(message)

    def _event(self, message: dict[str, Any]) -> None:
        parameters = message.get("params", {})
        if message.get("method") == "Log.entryAdded":
            self.console.append(f"{parameters['entry']['level']}: {parameters['entry']['text']}")
        elif message.get("method") == "Runtime.exceptionThrown":
            details = parameters["exceptionDetails"]
            self.console.append(f"exception: {details.get('exception', {}).get('description', details['text'])}")
        elif message.get("method") == "Runtime.consoleAPICalled":
            self.console.append(f"{parameters['type']}: {[a.get('value') for a in parameters['args']]}")

    def _open(self) -> None:
        port_file = self._folder / "DevToolsActivePort"
        end_s = time.monotonic() + LONG_S
        while not port_file.exists() or not port_file.read_text().count("\n"):
            assert self._process.poll() is None, "the browser ended"
            assert time.monotonic() < end_s, "the browser did not start"
            try:
                self._process.wait(0.05)
            except subprocess.TimeoutExpired:
                continue
        port = port_file.read_text().splitlines()[0]
        opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        with opener.open(f"http://127.0.0.1:{port}/json/list", timeout=LONG_S) as answer:
            target = next(item for item in json.load(answer) if item["type"] == "page")
        opening = connect(target["webSocketDebuggerUrl"], max_size=None, proxy=None, open_timeout=LONG_S)
        self._connection = opening.__enter__()
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")
        self.begin()
