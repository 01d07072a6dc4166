"""A script of poses and forces as a smooth reference in time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kendama_cli.motion import minimum_jerk
from kendama_cli.motion.rotation import exp_of, log_of
from kendama_cli.plugins.interact.interface import TaskReference
from kendama_cli.plugins.interact.settings import StepSettings
from kendama_cli.schema.arrays import Array

NO_AXIS = np.zeros(3)


class TaskPath:
    """Path from rest at ``start_m``, ``start_rotation`` through steps that go along s = 10 r^3 - 15 r^4 + 6 r^5.

    (Flash and Hogan 1985: least jerk.) Position goes straight, orientation about one axis, force with the same s.
    """

    def __init__(self, script: Sequence[StepSettings], start_m: Array, start_rotation: Array) -> None:
        self._script = tuple(script)
        self._ends_s = np.cumsum([step.duration_s for step in script])
        self._places = np.array([start_m, *(step.position_m for step in script)])
        self._forces = np.array([np.zeros(3), *(step.force_n for step in script)])
        self._rotations = [start_rotation, *(exp_of(step.rotation_rad) @ start_rotation for step in script)]
        # each turn is about one axis, fixed in the world
        pairs = zip(self._rotations[1:], self._rotations, strict=False)
        self._ways = np.hstack([np.diff(self._places, axis=0), [log_of(after @ before.T) for after, before in pairs]])
        self.duration_s = float(self._ends_s[-1])

    def step_at(self, t_s: float) -> int:
        """Return the number of the step at ``t_s``; the last one after the end."""
        return min(int(np.searchsorted(self._ends_s, t_s, side="right")), len(self._script) - 1)

    def settled(self, index: int) -> bool:
        """Return True if the desired force is constant throughout the step, and not zero."""
        before, after = self._forces[index], self._forces[index + 1]
        return bool(np.array_equal(before, after) and after.any())

    def at(self, t_s: float) -> TaskReference:
        """Return the reference at ``t_s``; after the end it rests."""
        index = self.step_at(t_s)
        duration_s = self._script[index].duration_s
        r = min((t_s - float(self._ends_s[index])) / duration_s + 1.0, 1.0)
        share = float(minimum_jerk.step(r))
        rate = float(minimum_jerk.step_rate(r)) / duration_s
        change = float(minimum_jerk.step_change(r)) / duration_s**2
        way = self._ways[index]
        before, after = self._forces[index], self._forces[index + 1]
        force = before + share * (after - before)
        shown = force if force.any() else before + after
        length = float(np.linalg.norm(shown))
        held = float(before.any()) + share * (float(after.any()) - float(before.any()))
        return TaskReference(
            position_m=self._places[index] + share * way[:3],
            rotation=exp_of(share * way[3:]) @ self._rotations[index],
            velocity=rate * way,
            acceleration=change * way,
            force_n=force,
            force_axis=shown / length if length else NO_AXIS,
            force_share=held if length else 0.0,
        )
