"""Family of motions among which a search chooses: one primitive at any tau, size, place of the catch and shape."""

from __future__ import annotations

import dataclasses
import math

from kendama_cli.adaptation.path_displacement import bumped_plan, shifted_plan
from kendama_cli.adaptation.trial import MotionVariation
from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.errors import StageError
from kendama_cli.motion.dmp.heading import scaled_plan
from kendama_cli.robot_model.arm_motion import ArmMotion
from kendama_cli.robot_model.model import RobotModel


class CatchFamily:
    """All variations of ``plan`` for ``arm``; each path of the cup is solved once and stretched in time."""

    def __init__(self, arm: RobotModel, plan: MotionPlan, lead_in_m_s2: float) -> None:
        self._arm = arm
        self._plan = plan
        self._lead_in_m_s2 = lead_in_m_s2
        self._solved: dict[MotionVariation, ArmMotion] = {}

    def plan(self, variation: MotionVariation) -> MotionPlan:
        """Return the primitive so varied."""
        plan = scaled_plan(self._plan, variation.amplitude, variation.tau_scale)
        if variation.bumps_m:
            plan = bumped_plan(plan, variation.bumps_m)
        return shifted_plan(plan, variation.shift_m, variation.flight) if variation.shifted else plan

    def swing(self, variation: MotionVariation) -> ArmMotion:
        """Return the arm's motion, to be read at ``variation.tau_scale``.

        Raises StageError if the arm cannot reach it.
        """
        path = dataclasses.replace(variation, tau_scale=1.0)
        if path not in self._solved:
            self._solved[path] = ArmMotion(self._arm, self.plan(path), self._lead_in_m_s2)
        return self._solved[path]

    def limit(self, variation: MotionVariation) -> str | None:
        """Return the joint's limit that forbids this motion, in words; None if nothing does."""
        try:
            swing = self.swing(variation)
        except StageError as error:
            return str(error)
        return None if swing.least_tau_scale() <= variation.tau_scale else swing.limiting_joint()

    def within_limits(self, variation: MotionVariation, tau_range: tuple[float, float]) -> MotionVariation:
        """Return ``variation`` as much slower as the arm's limits ask for, if ``tau_range`` allows it."""
        try:
            least = max(tau_range[0], self.swing(variation).least_tau_scale())
        except StageError:  # nothing is slow enough for a place that is out of reach: ``limit`` tells it
            return variation
        return dataclasses.replace(variation, tau_scale=min(max(variation.tau_scale, least), tau_range[1]))

    def lowest_tau(self, amplitude: float) -> float:
        """Return the least tau within the arm's limits at ``amplitude``; infinite if its path is out of reach."""
        try:
            return self.swing(MotionVariation(1.0, amplitude)).least_tau_scale()
        except StageError:  # too large for the arm: the other sizes remain
            return math.inf
