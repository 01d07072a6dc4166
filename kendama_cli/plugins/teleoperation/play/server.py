"""The web server of the play: one page, one line to every player, all in one process on one thread."""

from __future__ import annotations

import asyncio
import datetime
import gc
import secrets
import socket
import tempfile
import time
from collections.abc import Callable, Sequence
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
from kendama_cli.plugins.teleoperation.play.joined import (
    AGAIN,
    HEADERS,
    WRONG_TOKEN,
    JoinedDevices,
    JoinedLine,
    Joining,
)
from kendama_cli.plugins.teleoperation.play.messages import LONGEST
from kendama_cli.plugins.teleoperation.play.player import BYE, Player
from kendama_cli.plugins.teleoperation.play.settings import PlaySettings
from kendama_cli.plugins.teleoperation.play.tries import TryFolder, check_folder, plain_name
from kendama_cli.settings.game import GameSettings

PAGE = {"play.css": "text/css", "play.js": "text/javascript", "icon.svg": "image/svg+xml"}


@dataclass(frozen=True)
class Opened:
    """Open server: ``address`` is the page's, with the token.

    ``joining`` is the address of the page for devices, ``code`` draws it, ``fingerprint`` is that of its certificate;
    all are empty where none can join.
    """

    address: str
    port: int
    joining: str = ""
    code: str = ""
    fingerprint: str = ""


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
        joining: Joining | None = None,
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
        self._devices = None if joining is None else JoinedDevices(joining, self._token, settings, self._plays)
        self._assets = {name: (kind, _read(name)) for name, kind in PAGE.items()}
        self._assets |= {} if joining is None else joining.join.pages()

    def serve(self, listening: socket.socket, host: str, ready: Callable[[Opened], None]) -> None:
        """Serve on ``listening`` until SIGINT or SIGTERM, which is raised again when all tries are kept."""
        bound = int(listening.getsockname()[1])
        address = f"http://{f'[{host}]' if ':' in host else host}:{bound}/?token={self._token}"
        try:
            with tempfile.TemporaryDirectory(prefix="kendama-play-") as folder:
                servers, opened = [(self._server(), listening)], Opened(address, bound)
                if self._devices is not None:
                    joining = self._devices.joining
                    certificate, key, fingerprint = joining.join.certificate(Path(folder), joining.hosts)
                    servers.append((self._server(certificate, key), joining.listening))
                    joined_at = self._devices.address()
                    opened = Opened(address, bound, joined_at, joining.join.code(joined_at)[0], fingerprint)
                gc.collect()
                gc.freeze()  # a full collection would look at all that is imported, and stop every player for 0.2 s
                ready(opened)
                asyncio.run(_serve(servers))
        finally:
            listening.close()
            if self._devices is not None:
                self._devices.joining.listening.close()
            for player in self._players.values():
                player.end()

    def _server(self, certificate: Path | None = None, key: Path | None = None) -> uvicorn.Server:
        routes = [
            Route("/", self._page),
            Route("/assets/{name}", self._asset),
            WebSocketRoute("/line", self._line),
            *([] if self._devices is None else self._devices.routes()),
        ]
        config = uvicorn.Config(
            Starlette(routes=routes),
            log_level="critical",
            access_log=False,
            ws_max_size=LONGEST,
            ws_per_message_deflate=False,
            timeout_graceful_shutdown=2,
            lifespan="off",
            ssl_certfile=certificate,
            ssl_keyfile=key,
        )
        config.load()  # reads the key
        return uvicorn.Server(config)

    async def _page(self, request: Request) -> Response:
        if not self._knows(request.query_params.get("token", "")):
            return PlainTextResponse(f"kendama: {WRONG_TOKEN}\n", 403, HEADERS)
        return Response(_read("index.html"), 200, HEADERS, "text/html")

    async def _asset(self, request: Request) -> Response:
        kind, content = self._assets.get(request.path_params["name"], ("", b""))
        return Response(content, 200, HEADERS, kind) if kind else PlainTextResponse("not found\n", 404, HEADERS)

    async def _line(self, line: WebSocket) -> None:
        await line.accept()
        if not self._knows(line.query_params.get("token", "")):
            await line.close(BYE, WRONG_TOKEN)
            return
        name = line.query_params.get("player", "")
        try:
            device = self._device(name)
            if self._devices is not None:
                await line.send_json({**self._devices.invitation(name), "watching": device is not None})
            if device is not None:
                await device.watch(line)
                return
        except UsageError as error:
            await line.close(BYE, _reason(error))
            return
        await self._plays(line, name)

    def _device(self, name: str) -> JoinedLine | None:
        """Return the line of the device that plays under a name; raises UsageError for a name that is none."""
        player = self._players.get(plain_name(name))
        return player.line if player is not None and isinstance(player.line, JoinedLine) else None

    async def _plays(self, line: WebSocket | JoinedLine, name: str) -> None:
        try:
            player = self._seat(line, name)
        except UsageError as error:
            await line.close(BYE, _reason(error))
            return
        old = self._players.get(player.name)
        self._players[player.name] = player
        if old is not None:
            await old.replaced(AGAIN if isinstance(line, JoinedLine) else BYE)
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

    def _seat(self, line: WebSocket | JoinedLine, name: str) -> Player:
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


async def _serve(servers: Sequence[tuple[uvicorn.Server, socket.socket]]) -> None:
    """Serve all until a signal, which ends the last one first; uvicorn raises it again for the one before."""
    tasks = []
    for server, listening in servers:
        tasks.append(asyncio.create_task(server.serve([listening])))
        await asyncio.sleep(0)  # each takes the signals from the one before
    await asyncio.gather(*tasks)


def _read(name: str) -> bytes:
    return (resources.files(__package__) / "page" / name).read_bytes()


def _reason(error: UsageError) -> str:
    """Cut the error's text to fit a close frame, which holds 123 bytes."""
    return str(error).encode()[:120].decode(errors="ignore")
