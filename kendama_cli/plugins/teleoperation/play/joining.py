"""Addresses at which devices join the play over HTTPS: their page, its code to scan, and their samples."""

from __future__ import annotations

import asyncio
import secrets
import socket
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from urllib.parse import urlencode

from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.routing import Route
from starlette.websockets import WebSocketState

from kendama_cli.plugins.teleoperation.play.joined import AGAIN, Join, JoinedLine
from kendama_cli.plugins.teleoperation.play.messages import LONGEST
from kendama_cli.plugins.teleoperation.play.settings import PlaySettings

HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; "
    "connect-src 'self'; form-action 'none'; base-uri 'none'; frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}
WRONG_TOKEN = "this address has expired or is not complete: open the one that 'kendama play' printed last"
LAST_WORDS_S = 5.0
"""So long the reason of an end waits for a device to ask."""


@dataclass(frozen=True)
class Joining:
    """Socket at which devices join, over HTTPS, and the names and addresses of this machine that reach it."""

    join: Join
    listening: socket.socket
    hosts: tuple[str, ...]


class JoinedDevices:
    """Devices that have joined; ``plays`` seats one under a name and returns when it has left."""

    def __init__(
        self,
        joining: Joining,
        token: str,
        settings: PlaySettings,
        plays: Callable[[JoinedLine, str], Awaitable[None]],
    ) -> None:
        self.joining, self._token, self._plays = joining, token, plays
        self._most = 2 * settings.max_players
        self._lines: dict[str, JoinedLine] = {}
        self._tasks = set[asyncio.Task[None]]()

    def routes(self) -> list[Route]:
        """Return the addresses that devices and pages ask."""
        return [
            Route("/join", self._page),
            Route("/join.svg", self._code),
            Route("/joined", self._joined, methods=["POST"]),
        ]

    def address(self, player: str = "") -> str:
        """Return the address of the devices' page."""
        port = self.joining.listening.getsockname()[1]
        return f"https://{self.joining.hosts[0]}:{port}/join?{self._asked(player)}"

    def invitation(self, player: str) -> dict[str, str]:
        """Return the message that shows a page how a device joins under its name."""
        return {"type": "join", "picture": f"/join.svg?{self._asked(player)}", "address": self.address(player)}

    def _asked(self, player: str) -> str:
        return urlencode({"token": self._token, **({"player": player} if player else {})})

    def _refusal(self, request: Request) -> Response | None:
        if secrets.compare_digest(request.query_params.get("token", "").encode(), self._token.encode()):
            return None
        return PlainTextResponse(f"kendama: {WRONG_TOKEN}\n", 403, HEADERS)

    async def _page(self, request: Request) -> Response:
        kind, content = next(iter(self.joining.join.pages().values()))
        return self._refusal(request) or Response(content, 200, HEADERS, kind)

    async def _code(self, request: Request) -> Response:
        if (refusal := self._refusal(request)) is not None:
            return refusal
        _, picture = self.joining.join.code(self.address(request.query_params.get("player", "")))
        return Response(picture, 200, HEADERS, "image/svg+xml")

    async def _joined(self, request: Request) -> Response:
        """Take a device's samples and answer with what it should hear; its first ones seat it."""
        if (refusal := self._refusal(request)) is not None:
            return refusal
        body = b""
        async for part in request.stream():
            body += part
            if len(body) > LONGEST:
                return PlainTextResponse("a message of the device was too long", 413, HEADERS)
        session = request.query_params.get("session", "")[:64]
        line = self._lines.get(session)
        if line is None:
            if len(self._lines) >= self._most:
                return PlainTextResponse("too many devices have joined: wait until one leaves", 429, HEADERS)
            line = self._lines[session] = JoinedLine(self.joining.join.hand())
            task = asyncio.create_task(self._seated(line, session, request.query_params.get("player", "")))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)
        return JSONResponse(await line.take(body.decode(errors="replace")), 200, HEADERS)

    async def _seated(self, line: JoinedLine, session: str, name: str) -> None:
        await self._plays(line, name)
        if line.application_state is WebSocketState.CONNECTED:
            await line.close(AGAIN, "nothing was heard of this device: press Start again")
        await asyncio.sleep(LAST_WORDS_S)
        del self._lines[session]
