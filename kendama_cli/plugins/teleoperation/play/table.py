"""One player's table: the hand's samples move the cup, the ball follows, and tries begin and end."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, NoReturn

import numpy as np

from kendama_cli.errors import UsageError
from kendama_cli.plugins.teleoperation.play.conditions import Conditions
from kendama_cli.plugins.teleoperation.play.hand_path import HandPath, PathState
from kendama_cli.plugins.teleoperation.play.settings import PlaySettings
from kendama_cli.plugins.teleoperation.play.try_record import RecordMoment, TryRecord
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.dart.hand_world import PLACE, HandState, HandWorld

Phase = Literal["ready", "playing", "settling", "over"]
LOOK_EVERY = 4
"""Steps between two looks at the ball, and between two samples of what is kept: 250 Hz."""
AHEAD_S = 2.0
"""So much of the hand's time may come at once, as it does after a stutter of browser or network."""
WORK_RATIO = 3.0
"""Times a millisecond is simulated, on average, at most: guessed, taken back, and as it was."""
SETTLING_S = 1.2
"""After the hand has let go the ball has this long to come to lie in the cup, and then the table is ready again."""
SILENCE_S, PERIOD_S = 0.06, 0.02
"""After so long a silence a hand stood still until at most a period of the slowest device before it moves again."""
MOST_MOMENTS = 20
"""Guessed messages, one for each frame of the screen, that can be taken back: a third of a second."""
BELOW_S = 0.3
"""A ball that hangs under the cup so long after the hand has let go will not be caught."""

Keep = Callable[[str, Conditions, Array, str], None]
"""Called with outcome, conditions and samples of every try that is worth keeping, and why it was interrupted, or ""."""


@dataclass(frozen=True)
class HandSample:
    """Position of the hand at ``t_s`` of its own clock, relative to the cup's grip: lateral, up [m], tilt [rad]."""

    t_s: float
    aside_m: float
    up_m: float
    tilt_rad: float


@dataclass(frozen=True)
class _Moment:
    """The table at one moment of a try."""

    world: HandState
    path: PathState
    record: RecordMoment
    steps: int


class Allowance:
    """Seconds that a player may spend: ``ratio`` for each of the clock, and those of AHEAD_S at once."""

    def __init__(self, ratio: float) -> None:
        self._ratio, self._spent_to_s = ratio, -math.inf

    def lacking_s(self, amount_s: float, now_s: float) -> float:
        """Return how many seconds of the clock are missing for ``amount_s``; at most 0 where it may be spent."""
        self._spent_to_s = max(self._spent_to_s, now_s - AHEAD_S)
        return self._spent_to_s + amount_s / self._ratio - now_s

    def spend(self, amount_s: float) -> None:
        """Spend ``amount_s``."""
        self._spent_to_s += amount_s / self._ratio


