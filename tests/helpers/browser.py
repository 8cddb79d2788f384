"""Chromium without a window, asked through a pipe as its developer tools ask."""

import json
import os
import pathlib
import shutil
import subprocess
from typing import Any

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
OPTIONS = ["--headless", "--no-sandbox", "--no-first-run", "--remote-debugging-pipe"]
OFF = ("gpu", "quic", "background-networking", "component-update", "sync")


class Browser:
    """One tab. `requests` are the addresses that its pages have asked for, data in pages left out.

    `faults` are the errors that its pages have reported.
    """

    def __init__(self, folder: pathlib.Path):
        asked, self._write = os.pipe()
        self._read, answered = os.pipe()
        own = f"/proc/{os.getpid()}/fd"
        line = f'exec "$@" 3<{own}/{asked} 4>{own}/{answered}'  # the two that Chromium reads and writes
        options = [*OPTIONS, *(f"--disable-{name}" for name in OFF), f"--user-data-dir={folder}"]
        command = ["sh", "-c", line, "sh", str(CHROMIUM), *options]
        self.process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
        self.requests: set[str] = set()
        self.faults: list[str] = []
        self._count, self._session, self._rest, self._events = 0, {}, b"", list[str]()
        self.ask("Browser.getVersion")
        os.close(asked)  # it has opened its ends
        os.close(answered)
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        attached = self.ask("Target.attachToTarget", targetId=target, flatten=True)
        self._session = {"sessionId": attached["sessionId"]}
        for domain in ("Network", "Page", "Runtime", "Log"):
            self.ask(f"{domain}.enable")

    def ask(self, method: str, **params: Any) -> dict[str, Any]:
        """The answer to one command."""
        self._count += 1
        message = {"id": self._count, "method": method, "params": params, **self._session}
        os.write(self._write, json.dumps(message).encode() + b"\0")
        while (answer := self._next()).get("id") != self._count:
            pass
        assert "error" not in answer, answer
        result: dict[str, Any] = answer["result"]
        return result

    def open(self, address: str) -> None:
        """Show a page, until it is loaded."""
        self._events.clear()
        self.ask("Page.navigate", url=address)
        while "Page.loadEventFired" not in self._events:
            self._next()

    def run(self, script: str) -> Any:
        """The value of an expression in the page, awaited."""
        answer = self.ask("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def wait(self, condition: str, seconds: float = 30.0) -> None:
        """Return when an expression in the page is true."""
        look = f"const look = () => ({condition}) ? done(true) : setTimeout(look, 15)"
        assert self.run(
            f"new Promise(done => {{ setTimeout(() => done(false), {1e3 * seconds:.0f}); {look}; look() }})"
        ), condition

    def resize(self, width: int, height: int = 900) -> None:
        """Lay the page out for a window of this size [CSS pixel]."""
        self.ask("Emulation.setScrollbarsHidden", hidden=True)
        self.ask(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=False,
        )

    def mouse(self, *places: tuple[float, float], release: bool = True) -> None:
        """Press the left button at the first place, move to the others, and let go [CSS pixel]."""
        kinds = ["mouseMoved", "mousePressed", *["mouseMoved"] * (len(places) - 1)]
        for kind, place in zip(kinds, (places[0], *places), strict=True):
            self._mouse(kind, place)
        if release:
            self._mouse("mouseReleased", places[-1])

    def mouse_to(self, place: tuple[float, float]) -> None:
        """Move with the button held."""
        self._mouse("mouseMoved", place)

    def mouse_up(self, place: tuple[float, float]) -> None:
        """Let go."""
        self._mouse("mouseReleased", place)

    def _mouse(self, kind: str, place: tuple[float, float]) -> None:
        pressed = {"button": "left", "buttons": int(kind != "mouseReleased"), "clickCount": 1}
        self.ask("Input.dispatchMouseEvent", type=kind, x=place[0], y=place[1], **pressed)

    def press(self, key: str, *, control: bool = False, shift: bool = False) -> None:
        """Press a key and let it go, by its name in the page such as "Tab"."""
        code = {"Tab": 9, "Enter": 13, "ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40}
        key_code = code.get(key, ord(key[0].upper()))
        held = {"modifiers": 2 * control + 8 * shift, "windowsVirtualKeyCode": key_code}
        held |= {"text": "\r"} if key == "Enter" else {}
        for kind in ("keyDown", "keyUp"):
            self.ask("Input.dispatchKeyEvent", type=kind, key=key, **held)

    def close(self) -> None:
        """End it."""
        self.process.terminate()
        self.process.wait()
        os.close(self._write)
        os.close(self._read)

    def _next(self) -> dict[str, Any]:
        while b"\0" not in self._rest:
            read = os.read(self._read, 1 << 16)
            assert read, "Chromium has ended"
            self._rest += read
        text, _, self._rest = self._rest.partition(b"\0")
        message: dict[str, Any] = json.loads(text)
        self._events.append(message.get("method", ""))
        if message.get("method") == "Network.requestWillBeSent":
            url = message["params"]["request"]["url"]
            self.requests |= set() if url.startswith("data:") else {url}
        if message.get("method") == "Network.webSocketCreated":
            self.requests.add(message["params"]["url"])
        if message.get("method") == "Runtime.exceptionThrown":
            self.faults.append(message["params"]["exceptionDetails"].get("exception", {}).get("description"))
        if message.get("method") == "Log.entryAdded" and message["params"]["entry"]["level"] == "error":
            self.faults.append(message["params"]["entry"]["text"])
        return message
