"""A page served on loopback to whoever knows its token; nothing heavy is imported, a taken port is told at once."""

from __future__ import annotations

import secrets
import socket
import urllib.parse
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, ClassVar

from kendama_cli.errors import UsageError

Listening = socket.socket
HOST = "127.0.0.1"
MAX_REQUEST_S = 10.0
"""A request that takes longer is given up."""
MAX_BYTES = 10_000
"""Bytes that a page may send in one request."""
OWN_FILES = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; form-action 'none'; "
    "base-uri 'none'; frame-ancestors 'none'"
)
"""Content-Security-Policy of a page that takes nothing but files of its own server."""
HEADERS = {
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}


def listen(host: str, port: int) -> Listening:
    """Return a socket that listens there, 0 for any free port; raises UsageError."""
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
        listening = socket.create_server((host, port), family=family)
    except OSError as error:
        raise UsageError(
            f"cannot listen on {host}:{port} ({error.strerror or error}): choose another --port, or 0 for a free one"
        ) from None
    return listening


def own_address() -> str:
    """Return this machine's address in its network, loopback where it has none; nothing is sent to find out."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # an address for documentation: it only chooses an interface
        except OSError:
            return "127.0.0.1"
        return str(probe.getsockname()[0])


@dataclass(frozen=True)
class Asked:
    """Request of a browser: the path without slashes at its ends, its query, and the body, None if there is none."""

    part: str
    query: Mapping[str, str]
    sent: bytes | None


@dataclass(frozen=True)
class Answer:
    """Status, type and content."""

    status: int
    kind: str
    content: bytes


NOT_FOUND = Answer(404, "text/plain", b"not found\n")


class LoopbackServer(ThreadingHTTPServer):
    """Server of ``answer``'s results on a socket that listens already; every request must carry the token.

    ``policy`` is the Content-Security-Policy of all answers; ``stranger`` is the answer to whoever has not the token;
    ``free`` are first parts of paths that are served without it.
    """

    daemon_threads = True

    def __init__(
        self,
        listening: socket.socket,
        answer: Callable[[Asked], Answer],
        *,
        policy: str,
        stranger: str,
        free: tuple[str, ...] = (),
    ) -> None:
        super().__init__(listening.getsockname()[:2], _Handler, bind_and_activate=False)
        self.socket.close()
        self.socket = listening
        self._answer, self._stranger, self._free = answer, stranger, free
        self._token = secrets.token_urlsafe(16)
        self.headers = {"Content-Security-Policy": policy, **HEADERS}
        self.address = f"http://{HOST}:{listening.getsockname()[1]}/?token={self._token}"

    def answered(self, path: str, sent: bytes | None) -> Answer:
        """Return the answer to a request of ``path``."""
        asked = urllib.parse.urlsplit(path)
        query = {name: values[0] for name, values in urllib.parse.parse_qs(asked.query).items()}
        part = asked.path.strip("/")
        known = secrets.compare_digest(query.get("token", "").encode(), self._token.encode())
        if not known and not (sent is None and part.partition("/")[0] in self._free):
            return Answer(403, "text/plain", f"kendama: {self._stranger}\n".encode())
        return self._answer(Asked(part, query, sent))

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore a browser that has gone: it is no error."""


class _Handler(BaseHTTPRequestHandler):
    server: LoopbackServer
    timeout: ClassVar[float] = MAX_REQUEST_S

    def do_GET(self) -> None:
        """Answer a request."""
        self._give(self.server.answered(self.path, None))

    def do_POST(self) -> None:
        """Answer a request that brings something."""
        length = self.headers.get("Content-Length", "")
        if not length.isdecimal() or int(length) > MAX_BYTES:
            self.close_connection = True
            self._give(Answer(413, "text/plain", f"at most {MAX_BYTES} bytes\n".encode()))
            return
        self._give(self.server.answered(self.path, self.rfile.read(int(length))))

    def _give(self, answer: Answer) -> None:
        self.send_response(answer.status)
        for name, value in self.server.headers.items():
            self.send_header(name, value)
        charset = "" if answer.kind.startswith("image/") else "; charset=utf-8"
        self.send_header("Content-Type", f"{answer.kind}{charset}")
        self.send_header("Content-Length", str(len(answer.content)))
        self.end_headers()
        self.wfile.write(answer.content)

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing: the terminal is the command's."""
