"""Cup's position while a phone is swung: integrated from the last rest, without knowledge of the end.

The equations are those of ``strapdown``, a sample at a time by the trapezoidal rule. Each rest takes the gyroscope's
bias and the vertical anew, and sets velocity and position to zero; a short halt within a motion sets the velocity.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from kendama_cli.motion.rotation import exp_of
from kendama_cli.plugins.phone.rests import QUIET_M_S2, QUIET_RAD_S
from kendama_cli.schema.arrays import Array

WINDOW_S, HALT_S, REST_S = 0.25, 0.3, 0.6
"""Samples judged together; so long a quiet within a motion is a halt, and so long a one its end."""
BEGIN_S, KNOWN_S = 0.5, 1.2
"""A motion begins slowly, and is integrated from so long before it was noticed; what was before is the rest."""
HAND = 2.0
"""A hand in the air trembles more than one on a table: times the limits of a rest."""
UPRIGHT = 0.7
"""Least part of gravity along the phone's long axis at rest."""

State = Literal["restless", "askew", "reversed", "resting", "moving"]


@dataclass(frozen=True)
class PhoneSample:
    """Specific force [m/s^2] and rotation rate [rad/s] along the phone's axes at ``t_s``: x right, y up, z forward."""

    t_s: float
    force_m_s2: Array
    rate_rad_s: Array


class LiveTrack:
    """Dead reckoning of a phone that is held upright, its screen towards the player.

    ``state`` is moving or resting, or tells why there is no rest yet: restless, askew, or reversed, where the top edge
    points down. ``began_s`` is the time at which the last motion began, ``halted_s`` that of its last halt.
    """

    state: State = "restless"
    began_s = halted_s = 0.0

    def __init__(self) -> None:
        self._window: deque[PhoneSample] = deque()
        self._past: deque[PhoneSample] = deque()
        self._still_s = 0.0
        self._bias, self._axes, self._gravity_m_s2 = np.zeros(3), np.eye(3), 9.81
        self._turn, self._velocity, self._position = np.eye(3), np.zeros(3), np.zeros(3)

    def take(self, one: PhoneSample) -> list[tuple[float, float, float, float]]:
        """Return the cup's positions up to a sample: t [s], lateral, up [m] and tilt [rad]; none while it rests."""
        window = self._window
        step_s = one.t_s - window[-1].t_s if window else 0.0
        window.append(one)
        self._past.append(one)
        for rows, length_s in ((window, WINDOW_S), (self._past, KNOWN_S)):
            while one.t_s - rows[0].t_s > length_s:
                rows.popleft()
        self._still_s = self._still_s + step_s if self._quiet() else 0.0
        if self.state == "moving":
            return [self._moved(self._past[-2], one)]
        if self._still_s > (REST_S if self.state != "resting" else 0.0):
            self._rest()
        elif self.state == "resting":
            return self._start()
        elif self._still_s == 0.0:
            self.state = "restless"
        return []

    def _quiet(self) -> bool:
        if self._window[-1].t_s - self._window[0].t_s < 0.8 * WINDOW_S:
            return False
        values = _values(self._window)
        force, rate = values.mean(axis=0)
        spreads = np.sqrt(values.var(axis=0).sum(axis=1))
        fits = self.state not in ("resting", "moving") or bool(
            np.linalg.norm(rate - self._bias) < HAND * QUIET_RAD_S
            and abs(np.linalg.norm(force) - self._gravity_m_s2) < HAND * QUIET_M_S2
        )
        return fits and bool(spreads[0] < HAND * QUIET_M_S2 and spreads[1] < HAND * QUIET_RAD_S)

    def _rest(self) -> None:
        """Take bias and vertical from the rest so far, save its last part: x is to the right of the screen, z up."""
        now_s = self._past[-1].t_s
        rest = [one for one in self._past if one.t_s >= now_s - self._still_s]
        force, self._bias = _values([one for one in rest if one.t_s < now_s - BEGIN_S] or rest).mean(axis=0)
        self._gravity_m_s2 = float(np.linalg.norm(force))
        up = force / self._gravity_m_s2
        if abs(up[1]) < UPRIGHT:
            self.state = "askew"
        elif up[1] < 0:
            self.state = "reversed"
        else:
            right = np.array([1.0, 0.0, 0.0]) - up[0] * up
            right /= np.linalg.norm(right)
            self._axes = np.array([right, np.cross(up, right), up])
            self.state = "resting"

    def _start(self) -> list[tuple[float, float, float, float]]:
        """Begin a motion with the samples in which the phone may have begun to move."""
        self.state = "moving"
        recent = [one for one in self._past if one.t_s >= self._past[-1].t_s - BEGIN_S]
        self.began_s = self.halted_s = recent[0].t_s
        self._turn, self._velocity, self._position = self._axes, np.zeros(3), np.zeros(3)
        return [(self.began_s, 0.0, 0.0, 0.0), *map(self._moved, recent, recent[1:])]

    def _moved(self, before: PhoneSample, after: PhoneSample) -> tuple[float, float, float, float]:
        """Integrate one step; at a rest the position stays where the cup is drawn until the try has ended."""
        step_s = after.t_s - before.t_s
        down = np.array([0.0, 0.0, self._gravity_m_s2])
        first = self._turn @ before.force_m_s2 - down
        self._turn = self._turn @ exp_of(step_s * ((before.rate_rad_s + after.rate_rad_s) / 2 - self._bias))
        second = self._turn @ after.force_m_s2 - down
        if self._still_s > HALT_S:
            self._velocity, self.halted_s = np.zeros(3), after.t_s
        else:
            self._position = self._position + step_s * self._velocity + step_s**2 / 6 * (2 * first + second)
            self._velocity = self._velocity + step_s / 2 * (first + second)
        if self._still_s > REST_S:
            self._rest()
        up = self._turn @ self._axes.T[:, 2]
        return after.t_s, float(self._position[0]), float(self._position[2]), math.atan2(up[0], up[2])


def _values(rows: Iterable[PhoneSample]) -> Array:
    """Return force and rate of samples as one array (n, 2, 3)."""
    return np.array([(one.force_m_s2, one.rate_rad_s) for one in rows])
