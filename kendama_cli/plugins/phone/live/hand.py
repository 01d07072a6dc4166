"""A phone as the hand of a player: its messages become positions of the cup, and a try's path once it rests again."""

from __future__ import annotations

import json
import math
from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from kendama_cli.devices.demonstrator.tidy import even_times
from kendama_cli.errors import InputError, UsageError
from kendama_cli.motion.rotation import matrix_of
from kendama_cli.plugins.phone.evidence import HOLD, check_motion, report, suspicions
from kendama_cli.plugins.phone.live.track import REST_S, LiveTrack, PhoneSample
from kendama_cli.plugins.phone.swings import in_own_plane, on_one_clock, reconstructed_from
from kendama_cli.plugins.phone.tables import MIN_HZ, Signal
from kendama_cli.schema.arrays import Array

MOST_SAMPLES, LARGEST = 500, 1e5
BEFORE_S, LONGEST_S = 1.0, 30.0
"""Time taken of the rest before a motion, and the longest try."""
MAX_GAP_S = 0.06
STALE_S = 2.5
"""Length of a motion without a halt after which the drawn cup has strayed visibly."""
STRAY_M, STRAY_S = 0.026, 2.0
"""Usual sensors stray by so much in that time (median of 40 simulated phones), and with its square."""
AFTER_S = 1.5
"""So long after a rest the table hears that the hand stands still: the ball comes to lie in the cup or hangs again."""
LINES = {
    "restless": "Hold the phone still: top edge up, screen towards you.",
    "askew": "Hold the phone upright: top edge up, screen towards you.",
    "reversed": "The top edge points down. Turn the phone; if it does point up, press 'Top edge is up'.",
    "resting": "Ready: swing to the left and right of the screen.",
    "moving": "",
}


class PhoneHand:
    """Samples of one phone, as its page sends them.

    ``settled`` is True while no motion is under way; ``hint`` is the line that the phone should show.
    """

    def __init__(self) -> None:
        self._track, self._sign = LiveTrack(), 1.0
        self._rows: deque[PhoneSample] = deque()
        self._try: list[PhoneSample] = []
        self._last, self._rested_s = (0.0, 0.0, 0.0), -math.inf
        self.settled, self.hint = True, LINES["restless"]

    def take(self, text: str) -> Mapping[str, Any] | None:
        """Return the message of a page's hand after a phone's ``text``, None while it rests.

        Raises UsageError for a text that is none.
        """
        samples = self._parsed(text)
        places, held = [], False
        for one in samples:
            if self._rows and one.t_s <= self._rows[-1].t_s:
                continue
            self._rows.append(one)
            while one.t_s - self._rows[0].t_s > LONGEST_S:
                self._rows.popleft()
            rested = self._track.state != "moving"
            moved = self._track.take(one)
            if moved and rested:
                self._try = []  # what was not asked for is another motion's
            if moved:
                places += moved
                held, self._last = True, moved[-1][1:]
            if moved and self._track.state != "moving":
                self._rested_s = one.t_s
                self._try = [row for row in self._rows if row.t_s >= self._track.began_s - BEFORE_S]
            elif not moved and one.t_s - self._rested_s < AFTER_S:
                places.append((one.t_s, *self._last))
        moving = self._track.state == "moving"
        self.settled, self.hint = not moving, self._line()
        if not places:
            return None
        rows = [[1e3 * t_s, aside_m, up_m, tilt_rad] for t_s, aside_m, up_m, tilt_rad in places]
        return {"type": "hand", "samples": rows, "held": held and moving}

    def path(self) -> tuple[Array, Array, Sequence[str]]:
        """Return the last motion with its end's rest known: times (n,), places (n, 4) and what is likely of them.

        A place is x, y, z [m] and the tilt about y [rad]. Raises InputError where there is no rest at its end, or where
        ``capture=phone`` would refuse the recording.
        """
        name = "the phone's swing"
        samples, self._try = self._try, []  # while a thread works on it the phone may move again
        if len(samples) < 2:
            raise InputError(name, "the phone was not still at its end", remedy=HOLD)
        t_s = np.array([one.t_s for one in samples]) - samples[0].t_s
        even = even_times(t_s)
        t_s = t_s if even is None else even
        force = Signal(name, t_s, np.array([one.force_m_s2 for one in samples]), "m")
        rate = Signal(name, t_s, np.array([one.rate_rad_s for one in samples]), "rad")
        whole = reconstructed_from(name, name, on_one_clock(name, force, rate, MAX_GAP_S))
        for motion in whole.motions:
            check_motion(name, motion.evidence)
        doubts = [*report(whole.motions, whole.signals.rate_hz), *suspicions(whole.motions, whole.signals)]
        assert whole.recording.rotation_wxyz is not None
        right = matrix_of(whole.recording.rotation_wxyz[0])[:2, 0]
        own = in_own_plane(whole.recording, (0.0, 0.0, 0.0), right)
        assert own.rotation_wxyz is not None
        axis = np.array([matrix_of(one)[:, 2] for one in own.rotation_wxyz])
        places = np.column_stack([own.position_m - own.position_m[0], np.arctan2(axis[:, 0], axis[:, 2])])
        return own.t_s, places, doubts

    def _line(self) -> str:
        rows = self._rows
        if len(rows) > 1 and (rows[-1].t_s - rows[0].t_s) > REST_S:
            recent = list(rows)[-20:]
            rate_hz = (len(recent) - 1) / (recent[-1].t_s - recent[0].t_s)
            if rate_hz < MIN_HZ:
                return f"Only {rate_hz:.0f} samples a second arrive; {MIN_HZ:.0f} are needed. Is a battery saver on?"
        since_s = rows[-1].t_s - self._track.halted_s if rows else 0.0
        if self._track.state == "moving" and since_s > STALE_S:
            strayed_cm = 100 * STRAY_M * (since_s / STRAY_S) ** 2
            return f"The cup may be drawn {strayed_cm:.0f} cm off: hold still to set it right."
        return LINES[self._track.state]

    def _parsed(self, text: str) -> list[PhoneSample]:
        try:
            data = json.loads(text)
            rows = np.array(data["samples"], dtype=np.float64).reshape(-1, 7)
            turned = bool(data.get("turned"))
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
            raise UsageError("a message of the phone is no list of samples of seven numbers") from None
        if not np.isfinite(rows).all() or len(rows) > MOST_SAMPLES or np.abs(rows[:, 1:]).max(initial=0) > LARGEST:
            raise UsageError(f"a message of the phone has more than {MOST_SAMPLES} samples, or no plausible numbers")
        if turned != (self._sign < 0):  # what was rest before has another sign now
            self._sign = -self._sign
            self._track, self._rows, self._try = LiveTrack(), deque(), []
        scale = np.radians(1.0)
        return [PhoneSample(row[0] / 1e3, self._sign * row[1:4], scale * row[4:]) for row in rows]
