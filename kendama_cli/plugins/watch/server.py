"""Server of the page of a run that goes on, on loopback, for whoever has the token; it never stops the run."""

from __future__ import annotations

import json
import threading
import time
from types import TracebackType
from typing import Any, Self

from kendama_cli.pipeline.plan import Planner
from kendama_cli.plugins.shared.web.loopback import NOT_FOUND, Answer, Asked, Listening, LoopbackServer
from kendama_cli.plugins.watch.drawing import Drawing
from kendama_cli.plugins.watch.pages import frame_page
from kendama_cli.plugins.watch.status import RunStatus

WATCHED_S = 5.0
"""The page is watched if a request came within this time."""
PATIENCE_S = 5.0
"""So long an ended run waits until its page has taken the last that there is."""

POLICY = "frame-ancestors 'self'"
"""The rest stands in each page, with its scripts' hashes."""
WRONG_TOKEN = "this address is not complete: open the one that the run printed"


class LivePage:
    """The page of one run: serves while it is entered, and draws only while somebody looks on."""

    def __init__(self, listening: Listening, status: RunStatus, planner: Planner) -> None:
        self._status = status
        self._drawing = Drawing(status, planner)
        self._asked_s = -WATCHED_S
        self._taken: dict[str, str] = {}
        self._server = LoopbackServer(listening, self.answer, policy=POLICY, stranger=WRONG_TOKEN)
        self.address = self._server.address

    def __enter__(self) -> Self:
        threading.Thread(target=self._server.serve_forever, args=(0.2,), daemon=True).start()
        self._drawer = threading.Thread(target=self._drawing.follow, args=(self.is_watched,), daemon=True)
        self._drawer.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._drawing.finish()
        if kind is None:
            self._drawer.join(PATIENCE_S)
            if self.is_watched() and not self._drawer.is_alive():
                self._drawing.draw()
            self._status.ends(self._status.reached)
        else:
            self._status.ends("interrupted" if issubclass(kind, KeyboardInterrupt) else "failed")
        deadline_s = time.monotonic() + (PATIENCE_S if kind is None else 1.0)
        while self.is_watched() and self._owed() and time.monotonic() < deadline_s:
            time.sleep(0.05)
        self._server.shutdown()
        self._server.server_close()

    def is_watched(self) -> bool:
        """Return True if a browser has sent a request recently."""
        return time.monotonic() - self._asked_s < WATCHED_S

    def answer(self, asked: Asked) -> Answer:
        """Return the page, its state, or the drawing of a part."""
        self._asked_s = time.monotonic()
        if asked.part == "state":
            return self._state(asked.query.get("seen", ""))
        if asked.part in self._drawing.pages:
            drawn = self._drawing.pages[asked.part]
            self._taken[asked.part] = str(drawn.number)
            return Answer(200, "text/html", drawn.page)
        return NOT_FOUND if asked.part else Answer(200, "text/html", frame_page("kendama: run").encode())

    def _state(self, seen: str) -> Answer:
        drawn = {part: one.number for part, one in self._drawing.pages.items()}
        document: dict[str, Any] = {**self._status.document(), "drawn": drawn}
        document["version"] = "-".join(map(str, (document["version"], *drawn.values())))
        self._taken["state"] = document["version"]
        if document["version"] == seen:
            return Answer(204, "application/json", b"")
        return Answer(200, "application/json", json.dumps(document).encode())

    def _owed(self) -> bool:
        """Return True if the page has not yet requested a part that exists."""
        drawn = {part: str(one.number) for part, one in self._drawing.pages.items() if one.number}
        state = "-".join(map(str, (self._status.version, *(one.number for one in self._drawing.pages.values()))))
        return any(self._taken.get(part) != number for part, number in {**drawn, "state": state}.items())
