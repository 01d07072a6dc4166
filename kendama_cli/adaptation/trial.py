"""Trials of a search for a catch: the variation of the motion, and the result of each."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, inf

from kendama_cli.physics.rim_crossing import SLACK_S


@dataclass(frozen=True)
class MotionVariation:
    """Variation of a motion: ``shift_m`` moves the goal along x and y within the fraction ``flight`` of the motion.

    ``bumps_m`` are the heights of the bumps by which the path is bent (path_displacement); empty without any.
    """

    tau_scale: float
    amplitude: float = 1.0
    shift_m: tuple[float, float] = (0.0, 0.0)
    flight: tuple[float, float] = (0.0, 1.0)
    bumps_m: tuple[float, ...] = ()

    @property
    def shifted(self) -> bool:
        """True if the goal is moved."""
        return self.shift_m != (0.0, 0.0)


@dataclass(frozen=True)
class Trial:
    """Trial that a search asks for: a ``variation`` to simulate.

    ``kind`` names the simulation. ``attempt``: undisturbed, as planned. ``evaluate``: perturbed simulation ``index`` of
    those that all candidates share. ``confirm``: repeat ``index`` of the chosen motion, freshly sampled. A policy
    search has two of its own: ``explore``, rollout ``index`` in the one perturbed simulation of generation ``group``,
    and ``validate``, repeat ``index`` in a fresh one after ``group`` rollouts.
    """

    kind: str
    variation: MotionVariation
    index: int
    group: int = 0


@dataclass(frozen=True)
class Attempt:
    """Result of an ``attempt`` or ``explore``; misses, ``apex_m`` and ``swing_slack_s`` as in RolloutResult.

    ``flight`` is the fraction of the motion in which the ball flew. ``limit`` names the limit of the arm that forbade
    the motion, so that nothing was simulated. ``correction_m`` is the distance of the cup from its plan at the catch.
    """

    variation: MotionVariation
    caught: bool
    signed_miss_m: float | None
    side_miss_m: float | None
    apex_m: float
    flight: tuple[float, float] | None
    limit: str | None = None
    swing_slack_s: float = 0.0
    correction_m: float = 0.0

    @property
    def slack_in_swing(self) -> bool:
        """True if the rope hung slack in the swing: then its mass, which no model here has, decides the miss."""
        return self.swing_slack_s >= SLACK_S

    @property
    def distance_m(self) -> float:
        """Distance from the cup's centre at which the ball came down; infinite if it did not."""
        return inf if self.signed_miss_m is None else hypot(self.signed_miss_m, self.side_miss_m or 0.0)


@dataclass(frozen=True)
class Repeat:
    """Result of a motion in one perturbed simulation; ``miss_m`` is None if the ball never came down.

    ``correction_m`` is the distance of the cup from its plan then, ``swing_slack_s`` as in RolloutResult.
    """

    caught: bool
    miss_m: float | None
    correction_m: float = 0.0
    swing_slack_s: float = 0.0
