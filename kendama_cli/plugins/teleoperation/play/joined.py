"""Devices that join the play by a page of their own: their sensors carry the cup, pages of the same name watch.

A part brings them as ``kendama.joins``; the entry point names a class without arguments that has the form of ``Join``.
"""

from __future__ import annotations

import asyncio
import json
import secrets
import socket
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol
from urllib.parse import urlencode

import numpy as np
from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.routing import Route
from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from kendama_cli.errors import UsageError
from kendama_cli.motion.sampling import columns_at
from kendama_cli.plugins.shared.web import loopback
from kendama_cli.plugins.teleoperation.play.conditions import Conditions
from kendama_cli.plugins.teleoperation.play.messages import LONGEST, Hand, parse
from kendama_cli.plugins.teleoperation.play.settings import PlaySettings
from kendama_cli.plugins.teleoperation.play.table import LOOK_EVERY
from kendama_cli.plugins.teleoperation.play.try_record import TryRecord
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.dart.hand_world import HandWorld
from kendama_cli.simulation.dart.world import STEP_S

JOINS = "kendama.joins"
AGAIN = 4001
"""The code with which a line is closed whose page should open another one at once."""
GONE_S = 8.0
"""A device that says nothing for so long has left."""
MOST_WAITING = 200
HEADERS = {**loopback.HEADERS, "Content-Security-Policy": loopback.OWN_FILES}
WRONG_TOKEN = "this address has expired or is not complete: open the one that 'kendama play' printed last"
LAST_WORDS_S = 5.0
"""Time for which the reason of an end waits for a device to ask."""


class SensedHand(Protocol):
    """Hand of a device whose sensors carry the cup."""

    settled: bool
    """False while a motion is under way, whose path is known at its end only"""
    hint: str
    """the line that the device should show now"""

    def take(self, text: str) -> Mapping[str, Any] | None:
        """Return the page's message ``hand`` after the device's ``text``, None for none; raises UsageError."""

    def path(self) -> tuple[Array, Array, Sequence[str]]:
        """Return the last motion: times (n,), places (n, 4) and doubts about them; raises InputError."""


class Join(Protocol):
    """Kind of devices that join."""

    def pages(self) -> Mapping[str, tuple[str, bytes]]:
        """Return media type and content by name; the page is the first."""

    def hand(self) -> SensedHand:
        """Return the hand of a device that joins."""

    def certificate(self, folder: Path, hosts: Sequence[str]) -> tuple[Path, Path, str]:
        """Write certificate and key for ``hosts`` to ``folder``; return their files and a fingerprint."""

    def code(self, address: str) -> tuple[str, bytes]:
        """Return a code that devices read, as lines for a terminal and as an SVG picture."""


class JoinedLine:
    """Line of a device to its player, who hears a page's messages on it; pages of the same name watch and have a say.

    The device asks again and again; what it should hear waits in between.
    """

    def __init__(self, hand: SensedHand) -> None:
        self.hand, self.application_state = hand, WebSocketState.CONNECTED
        self._said: asyncio.Queue[Mapping[str, Any]] = asyncio.Queue(MOST_WAITING)
        self._answers = list[Mapping[str, Any]]()
        self._watching, self._last = set[WebSocket](), dict[str, Mapping[str, Any]]()
        self._hint, self._outcome = "", None

    async def take(self, text: str) -> list[Mapping[str, Any]]:
        """Take a device's message and return what it should hear."""
        if self.application_state is WebSocketState.CONNECTED:
            try:
                message = self.hand.take(text)
            except UsageError as error:
                await self.close(AGAIN, str(error))
            else:
                await self._said.put({"type": "websocket.receive", "text": json.dumps(message)} if message else {})
                if self.hand.hint != self._hint:
                    self._hint = self.hand.hint
                    self._answers.append({"type": "hint", "line": self._hint})
                    await self._show({"type": "hint", "line": self._hint})
        answers, self._answers = self._answers, []
        return answers

    async def receive(self) -> Mapping[str, Any]:
        """Return the next message, of the device or of a page that watches."""
        while self.application_state is WebSocketState.CONNECTED:
            try:
                message = await asyncio.wait_for(self._said.get(), GONE_S)
            except TimeoutError:
                break
            if message:
                return message
        return {"type": "websocket.disconnect"}

    async def send_json(self, message: Mapping[str, Any]) -> None:
        """Send a message to the pages that watch, and what concerns it to the device."""
        if message["type"] == "state":
            if message["outcome"] != self._outcome and message["outcome"]:
                self._answers.append({**message, "type": "outcome"})
            self._outcome = message["outcome"]
        elif message["type"] == "error":
            self._answers.append(message)
        await self._show(message)

    async def _show(self, message: Mapping[str, Any]) -> None:
        self._last[message["type"]] = message
        for page in tuple(self._watching):
            try:
                await page.send_json(message)
            except (WebSocketDisconnect, RuntimeError):
                self._watching.discard(page)

    async def watch(self, page: WebSocket) -> None:
        """Show a page what happens until it goes or the device does; raises UsageError for a message that is none."""
        for kind in ("table", "tries", "hint", "state"):
            if kind in self._last:
                await page.send_json(self._last[kind])
        self._watching.add(page)
        try:
            while True:
                message = await page.receive()
                if message["type"] == "websocket.disconnect":
                    return
                said = message.get("text") or message.get("bytes") or b""
                if not isinstance(parse(said), Hand):
                    await self._said.put(message)
        finally:
            self._watching.discard(page)

    async def close(self, code: int, reason: str) -> None:
        """End: the device hears why, and pages that watched are on their own again."""
        self.application_state = WebSocketState.DISCONNECTED
        self._answers.append({"type": "ended", "code": code, "line": reason})
        for page in tuple(self._watching):
            try:
                await page.close(AGAIN, "the device has left")
            except (WebSocketDisconnect, RuntimeError):
                continue


def carried(game: GameSettings, conditions: Conditions, caught_s: float, t_s: Array, places: Array) -> Array | None:
    """Return what is kept of a cup carried along ``places`` (n, 4) at ``t_s`` (n,); None if it is hardly a swing."""
    world, record = HandWorld(conditions.game(game)), TryRecord(caught_s)
    instants = np.arange(int((t_s[-1] - t_s[0]) / STEP_S) + 1) * STEP_S
    for k, place in enumerate(columns_at(instants + t_s[0], t_s, places), start=1):
        world.step(place)
        if k % LOOK_EVERY == 0 and not record.caught:
            record.look(world)
    return record.samples(conditions)


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