class PlayTable:
    """Simulation that the hand's samples ask for, in steps of STEP_S of the hand's own time.

    ``phase`` is ready (the ball hangs, nothing moves), playing (the hand holds the cup), settling (it has let go, the
    ball may still come to lie in the cup) or over (the try has ended, the world goes on until the hand lets go or takes
    the cup anew). ``steps`` counts all steps that were simulated, ``outcome`` is the last try's, ``reason`` says why it
    was interrupted.
    """

    def __init__(self, game: GameSettings, settings: PlaySettings, keep: Keep) -> None:
        self._game, self._settings, self._keep = game, settings, keep
        self.steps = 0
        self.outcome: str | None = None
        self.reason = ""
        self.phase: Phase = "ready"
        self._held, self._time, self._work = False, Allowance(1.0), Allowance(WORK_RATIO)
        self.change(Conditions())

    def change(self, conditions: Conditions, reason: str = "the game was made easier or harder") -> None:
        """Play under other conditions from now on; a try that goes on ends for this reason."""
        self.stop(reason)
        self.conditions = conditions.within(self._settings.ease)
        self.world = HandWorld(self.conditions.game(self._game))

    def hand(self, samples: Sequence[HandSample], *, held: bool, now_s: float, guessed: bool = False) -> None:
        """Move the cup as the samples say, whose times do not fall; ``now_s`` is the clock of this machine.

        A hand that says nothing stands still or its samples are on their way: ``guessed`` samples say that it stands
        where it was, the ball moves on, and real ones that come later and are older take the table back first. Raises
        UsageError where the hand's time runs ahead of the clock, or too much is to be simulated again.
        """
        if self.phase != "ready":
            silent_s = self._silence_s(samples)
            if silent_s > self._settings.pause_s or (held and not self._held):
                self.stop(f"nothing was heard of the hand for {silent_s:.2f} s")
        self._held = held
        if self.phase == "ready":
            if not held:
                return
            self._begin(samples[0])
        if self.phase == "playing" and not held:
            self.phase, self._let_go_s = "settling", self.world.t_s
        until_s = max(one.t_s for one in samples) - self._first.t_s
        new_s = max(until_s - self._reached_s, 0.0)
        if (ahead_s := self._time.lacking_s(new_s, now_s)) > 0:
            self._refuse(f"the hand's time runs {ahead_s:.1f} s ahead of the clock")
        if guessed and self._work.lacking_s(until_s - self._path.t_s, now_s) > 0:
            return
        if self.phase == "playing" and not guessed:
            self._go_back(samples[0].t_s - self._first.t_s)
            self._heard_s = until_s
        elif self.phase == "playing" and not self._moments:
            self._moments.append(self._moment())
        work_s = max(until_s - self._path.t_s, 0.0)
        if self._work.lacking_s(work_s, now_s) > 0:
            self._refuse("the page asks for more than can be simulated")
        self._time.spend(new_s)
        self._work.spend(work_s)
        self._reached_s += new_s
        self._move(samples)
        if guessed and self.phase == "playing":
            self._moments.append(self._moment())

    def stop(self, reason: str) -> None:
        """Stop when the hand has gone: what was recorded of a try is kept, and the ball hangs still again."""
        if self.phase in ("playing", "settling"):
            interrupted = self.phase == "playing"
            self._end("interrupted" if interrupted else "missed", reason if interrupted else "")
        if self.phase != "ready":
            self.world.reset(np.zeros(PLACE))
            self.phase = "ready"

    def _begin(self, first: HandSample) -> None:
        self._first = first
        self._path = HandPath(self._settings.smoothing_s, np.zeros(3))
        self._record = TryRecord(self._settings.caught_s)
        self._moments: deque[_Moment] = deque(maxlen=MOST_MOMENTS)
        self._heard_s = self._reached_s = 0.0
        self.phase, self.outcome, self.reason, self._let_go_s = "playing", None, "", math.inf

    def _moment(self) -> _Moment:
        return _Moment(self.world.moment(), self._path.moment(), self._record.moment(), self.steps)

    def _go_back(self, t_s: float) -> None:
        """Take back what was guessed and a real sample of ``t_s`` knows better.

        A hand that was silent for long stood still until the last period of its device, one that was not has moved.
        """
        if not self._moments:
            return
        still_s = t_s - PERIOD_S if t_s - self._heard_s > SILENCE_S else self._heard_s
        known = [one for one in self._moments if one.path.t_s <= still_s]
        to = known[-1] if known else self._moments[0]
        self._moments.clear()
        self.world.go_back(to.world)
        self._path.go_back(to.path)
        self._record.go_back(to.record)
        self.steps = to.steps

    def _silence_s(self, samples: Sequence[HandSample]) -> float:
        """Return the longest time [s] between two samples, from the last one on, in the simulated time of the hand."""
        times = np.maximum.accumulate([self._first.t_s + self._path.t_s, *(one.t_s for one in samples)])
        return float(np.diff(times).max())

    def _refuse(self, reason: str) -> NoReturn:
        self.stop(reason)
        raise UsageError(reason)

    def _move(self, samples: Sequence[HandSample]) -> None:
        place = np.zeros(PLACE)
        for aside, up, tilt in self._path.follow([self._sample(one) for one in samples]).tolist():
            place[0], place[2], place[3] = aside, up, tilt
            self.world.step(place)
            self.steps += 1
            if self.steps % LOOK_EVERY == 0 and self.phase != "over":
                self._look()
        if not self._held and self.world.t_s > self._let_go_s + SETTLING_S:
            self.stop("")

    def _sample(self, one: HandSample) -> tuple[float, Array]:
        reach, first = self._settings.reach, self._first
        place = (
            min(max(one.aside_m - first.aside_m, -reach.lateral_m), reach.lateral_m),
            min(max(one.up_m - first.up_m, -reach.down_m), reach.up_m),
            min(max(one.tilt_rad - first.tilt_rad, -reach.tilt_rad), reach.tilt_rad),
        )
        return one.t_s - first.t_s, np.array(place)

    def _look(self) -> None:
        """End the try where the ball is caught, or where there is no hope left."""
        self._record.look(self.world)
        t_s, ball = self.world.t_s, self.world.ball
        below = bool(ball.position_m[2] < ball.tie_m[2])
        if self._record.caught:
            self._end("caught")
        elif t_s > self._settings.max_attempt_s or (below and t_s > self._let_go_s + BELOW_S):
            self._end("missed")

    def _end(self, outcome: str, reason: str = "") -> None:
        self._moments.clear()  # what has ended is not taken back
        self.outcome, self.phase, self.reason = outcome, "over", reason
        self._let_go_s = min(self._let_go_s, self.world.t_s)
        samples = self._record.samples(self.conditions)
        if samples is not None:
            self._keep(outcome, self.conditions, samples, reason)
