"""One player's line: what the page says goes to the table, what happens there goes to the page."""

from __future__ import annotations

import asyncio
import datetime
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from kendama_cli.devices.hand.play import shown
from kendama_cli.devices.hand.play.conditions import Conditions
from kendama_cli.devices.hand.play.messages import About, Ease, Hand, parse
from kendama_cli.devices.hand.play.settings import PlaySettings
from kendama_cli.devices.hand.play.table import PlayTable
from kendama_cli.devices.hand.play.tries import TryFolder
from kendama_cli.errors import SimulationError, UsageError
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings

BYE = 4000
"""The code with which a line is closed whose reason the page shows."""
_WRITING = threading.Lock()
"""Numbers of tries are taken one after the other, whoever plays."""


class Player:
    """Plays over ``line`` until it closes; a try that goes on then is kept as it is."""

    def __init__(
        self,
        line: WebSocket,
        name: str,
        game: GameSettings,
        settings: PlaySettings,
        folder: Path,
        *,
        clock: Callable[[], float],
        today: Callable[[], datetime.datetime],
        tell: Callable[[str], None],
    ) -> None:
        """Raises UsageError for a name without a letter or digit."""
        self._line, self._game, self._settings = line, game, settings
        self._clock, self._today, self._tell = clock, today, tell
        self._folder = TryFolder(folder, name, settings.most_tries)
        self.name = self._folder.player
        self._device, self._unsaid = "", list[dict[str, Any]]()
        self._unwritten = list[tuple[str, Conditions, Array]]()
        self._table = PlayTable(game, settings, self._keep)

    async def play(self) -> None:
        """Answer every message; returns when the page has gone, raises UsageError for a message that is none."""
        await self._line.send_json(shown.table(self.name, self._folder.path, self._table, self._game, self._settings))
        await self._line.send_json(shown.tries(self._folder))
        while True:
            try:
                message = await self._line.receive()
            except WebSocketDisconnect:
                return
            if message["type"] == "websocket.disconnect":
                if message.get("code") == 1009:
                    raise UsageError("a message of the page was too long")
                return
            said = parse(message.get("text") or message.get("bytes") or b"")
            answer = self._answer(said)
            if self._unwritten:  # the others play on while a disk is slow
                await asyncio.to_thread(self._write)
            try:
                for one in (*answer, *self._unsaid):
                    await self._line.send_json(one)
            except (WebSocketDisconnect, RuntimeError):  # it closed while we answered
                return
            self._unsaid.clear()

    async def replaced(self) -> None:
        """Another window plays under this name."""
        self.leave()
        if self._line.application_state is WebSocketState.CONNECTED:
            await self._line.close(BYE, f"'{self.name}' plays in another window now")

    def leave(self) -> None:
        """The hand has gone; what was recorded is kept. Idempotent."""
        self._table.stop()
        self._write()

    def _answer(self, said: Hand | Ease | About) -> list[dict[str, Any]]:
        if isinstance(said, Hand):
            try:
                self._table.hand(said.samples, held=said.held, now_s=self._clock(), guessed=said.guessed)
            except (SimulationError, UsageError) as error:
                self._table.change(self._table.conditions)
                return [{"type": "error", "line": str(error)}]
            return [shown.state(self._table, said.samples[-1].t_s)]
        if isinstance(said, Ease):
            self._table.change(said.conditions)
            return [shown.table(self.name, self._folder.path, self._table, self._game, self._settings)]
        try:
            return self._about_try(said)
        except UsageError as error:
            return [{"type": "error", "line": str(error)}, shown.tries(self._folder)]

    def _about_try(self, said: About) -> list[dict[str, Any]]:
        folder = self._folder
        if said.action == "show":
            return [shown.replay(said.name, folder.samples(said.name), self._game)]
        if said.action == "rename":
            folder.rename(said.name, said.value)
        elif said.action == "choose":
            folder.choose(said.name, chosen=said.value == "yes")
        else:
            folder.delete(said.name)
        return [shown.tries(self._folder)]

    def _keep(self, outcome: str, conditions: Conditions, samples: Array) -> None:
        self._unwritten.append((outcome, conditions, samples))

    def _write(self) -> None:
        """Write what is to be kept."""
        unwritten, self._unwritten = self._unwritten, []
        with _WRITING:
            for outcome, conditions, samples in unwritten:
                try:
                    made = self._folder.keep(outcome, conditions.words(), samples, self._today())
                except (UsageError, OSError) as error:
                    self._tell(f"{self.name}: {error}")
                    self._unsaid.append({"type": "error", "line": str(error)})
                    continue
                if outcome == "caught":
                    self._tell(f"{self.name} caught it: {made.name}")
                self._unsaid.append(shown.tries(self._folder))
