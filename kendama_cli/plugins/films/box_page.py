"""Serves the page on which boxes are drawn, on loopback, to whoever knows the token."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable
from importlib import resources
from typing import Any

from kendama_cli.errors import KendamaError
from kendama_cli.plugins.films.drawn_boxes import DrawnBoxes
from kendama_cli.plugins.shared.web.listening import Listening
from kendama_cli.plugins.shared.web.loopback import NOT_FOUND, Answer, Asked, LoopbackServer

ASSETS = {"boxes.css": "text/css", "boxes.js": "text/javascript"}
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; form-action 'none'; "
    "base-uri 'none'; frame-ancestors 'none'"
)
STRANGER = "this address has expired or is not complete: open the one that kendama printed last"
FAREWELL_S = 0.5
"""So long the page may take its last answer."""


class BoxPage:
    """The page of boxes about a ``thing``; ``write`` writes them and gives the lines that say how to go on."""

    def __init__(
        self,
        listening: Listening,
        boxes: DrawnBoxes,
        about: dict[str, Any],
        write: Callable[[], list[str]],
        thing: str = "ball",
    ) -> None:
        self._boxes, self._about, self._write, self._thing = boxes, about, write, thing.encode()
        self._done = threading.Event()
        self._once = threading.Lock()
        self._lines: list[str] = []
        self._server = LoopbackServer(listening, self._answer, policy=POLICY, stranger=STRANGER, free=("assets",))
        self.address = self._server.address

    def serve(self) -> list[str]:
        """Serve until the person has done; the lines that ``write`` gave. A KeyboardInterrupt goes through."""
        threading.Thread(target=lambda: self._server.serve_forever(0.1), daemon=True).start()
        try:
            while not self._done.wait(0.2):  # a wait without end would keep Ctrl-C
                pass
            time.sleep(FAREWELL_S)
        finally:
            self._server.shutdown()
            self._server.server_close()
        return self._lines

    def _answer(self, asked: Asked) -> Answer:
        head, _, rest = asked.part.partition("/")
        if asked.sent is not None:
            if asked.part == "box":
                return self._take(asked.sent)
            return self._finish() if asked.part == "done" else NOT_FOUND
        if head == "assets" and rest in ASSETS:
            return Answer(200, ASSETS[rest], self._read(rest))
        if head == "frame" and rest.isdecimal() and int(rest) in self._boxes.stills.jpeg:
            return Answer(200, "image/jpeg", self._boxes.stills.jpeg[int(rest)])
        if asked.part == "state":
            return self._state()
        return NOT_FOUND if asked.part else Answer(200, "text/html", self._read("boxes.html"))

    def _state(self) -> Answer:
        document = {**self._about, **self._boxes.document(), "missing": self._boxes.missing(), "lines": self._lines}
        return Answer(200, "application/json", json.dumps(document).encode())

    def _take(self, sent: bytes) -> Answer:
        try:
            message = json.loads(sent)
            box = message["box"]
            self._boxes.put(int(message["frame"]), None if box is None else [float(side) for side in box])
        except (ValueError, KeyError, TypeError) as wrong:
            return Answer(400, "text/plain", f"no box: {wrong}\n".encode())
        return self._state()

    def _finish(self) -> Answer:
        with self._once:
            if (missing := self._boxes.missing()) is not None:
                return Answer(409, "text/plain", f"{missing}\n".encode())
            if not self._done.is_set():
                try:
                    self._lines = self._write()
                except (KendamaError, OSError) as wrong:
                    return Answer(500, "text/plain", f"nothing written: {wrong}\n".encode())
                self._done.set()
            return self._state()

    def _read(self, name: str) -> bytes:
        """Return a file of the page, whose texts name the thing; no other word in it is 'ball'."""
        return (resources.files(__package__) / "page" / name).read_bytes().replace(b"ball", self._thing)
