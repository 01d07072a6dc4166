"""One player's line: what the page says goes to the table, what happens there goes to the page."""

from __future__ import annotations

import asyncio
import dataclasses
import datetime
import threading
from collections.abc import Callable
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from kendama_cli.errors import InputError, SimulationError, UsageError
from kendama_cli.plugins.teleoperation.play import shown
from kendama_cli.plugins.teleoperation.play.conditions import Conditions
from kendama_cli.plugins.teleoperation.play.joined import JoinedLine, carried
from kendama_cli.plugins.teleoperation.play.messages import About, Ease, Hand, parse
from kendama_cli.plugins.teleoperation.play.settings import PlaySettings
from kendama_cli.plugins.teleoperation.play.table import PlayTable
from kendama_cli.plugins.teleoperation.play.tries import Try, TryFolder
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings

BYE = 4000
"""The code with which a line is closed whose reason the page shows."""
LONG_S = 0.005
"""A message that took longer to answer is followed by a rest as long: the others' turn, and Ctrl-C's."""
_WRITING = threading.Lock()
"""Numbers of tries are taken one after the other, whoever plays."""


class Player:
    """Plays over ``line`` until it closes; a try that goes on then is kept as it is."""

    def __init__(
        self,
        line: WebSocket | JoinedLine,
        game: GameSettings,
        settings: PlaySettings,
        folder: TryFolder,
        *,
        clock: Callable[[], float],
        today: Callable[[], datetime.datetime],
        tell: Callable[[str], None],
    ) -> None:
        self.line, self._game, self._settings = line, game, settings
        self._clock, self._today, self._tell = clock, today, tell
        self._folder, self.name = folder, folder.player
        self._unsaid = list[dict[str, Any]]()
        self._unwritten = list[tuple[Try, Array, Conditions]]()
        self._sensed = line.hand if isinstance(line, JoinedLine) else None
        self._table = PlayTable(game, settings, self._keep)

    async def play(self) -> None:
        """Answer every message; returns when the page has gone, raises UsageError for a message that is none."""
        await self.line.send_json(shown.table(self.name, self._folder.path, self._table, self._game, self._settings))
        try:
            await asyncio.to_thread(self._folder.check)
        except UsageError as error:  # before the first swing; what is swung all the same is not kept
            await self.line.send_json({"type": "error", "line": str(error), "stays": True})
        await self.line.send_json(shown.tries(self._folder))
        while True:
            try:
                message = await self.line.receive()
            except WebSocketDisconnect:
                return
            if message["type"] == "websocket.disconnect":
                if message.get("code") == 1009:
                    raise UsageError("a message of the page was too long")
                return
            said = parse(message.get("text") or message.get("bytes") or b"")
            began_s = self._clock()
            answer = await asyncio.to_thread(self._about, said) if isinstance(said, About) else self._answer(said)
            # the others play on while a disk is slow; what sensors felt is known once they rest
            if self._unwritten and (self._sensed is None or self._sensed.settled):
                await asyncio.to_thread(self._write)
            took_s = self._clock() - began_s
            try:
                for one in (*answer, *self._unsaid):
                    await self.line.send_json(one)
            except (WebSocketDisconnect, RuntimeError):  # it closed while we answered
                return
            self._unsaid.clear()
            await asyncio.sleep(took_s if took_s > LONG_S else 0)

    async def replaced(self, code: int) -> None:
        """End, for another window or device plays under this name."""
        reason = f"'{self.name}' plays in another window now"
        await self.leave(reason)
        if self.line.application_state is WebSocketState.CONNECTED:
            await self.line.close(code, reason)

    async def leave(self, reason: str) -> None:
        """End the try of a hand that has gone; what was recorded is kept. Idempotent."""
        self._table.stop(reason)
        await asyncio.to_thread(self._write)

    def end(self) -> None:
        """End with the server; what was recorded is kept. Idempotent."""
        self._table.stop("the game was ended")
        self._write()

    def _answer(self, said: Hand | Ease) -> list[dict[str, Any]]:
        if isinstance(said, Hand):
            try:
                self._table.hand(said.samples, held=said.held, now_s=self._clock(), guessed=said.guessed)
            except (SimulationError, UsageError) as error:
                self._table.change(self._table.conditions, str(error))
                return [{"type": "error", "line": str(error)}]
            return [shown.state(self._table, said.samples[-1].t_s)]
        self._table.change(said.conditions)
        return [shown.table(self.name, self._folder.path, self._table, self._game, self._settings)]

    def _about(self, said: About) -> list[dict[str, Any]]:
        folder = self._folder
        try:
            with _WRITING:
                if said.action == "show":
                    return [shown.replay(said.name, folder.samples(said.name), self._game)]
                if said.action == "rename":
                    folder.rename(said.name, said.value)
                elif said.action == "choose":
                    folder.choose(said.name, chosen=said.value == "yes")
                else:
                    folder.delete(said.name)
                return [shown.tries(folder)]
        except (UsageError, OSError) as error:
            return [{"type": "error", "line": str(error)}, shown.tries(folder)]

    def _keep(self, outcome: str, conditions: Conditions, samples: Array, reason: str) -> None:
        began, duration_s = self._today().isoformat(timespec="milliseconds"), round(float(samples[-1, 0]), 3)
        made = Try("", outcome, False, began, duration_s, conditions.words(), reason)
        self._unwritten.append((made, samples, conditions))

    def _got_back(self, seen: Try, conditions: Conditions) -> tuple[Try, Array]:
        """Return a try with the path that the sensors went, its end's rest known; raises UsageError without one."""
        assert self._sensed is not None
        try:
            t_s, places, doubts = self._sensed.path()
            samples = carried(self._game, conditions, self._settings.caught_s, t_s, places)
        except (InputError, SimulationError) as error:
            raise UsageError(f"a try ({seen.outcome}) was not kept: {error}") from None
        if samples is None:
            raise UsageError(f"a try ({seen.outcome}) was not kept: its path is hardly a swing")
        for doubt in doubts:
            self._tell(f"{self.name}: {doubt}")
        return dataclasses.replace(seen, duration_s=round(float(samples[-1, 0]), 3)), samples

    def _write(self) -> None:
        """Write what is to be kept; what cannot be written is told the page."""
        unwritten, self._unwritten = self._unwritten, []
        with _WRITING:
            for new, samples, conditions in unwritten:
                if self._sensed is not None:
                    try:
                        new, samples = self._got_back(new, conditions)  # noqa: PLW2901
                    except UsageError as error:
                        self._tell(f"{self.name}: {error}")
                        self._unsaid.append({"type": "error", "line": str(error)})
                        continue
                try:
                    made = self._folder.keep(new, samples)
                except (UsageError, OSError) as error:
                    self._tell(f"{self.name}: {error}")
                    problem = getattr(error, "strerror", None) or str(error)
                    line = f"this try ({new.outcome}) could not be kept: {problem}"
                    self._unsaid.append({"type": "error", "line": line, "stays": True})
                    continue
                if made.outcome == "caught":
                    self._tell(f"{self.name} caught it: {made.name}{made.note and '; '}{made.note}")
                self._unsaid.append(shown.tries(self._folder))
