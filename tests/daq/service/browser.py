"""Headless Chromium, driven over the DevTools protocol: what a person does to a page, and what they see."""

from __future__ import annotations

import base64
import json
import os
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from websockets.sync.client import ClientConnection, connect

PATIENCE = 240.0
"""s that anything may take on a busy machine."""

_OPTIONS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-crash-reporter",
    "--disable-breakpad",
    "--hide-scrollbars",
    "--remote-debugging-port=0",
)
_NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")


def chromium() -> str | None:
    """Path of the browser; None where there is none."""
    return next((found for name in _NAMES if (found := shutil.which(name))), None)


@contextmanager
def browsing(program: str, profile: Path, origin: str) -> Iterator[Browser]:
    """A browser of its own with one page, for the length of a block.

    Args:
        program: path of the browser.
        profile: folder for what it writes.
        origin: of the service, e.g. ``http://127.0.0.1:8090``.
    """
    process = subprocess.Popen(
        [program, *_OPTIONS, f"--user-data-dir={profile}", "about:blank"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env=os.environ | {"XDG_CONFIG_HOME": str(profile)},
    )
    try:
        with connect(_page_address(process, profile / "DevToolsActivePort"), max_size=None) as socket:
            yield Browser(socket, origin)
    finally:
        process.terminate()
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


class Browser:
    """One page.

    Args:
        socket: to its DevTools.
        origin: of the service.
    """

    def __init__(self, socket: ClientConnection, origin: str) -> None:
        self.origin = origin
        self.problems: list[str] = []
        """Errors and warnings of the console, exceptions, requests to elsewhere."""
        self._socket = socket
        self._number = 0
        self._loads = 0
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")
        self.resize(1280, 900)

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """One command of the protocol, and its answer."""
        self._number += 1
        self._socket.send(json.dumps({"id": self._number, "method": method, "params": parameters}))
        while True:
            message = json.loads(self._socket.recv(PATIENCE))
            if message.get("id") == self._number:
                assert "error" not in message, f"{method}: {message}"
                return dict(message["result"])
            self._heard(message)

    def evaluate(self, script: str) -> Any:
        """Value of an expression in the page; a promise is waited for."""
        found = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    def open(self, path: str) -> None:
        """Go to a page of the service."""
        self._and_wait(lambda: self.call("Page.navigate", url=self.origin + path))

    def click(self, selector: str, text: str = "", *, leaves: bool = True) -> None:
        """Press the mouse on the first visible element that matches and has a text.

        Args:
            selector: of CSS.
            text: that it contains.
            leaves: whether another page follows.
        """
        point = self.evaluate(_PLACE % (json.dumps(selector), json.dumps(text)))
        assert point, f"nothing to click on: {selector} {text}"

        def press() -> None:
            where = {"x": point[0], "y": point[1], "button": "left", "clickCount": 1}
            for kind in ("mousePressed", "mouseReleased"):
                self.call("Input.dispatchMouseEvent", type=kind, **where)

        self._and_wait(press) if leaves else press()

    def key(self, name: str, code: int, text: str = "", *, leaves: bool = False) -> None:
        """Press and release a key."""

        def press() -> None:
            for kind in ("keyDown", "keyUp"):
                typed = {"text": text} if text and kind == "keyDown" else {}
                self.call(
                    "Input.dispatchKeyEvent",
                    type=kind,
                    key=name,
                    code=name,
                    windowsVirtualKeyCode=code,
                    **typed,
                )

        self._and_wait(press) if leaves else press()

    def type(self, selector: str, text: str) -> None:
        """Put the cursor into a field, empty it, write."""
        self.evaluate(f"(e => {{ e.focus(); e.select(); }})(document.querySelector({json.dumps(selector)}))")
        self.call("Input.insertText", text=text)

    def until(self, condition: str) -> None:
        """Wait for an expression to become true."""
        deadline = time.monotonic() + PATIENCE
        while not self.evaluate(condition):
            assert time.monotonic() < deadline, f"never became true: {condition}"
            time.sleep(0.05)

    def resize(self, width: int, height: int) -> None:
        """Size of the window, of a phone where it is narrow."""
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=width < 600,
        )

    def colours(self, scheme: str) -> None:
        """``dark`` or ``light``."""
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])

    def picture(self, path: Path) -> None:
        """The whole page as PNG."""
        found = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=True)
        path.write_bytes(base64.b64decode(found["data"]))

    def _and_wait(self, act: Callable[[], Any]) -> None:
        """Do something that leads to another page, and wait until that is there."""
        before = self._loads
        act()
        deadline = time.monotonic() + PATIENCE
        while self._loads == before:
            assert time.monotonic() < deadline, "no page came"
            self._heard(json.loads(self._socket.recv(PATIENCE)))

    def _heard(self, message: dict[str, Any]) -> None:
        method, told = message.get("method"), message.get("params", {})
        if method == "Page.loadEventFired":
            self._loads += 1
        elif method == "Runtime.exceptionThrown":
            self.problems.append(str(told["exceptionDetails"]))
        elif method == "Runtime.consoleAPICalled" and told["type"] in ("error", "warning", "assert"):
            self.problems.append(str(told["args"]))
        elif method == "Log.entryAdded" and told["entry"]["level"] in ("error", "warning"):
            self.problems.append(str(told["entry"]))
        elif method == "Network.requestWillBeSent":
            url = told["request"]["url"]
            if not url.startswith((self.origin + "/", "data:", "about:")):
                self.problems.append(f"a request to elsewhere: {url}")


def _page_address(process: subprocess.Popen[bytes], port_file: Path) -> str:
    """Address of the DevTools of the browser's page."""
    deadline = time.monotonic() + PATIENCE
    while not (port_file.exists() and len(port_file.read_text().splitlines()) == 2):
        assert process.poll() is None, "the browser did not start"
        assert time.monotonic() < deadline, "the browser did not open its port"
        time.sleep(0.05)
    port, path = port_file.read_text().splitlines()
    address = f"ws://127.0.0.1:{port}"
    with connect(address + path, max_size=None) as root:
        root.send(json.dumps({"id": 1, "method": "Target.getTargets"}))
        while "result" not in (answer := json.loads(root.recv(PATIENCE))):
            pass
    pages = [one for one in answer["result"]["targetInfos"] if one["type"] == "page"]
    return f"{address}/devtools/page/{pages[0]['targetId']}"


_PLACE = """
((selector, text) => {
  for (const element of document.querySelectorAll(selector)) {
    if (!element.textContent.includes(text)) continue;
    element.scrollIntoView({ block: "center", behavior: "instant" });
    const box = element.getClientRects()[0];
    if (box && box.width > 0) return [box.x + box.width / 2, box.y + box.height / 2];
  }
  return null;
})(%s, %s)
"""
