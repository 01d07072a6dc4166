"""Serves the page of a run that goes on, on loopback, to whoever knows the token; nothing it does stops the run."""

from __future__ import annotations

import json
import secrets
import threading
import time
import urllib.parse
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from types import TracebackType
from typing import Any, ClassVar, Self

from kendama_cli.pipeline.live.drawing import Drawing
from kendama_cli.pipeline.live.status import RunStatus
from kendama_cli.pipeline.plan import Planner
from kendama_cli.report.live.pages import frame_page
from kendama_cli.system.listening import Listening

HOST = "127.0.0.1"
WATCHED_S = 5.0
"""Somebody looks on where something was asked within this time."""
PATIENCE_S = 5.0
"""So long an ended run waits until its page has taken the last that there is."""
SLOWEST_S = 10.0
"""A request that takes longer is given up."""

HEADERS = {
    "Content-Security-Policy": "frame-ancestors 'self'",  # the rest stands in each page, with its scripts' hashes
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}
WRONG_TOKEN = "kendama: this address is not complete: open the one that the run printed\n"


class LivePage:
    """The page of one run: serves while it is entered, and draws only while somebody looks on."""

    def __init__(self, listening: Listening, status: RunStatus, planner: Planner) -> None:
        self._status = status
        self._drawing = Drawing(status, planner)
        self._token = secrets.token_urlsafe(16)
        self._asked_s = -WATCHED_S
        self._taken: dict[str, str] = {}
        self._server = _Server(listening, self)
        self.address = f"http://{HOST}:{listening.getsockname()[1]}/?token={self._token}"

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
        """Whether a browser has asked of late."""
        return time.monotonic() - self._asked_s < WATCHED_S

    def answer(self, path: str) -> tuple[int, str, bytes]:
        """Status, type and content for the request of ``path``."""
        asked = urllib.parse.urlsplit(path)
        query = urllib.parse.parse_qs(asked.query)
        if not secrets.compare_digest(query.get("token", [""])[0].encode(), self._token.encode()):
            return 403, "text/plain", WRONG_TOKEN.encode()
        self._asked_s = time.monotonic()
        part = asked.path.strip("/")
        if part == "state":
            return self._state(query.get("seen", [""])[0])
        if part in self._drawing.pages:
            drawn = self._drawing.pages[part]
            self._taken[part] = str(drawn.number)
            return 200, "text/html", drawn.page
        if part:
            return 404, "text/plain", b"not found\n"
        return 200, "text/html", frame_page("kendama: run").encode()

    def _state(self, seen: str) -> tuple[int, str, bytes]:
        drawn = {part: one.number for part, one in self._drawing.pages.items()}
        document: dict[str, Any] = {**self._status.document(), "drawn": drawn}
        document["version"] = "-".join(map(str, (document["version"], *drawn.values())))
        self._taken["state"] = document["version"]
        if document["version"] == seen:
            return 204, "application/json", b""
        return 200, "application/json", json.dumps(document).encode()

    def _owed(self) -> bool:
        """Whether the page has not yet asked for something that there is."""
        drawn = {part: str(one.number) for part, one in self._drawing.pages.items() if one.number}
        state = "-".join(map(str, (self._status.version, *(one.number for one in self._drawing.pages.values()))))
        return any(self._taken.get(part) != number for part, number in {**drawn, "state": state}.items())


class _Server(ThreadingHTTPServer):
    daemon_threads = True

    def __init__(self, listening: Listening, page: LivePage) -> None:
        super().__init__(listening.getsockname()[:2], _Handler, bind_and_activate=False)
        self.socket.close()
        self.socket = listening
        self.page = page

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A browser that has gone is no error."""


class _Handler(BaseHTTPRequestHandler):
    server: _Server
    timeout: ClassVar[float] = SLOWEST_S

    def do_GET(self) -> None:
        """Answer a request."""
        code, kind, content = self.server.page.answer(self.path)
        self.send_response(code)
        for name, value in HEADERS.items():
            self.send_header(name, value)
        self.send_header("Content-Type", f"{kind}; charset=utf-8")
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing: the terminal is the run's."""
