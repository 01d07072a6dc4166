"""``kendama play`` as a user starts it, and players who speak to it."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

COMMAND = [sys.executable, "-m", "kendama_cli.cli.main", "play", "--no-show"]


class Game:
    """A running ``kendama play``: its address, its folder, and what it has said."""

    def __init__(self, folder: Path, *options: str) -> None:
        self.folder, self.said = folder, list[str]()
        self.process = subprocess.Popen(
            [*COMMAND, *options], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        assert self.process.stdout is not None
        self.address = self.process.stdout.readline().strip()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        parts = urlsplit(self.address)
        self.place, self.token = parts.netloc, parse_qs(parts.query).get("token", [""])[0]

    def _read(self) -> None:
        assert self.process.stderr is not None
        self.said.extend(line.rstrip() for line in self.process.stderr)

    @contextlib.contextmanager
    def line(self, player: str, token: str | None = None) -> Iterator[Line]:
        """A player's line."""
        asked = f"token={self.token if token is None else token}&player={player}"
        with connect(f"ws://{self.place}/line?{asked}", max_size=None) as socket:
            yield Line(socket)

    def end(self) -> int:
        """End it as Ctrl-C does; its exit code."""
        self.process.send_signal(2)
        code = self.process.wait(timeout=20)
        self._reader.join(timeout=5)
        return code


class Line:
    """Messages from and to one page; ``latest`` has the last message of every kind."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket, self.latest = socket, dict[str, dict[str, Any]]()

    def say(self, **message: object) -> None:
        """Say something."""
        self.socket.send(json.dumps(message))

    def hear(self, kind: str) -> dict[str, Any]:
        """The next message of this kind."""
        while True:
            message = json.loads(self.socket.recv(timeout=20))
            self.latest[message["type"]] = message
            if message["type"] == kind:
                return dict(message)

    def goodbye(self) -> tuple[int, str]:
        """Code and reason with which the line is closed."""
        try:
            while True:
                self.socket.recv(timeout=20)
        except ConnectionClosed as closed:
            if closed.rcvd is None:
                raise
            return closed.rcvd.code, closed.rcvd.reason
