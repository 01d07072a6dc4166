"""A bundled swing as the PA10 plays it, for tests of the catch that is seen."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.control.corrected_motion import CupPlan
from kendama_cli.control.visual_catch import cup_plan
from kendama_cli.motion.dmp.averaging import encode_demonstrations
from kendama_cli.robot_model.arm_motion import ArmMotion
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.settings import build
from tests.motion.swings import settings as encode_settings
from tests.simulation.dart.bench_robot import ROOT, adapt_values, bench_arm, modelled

ADAPT = build(AdaptSettings, adapt_values(), "adapt")
TAU = 0.97
"""In the middle of the window of this swing."""


@dataclass(frozen=True)
class Swing:
    """The arm, the swing every millisecond, and where its cup is planned to be."""

    arm: RobotModel
    joints: JointTrajectory
    cup: CupPlan


@functools.cache
def swing() -> Swing:
    """The bundled swing number 4 on the PA10."""
    rows = np.loadtxt(ROOT / "data/demonstrations/swing-04.csv", delimiter=",", skiprows=3)
    one = Demonstration("swing", rows[:, 0], rows[:, 1:4] - rows[0, 1:4])
    arm = modelled(bench_arm())
    motion = ArmMotion(arm, encode_demonstrations([one], encode_settings()), ADAPT.lead_in_m_s2)
    joints = motion.joints(TAU, ADAPT.hold_s)
    return Swing(arm, joints, cup_plan(arm, joints))
