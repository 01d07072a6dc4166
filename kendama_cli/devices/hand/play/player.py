"""One player's line: what the page says goes to the table, what happens there goes to the page."""

from __future__ import annotations

import datetime
import platform
from collections.abc import Callable
from pathlib import Path
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

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
SLOW = 0.25
SHOW_EVERY = 2
"""Of the samples kept, every second is shown again: 125 Hz."""


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
        self._table = PlayTable(game, settings, self._keep)

    async def play(self) -> None:
        """Answer every message; returns when the page has gone, raises UsageError for a message that is none."""
        await self._line.send_json(self._about_table())
        await self._line.send_json(self._tries())
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

    def _answer(self, said: Hand | Ease | About) -> list[dict[str, Any]]:
        if isinstance(said, Hand):
            try:
                self._table.hand(said.samples, held=said.held, now_s=self._clock())
            except (SimulationError, UsageError) as error:
                self._table.change(self._table.conditions)
                return [{"type": "error", "line": str(error)}]
            return [self._state(said)]
        if isinstance(said, Ease):
            self._table.change(said.conditions)
            return [self._about_table()]
        try:
            return self._about_try(said)
        except UsageError as error:
            return [{"type": "error", "line": str(error)}, self._tries()]

    def _about_try(self, said: About) -> list[dict[str, Any]]:
        folder = self._folder
        if said.action == "show":
            return [self._replay(said.name, folder.samples(said.name))]
        if said.action == "rename":
            folder.rename(said.name, said.value)
        elif said.action == "choose":
            folder.choose(said.name, chosen=said.value == "yes")
        else:
            folder.delete(said.name)
        return [self._tries()]

    def _keep(self, outcome: str, conditions: Conditions, samples: Array) -> None:
        try:
            made = self._folder.keep(outcome, conditions.words(), samples, self._today())
        except (UsageError, OSError) as error:
            self._tell(f"{self.name}: {error}")
            self._unsaid.append({"type": "error", "line": str(error)})
            return
        if outcome == "caught":
            self._tell(f"{self.name} caught it: {made.name}")
        self._unsaid.append(self._tries())

    def _state(self, said: Hand) -> dict[str, Any]:
        table = self._table
        x, _, z, tilt = table.world.place.tolist()
        ball = table.world.ball
        return {
            "type": "state",
            "t": round(1000 * said.samples[-1].t_s, 3),
            "cup": [round(x, 5), round(z, 5), round(tilt, 4)],
            "ball": [round(float(ball.position_m[0]), 5), round(float(ball.position_m[2]), 5)],
            "pull": round(ball.tension_n, 3),
            "phase": table.phase,
            "outcome": table.outcome,
            "steps": table.steps,
        }

    def _about_table(self) -> dict[str, Any]:
        ease, own = self._settings.ease, self._table.conditions
        return {
            "type": "table",
            "player": self.name,
            "folder": str(self._folder.path),
            "machine": f"the computer '{platform.node()}'",
            "ease": {
                "gravity": [ease.least_gravity_share, 1.0],
                "rope": list(ease.rope_scale),
                "cup": [1.0, ease.most_cup_scale],
            },
            "conditions": {"gravity": own.gravity_share, "rope": own.rope_scale, "cup": own.cup_scale},
            "game": _shapes(self._table.world.game),
            "robot": {"rope": self._game.rope.length_m, "cup": self._game.cup.radius_m},
            "delay_ms": 1000 * self._settings.smoothing_s,
        }

    def _tries(self) -> dict[str, Any]:
        kept = [
            {
                "name": one.name,
                "outcome": one.outcome,
                "chosen": one.chosen,
                "duration_s": one.duration_s,
                "conditions": one.conditions,
                "ease": one.conditions.partition(";")[0],
            }
            for one in self._folder.tries()
        ]
        return {"type": "tries", "tries": kept}

    def _replay(self, name: str, samples: Array) -> dict[str, Any]:
        shown = samples[::SHOW_EVERY]
        tilt = 2 * shown[:, 6]  # a small half angle's sine
        frames = [
            [round(value, 4) for value in row]
            for row in zip(*(shown[:, 1], shown[:, 3], tilt, shown[:, 8], shown[:, 10]), strict=True)
        ]
        return {
            "type": "replay",
            "name": name,
            "speed": SLOW,
            "times": shown[:, 0].tolist(),
            "frames": frames,
            "game": _shapes(self._game),
        }


def _shapes(game: GameSettings) -> dict[str, Any]:
    cup = game.cup
    return {
        "rope": game.rope.length_m,
        "ball": game.ball.radius_m,
        "cup": {"radius": cup.radius_m, "depth": cup.depth_m, "wall": cup.wall_m},
    }
