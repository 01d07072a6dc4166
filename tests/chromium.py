"""A headless Chromium of a test's own, driven over the DevTools protocol: pages, real pointer events, pictures."""

from __future__ import annotations

import base64
import contextlib
import itertools
import json
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from websockets.sync.client import ClientConnection, connect

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
OPTIONS = (
    *("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--hide-scrollbars"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync", "--remote-debugging-port=0"),
    *("--disable-backgrounding-occluded-windows", "--disable-renderer-backgrounding"),
)


class Tab:
    """One page of the browser."""

    def __init__(self, line: ClientConnection) -> None:
        self._line, self._numbers = line, itertools.count(1)
        self.said: list[str] = []
        self("Runtime.enable")
        self("Page.enable")

    def __call__(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Carry out a command of the protocol and wait for its answer."""
        number = next(self._numbers)
        self._line.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            answer = json.loads(self._line.recv(timeout=30))
            if answer.get("id") == number:
                assert "error" not in answer, answer
                return dict(answer["result"])
            self._hear(answer)

    def send(self, method: str, **parameters: Any) -> None:
        """Ask for something and do not wait: input at its own pace."""
        self._line.send(json.dumps({"id": next(self._numbers), "method": method, "params": parameters}))

    def _hear(self, event: dict[str, Any]) -> None:
        if event.get("method") == "Runtime.exceptionThrown":
            details = event["params"]["exceptionDetails"]
            self.said.append(details.get("exception", {}).get("description", details["text"]))
        elif event.get("method") == "Page.javascriptDialogOpening":
            number = next(self._numbers)
            message = {"accept": True, "promptText": "a name"}
            self._line.send(json.dumps({"id": number, "method": "Page.handleJavaScriptDialog", "params": message}))

    def value(self, expression: str) -> Any:
        """What the expression is in the page."""
        answer = self("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def wait(self, expression: str, timeout_s: float = 90.0) -> Any:
        """Wait until the expression is true; its value."""
        until = time.monotonic() + timeout_s
        while not (value := self.value(expression)):
            assert time.monotonic() < until, f"never true: {expression}; {self.said}"
            time.sleep(0.02)
        return value

    def picture(self, file: Path) -> None:
        """A screenshot."""
        file.write_bytes(base64.b64decode(self("Page.captureScreenshot")["data"]))


class Browser:
    """A running Chromium."""

    def __init__(self, folder: Path, lines: contextlib.ExitStack) -> None:
        self._lines = lines
        port_file = folder / "DevToolsActivePort"
        until = time.monotonic() + 60
        while not port_file.exists() or not port_file.read_text().count("\n"):
            assert time.monotonic() < until, "Chromium did not start"
            time.sleep(0.05)
        self._port, path = port_file.read_text().split("\n")[:2]
        self._line = lines.enter_context(connect(f"ws://127.0.0.1:{self._port}{path}", max_size=None))
        self._numbers = itertools.count(1)

    def open(self, address: str, width: int = 1280, height: int = 800, *, phone: bool = False) -> Tab:
        """A new window of this size that shows ``address``."""
        made = self._ask("Target.createTarget", url="about:blank", newWindow=True, width=width, height=height)
        target = f"ws://127.0.0.1:{self._port}/devtools/page/{made['targetId']}"
        tab = Tab(self._lines.enter_context(connect(target, max_size=None)))
        scale = 2 if phone else 1
        tab("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale, mobile=phone)
        if phone:
            tab("Emulation.setTouchEmulationEnabled", enabled=True)
        tab("Page.navigate", url=address)
        return tab

    def _ask(self, method: str, **parameters: Any) -> dict[str, Any]:
        number = next(self._numbers)
        self._line.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            answer = json.loads(self._line.recv(timeout=30))
            if answer.get("id") == number:
                return dict(answer["result"])


@contextlib.contextmanager
def browser(folder: Path) -> Iterator[Browser]:
    """A Chromium with a profile in ``folder``, ended on the way out."""
    process = subprocess.Popen(
        [str(CHROMIUM), *OPTIONS, f"--user-data-dir={folder}", "about:blank"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        with contextlib.ExitStack() as lines:
            yield Browser(folder, lines)
    finally:
        process.terminate()
        process.wait(timeout=20)
