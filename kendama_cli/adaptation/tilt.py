"""Tilt of the demonstrated cup, as much of it as an arm can play."""

from __future__ import annotations

import numpy as np

from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.errors import StageError
from kendama_cli.motion.dmp.turning import tilt_only, turns_of, with_share_of_turn
from kendama_cli.robot_model.arm_motion import ArmMotion
from kendama_cli.robot_model.model import RobotModel

LESS = (1.0, 0.75, 0.5, 0.25)
TOLD_SPIN_RAD = np.radians(5)


def playable_tilt(arm: RobotModel, plan: MotionPlan, settings: AdaptSettings) -> tuple[MotionPlan, tuple[str, ...]]:
    """Return ``plan`` with as much of its turn as the arm can play within ``settings.tau_range``, and what is left out.

    The turn about the cup's own axis is always left out: the cup is round, and the arm needs the freedom.
    """
    if plan.turn is None:
        return plan, ()
    tilt, spin = tilt_only(turns_of(plan, np.linspace(0.0, plan.duration_s * plan.tau_scale, 200)))
    notes = []
    if spin.max() > TOLD_SPIN_RAD and settings.tilt_fraction > 0:
        notes.append(
            f"left out: the cup's turn about its own axis, up to {np.degrees(spin.max()):.0f} deg; the cup is round"
        )
    shares = [settings.tilt_fraction * less for less in LESS] if settings.tilt_fraction > 0 else []
    reason = ""
    for share in shares:
        tried = with_share_of_turn(plan, share)
        try:
            swing = ArmMotion(arm, tried, settings.lead_in_m_s2)
        except StageError as error:
            reason = str(error)
            continue
        if swing.least_tau_scale() > settings.tau_range[1]:
            reason = swing.limiting_joint()
            continue
        if share < 1:
            notes.append(_less(share, float(tilt.max()), reason or "adapt.tilt_fraction"))
        return tried, tuple(notes)
    notes.append(_less(0.0, float(tilt.max()), reason or "adapt.tilt_fraction=0"))
    return with_share_of_turn(plan, 0.0), tuple(notes)


def _less(share: float, most_rad: float, reason: str) -> str:
    return f"the cup's tilt of up to {np.degrees(most_rad):.0f} deg is played to {share:.0%} only: {reason}"
