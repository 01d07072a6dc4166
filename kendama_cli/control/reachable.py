"""Positions to which a visual catch may bring an arm, checked before the motion is played on a robot."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from kendama_cli.adaptation.settings import AdaptSettings, CorrectionSettings
from kendama_cli.artifacts.motion_plan import CatchMotion, JointTrajectory
from kendama_cli.motion.sampling import thinning
from kendama_cli.robot_model.inverse_kinematics import OutOfReachError, across, solve_cup
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.robot_model.placement.motion_check import (
    CheckedLimit,
    check_motion,
    check_places,
    require_allowed,
)
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.safety import SafetySettings

EARLY_S = 0.1
"""A ball is followed no earlier than this before the rope slackens in the planned motion."""
FRACTIONS = (0.25, 0.5, 0.75, 1.0)
"""Radii that are checked, as fractions of the largest shift: all of a circle is inside one of them."""
DIRECTIONS = 8
EVERY_S = 0.02
OUT_STEPS = 5
LIFT_S = 4 / 27 * 0.6
"""Height of a cubic that ends at zero in 0.6 s, longer than balls fly, over the speed that it ends with."""


def follow_from_s(motion: CatchMotion) -> float:
    """Return the time from which a visual catch may leave the plan of ``motion``."""
    return 0.0 if motion.flight_start_s is None else max(motion.flight_start_s - EARLY_S, 0.0)


@dataclass(frozen=True)
class Surroundings:
    """Surroundings that a motion of ``arm`` is checked against before a robot plays it."""

    arm: RobotModel
    game: GameSettings
    adapt: AdaptSettings
    safety: SafetySettings

    def correction(self, joints: JointTrajectory, from_s: float) -> tuple[CorrectionSettings, tuple[str, ...]]:
        """Return the correction of ``adapt`` in as large a circle about ``joints`` as is safe, and what limits it.

        The cup is taken to the rim of each circle, in DIRECTIONS directions, at every position of the motion from
        ``from_s`` on: there the joints keep off their stops, the links off each other and the table, and the cup in its
        box. Raises StageError if the planned motion itself is not allowed, or a visual catch may not leave it.
        """
        require_allowed(check_motion(self.arm, self.game, joints, self.safety))
        correction = self.adapt.correction
        if self.adapt.catch != "visual":
            return correction, ()
        allowed_m = 0.0
        for fraction in FRACTIONS:
            shift_m = fraction * correction.max_shift_m
            wrong = [one for one in self._beside(joints, shift_m, from_s) if not one.holds]
            if wrong and not allowed_m:
                require_allowed(wrong[:1])
            if wrong:
                first = f"{wrong[0].what}: {wrong[0].found}, allowed: {wrong[0].allowed}"
                text = f"the visual catch is held to {allowed_m:g} m beside its plan; farther on is not safe, {first}"
                return dataclasses.replace(correction, max_shift_m=allowed_m), (text,)
            allowed_m = shift_m
        return correction, ()

    def _beside(self, joints: JointTrajectory, shift_m: float, from_s: float) -> Iterator[CheckedLimit]:
        """Yield the limits of positions along ``joints`` with the cup ``shift_m`` to each side."""
        thin = thinning(joints.t_s, EVERY_S)
        t_s, planned = joints.t_s[::thin], joints.position_rad[::thin]
        first = min(int(np.searchsorted(t_s - t_s[0], from_s)), len(t_s) - 1)
        correction = self.adapt.correction
        speed_m_s, braking_m_s2 = correction.contact_speed_m_s, correction.contact_braking_m_s2
        lifts_m = {-(speed_m_s**2) / (2 * braking_m_s2), LIFT_S * speed_m_s}
        for degrees, lift_m in itertools.product(range(0, 360, 360 // DIRECTIONS), sorted(lifts_m)):
            angle = np.radians(degrees)
            side = np.array([shift_m * np.cos(angle), shift_m * np.sin(angle), lift_m])
            there, solved = _solved(self.arm, planned[first:], side)
            if not there.any():
                continue
            angles = np.vstack([joints.position_rad[:1], solved])
            still = np.zeros_like(angles)
            times = np.concatenate([[t_s[first] - EVERY_S], t_s[first:][there]])
            beside = JointTrajectory(joints.joint_names, times, angles, still, still)
            yield from check_places(self.arm, self.game, beside, self.safety)


def _solved(arm: RobotModel, planned: Array, side_m: Array) -> tuple[Array, Array]:
    """Return where the cup can be ``side_m`` (3,) beside ``planned`` (n, j), as tilted as there, and the joints then.

    Where it cannot be (the mask (n,) is False) a visual catch stops by itself.
    """
    there, angles, last = np.zeros(len(planned), dtype=bool), [], None
    for k, position in enumerate(planned):
        pose = arm.tool_pose(position)
        fractions = np.arange(1, OUT_STEPS + 1) / OUT_STEPS if last is None else (1.0,)
        try:
            reached = position if last is None else last
            for fraction in fractions:
                reached = solve_cup(arm, pose.position_m + fraction * side_m, reached, across(pose.rotation[:, 2]))
        except OutOfReachError:
            last = None
            continue
        last, there[k] = reached, True
        angles.append(last)
    return there, np.array(angles).reshape(-1, planned.shape[1])
