"""The web server of the play: one page, one line to every player, all in one process on one thread."""

from __future__ import annotations

import datetime
import gc
import secrets
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket

from kendama_cli.errors import UsageError
from kendama_cli.plugins.teleoperation.play.messages import LONGEST
from kendama_cli.plugins.teleoperation.play.player import BYE, Player
from kendama_cli.plugins.teleoperation.play.settings import PlaySettings
from kendama_cli.plugins.teleoperation.play.tries import TryFolder, check_folder
from kendama_cli.settings.game import GameSettings

PAGE = {"play.css": "text/css", "play.js": "text/javascript", "icon.svg": "image/svg+xml"}
HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; "
    "connect-src 'self'; form-action 'none'; base-uri 'none'; frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}
WRONG_TOKEN = "this address has expired or is not complete: open the one that 'kendama play' printed last"


@dataclass(frozen=True)
class Opened:
    """Open server: ``address`` is the page's, with the token."""

    address: str
    port: int


class PlayServer:
    """Server of the page for who knows the token; a name plays in one window at a time."""

    def __init__(
        self,
        game: GameSettings,
        settings: PlaySettings,
        folder: Path,
        *,
        doubt: Callable[[Path], str | None],
        tell: Callable[[str], None],
    ) -> None:
        """Raise UsageError if tries cannot be stored in ``folder``.

        ``doubt`` says why ``capture=play`` would not take a file, ``tell`` takes lines for whoever started the server:
        who comes, catches and leaves, and what went wrong.
        """
        check_folder(folder)
        self._game, self._settings, self._folder = game, settings, folder
        self._doubt, self._tell = doubt, tell
        self._token = secrets.token_urlsafe(16)
        self._players: dict[str, Player] = {}

    def serve(self, listening: socket.socket, host: str, ready: Callable[[Opened], None]) -> None:
        """Serve on ``listening`` until SIGINT or SIGTERM, which is raised again when all tries are kept."""
        bound = int(listening.getsockname()[1])
        shown = f"[{host}]" if ":" in host else host
        routes = [
            Route("/", self._page),
            Route("/assets/{name}", self._asset),
            WebSocketRoute("/line", self._line),
        ]
        config = uvicorn.Config(
            Starlette(routes=routes),
            log_level="critical",
            access_log=False,
            ws_max_size=LONGEST,
            ws_per_message_deflate=False,
            timeout_graceful_shutdown=2,
            lifespan="off",
        )
        gc.collect()
        gc.freeze()  # a full collection would look at all that is imported, and stop every player for 0.2 s
        ready(Opened(f"http://{shown}:{bound}/?token={self._token}", bound))
        try:
            uvicorn.Server(config).run(sockets=[listening])
        finally:
            listening.close()
            for player in self._players.values():
                player.end()

    async def _page(self, request: Request) -> Response:
        if not self._knows(request.query_params.get("token", "")):
            return PlainTextResponse(f"kendama: {WRONG_TOKEN}\n", 403, HEADERS)
        return Response(_read("index.html"), 200, HEADERS, "text/html")

    async def _asset(self, request: Request) -> Response:
        name = request.path_params["name"]
        if name not in PAGE:
            return PlainTextResponse("not found\n", 404, HEADERS)
        return Response(_read(name), 200, HEADERS, PAGE[name])

    async def _line(self, line: WebSocket) -> None:
        await line.accept()
        if not self._knows(line.query_params.get("token", "")):
            await line.close(BYE, WRONG_TOKEN)
            return
        try:
            player = self._seat(line)
        except UsageError as error:
            await line.close(BYE, _reason(error))
            return
        old = self._players.get(player.name)
        self._players[player.name] = player
        if old is not None:
            await old.replaced()
        self._tell(f"{player.name} plays")
        reason = "the page was closed, or its line was lost"
        try:
            await player.play()
        except UsageError as error:
            reason = str(error)
            self._tell(f"{player.name}: {error}")
            await line.close(BYE, _reason(error))
        finally:
            await player.leave(reason)
            if self._players.get(player.name) is player:
                del self._players[player.name]
                self._tell(f"{player.name} has left")

    def _seat(self, line: WebSocket) -> Player:
        name = line.query_params.get("player", "")
        player = Player(
            line,
            self._game,
            self._settings,
            TryFolder(self._folder, name, self._settings.max_attempts, self._doubt),
            clock=time.monotonic,
            today=lambda: datetime.datetime.now().astimezone(),
            tell=self._tell,
        )
        if player.name not in self._players and len(self._players) >= self._settings.max_players:
            raise UsageError(
                f"{len(self._players)} play already, as many as this machine simulates in time "
                "(play.max_players): wait until one leaves"
            )
        return player

    def _knows(self, token: str) -> bool:
        return secrets.compare_digest(token.encode(), self._token.encode())


def _read(name: str) -> bytes:
    return (resources.files(__package__) / "page" / name).read_bytes()


def _reason(error: UsageError) -> str:
    """Cut the error's text to fit a close frame, which holds 123 bytes."""
    return str(error).encode()[:120].decode(errors="ignore")
