"""`afo-sim studio` in a process of its own, and a tab of it."""

import contextlib
import json
import pathlib
import subprocess
import sys
from collections.abc import Iterator
from typing import Any


class Served:
    """A studio that saves below a folder; what it complains of is in `said`."""

    def __init__(self, folder: pathlib.Path) -> None:
        self.folder, self._said = folder / "saved", folder / "said.txt"
        words = [sys.executable, "-m", "afo_sim", "studio", "--no-browser", "--out", str(self.folder)]
        with self._said.open("w") as said:
            self.process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=said, text=True)
        assert self.process.stdout is not None
        self.address = self.process.stdout.readline().split()[-1]

    @property
    def said(self) -> str:
        return self._said.read_text()

    def close(self) -> None:
        self.process.terminate()
        self.process.wait()
        assert self.process.stdout is not None
        self.process.stdout.close()


class Tab:
    """One tab's socket."""

    def __init__(self, socket: Any) -> None:
        self.socket = socket
        self.heard: list[dict[str, Any]] = []

    @classmethod
    @contextlib.contextmanager
    def open(cls, address: str, **more: Any) -> Iterator["Tab"]:
        from websockets.sync import client

        with client.connect(f"{address.replace('http', 'ws', 1)}socket", open_timeout=20, **more) as socket:
            yield cls(socket)

    def ask(self, op: str, **more: Any) -> None:
        self.socket.send(json.dumps({"op": op, **more}))

    def until(self, kind: str, serial: int = 0, within: float = 60.0) -> dict[str, Any]:
        """The next message of a kind, of a design not before `serial`."""
        while True:
            message: dict[str, Any] = json.loads(self.socket.recv(timeout=within))
            self.heard.append(message)
            if message["kind"] == kind and message.get("serial", 0) >= serial:
                return message
