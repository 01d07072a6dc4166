"""The motions among which the search chooses: one primitive at any tau, size and place of the catch."""

from __future__ import annotations

from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.errors import StageError
from kendama_cli.motion.amplitude import scaled_plan
from kendama_cli.robot_model.arm_motion import ArmMotion
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.simulation.catch.late_shift import shifted_plan
from kendama_cli.simulation.catch.search_record import Bounds, MotionVariation
from kendama_cli.simulation.catch.uncertainty import MOUTH_SHARE


class CatchFamily:
    """All variations of ``plan`` for ``arm``; each path of the cup is solved once and stretched in time."""

    def __init__(self, arm: RobotModel, plan: MotionPlan, lead_in_m_s2: float) -> None:
        self._arm = arm
        self._plan = plan
        self._lead_in_m_s2 = lead_in_m_s2
        self._solved: dict[MotionVariation, ArmMotion] = {}

    def plan(self, variation: MotionVariation) -> MotionPlan:
        """The primitive so varied."""
        plan = scaled_plan(self._plan, variation.amplitude, variation.tau_scale)
        return shifted_plan(plan, variation.shift_m, variation.flight) if variation.shifted else plan

    def swing(self, variation: MotionVariation) -> ArmMotion:
        """The arm's motion, to be read at ``variation.tau_scale``; raises StageError where the arm cannot reach."""
        one = MotionVariation(1.0, variation.amplitude, variation.shift_m, variation.flight)
        if one not in self._solved:
            self._solved[one] = ArmMotion(self._arm, self.plan(one), self._lead_in_m_s2)
        return self._solved[one]

    def limit(self, variation: MotionVariation) -> str | None:
        """Which joint's limit forbids this motion, in words, or None where nothing does."""
        try:
            swing = self.swing(variation)
        except StageError as error:
            return str(error)
        return None if swing.least_tau_scale() <= variation.tau_scale else swing.limiting_joint()

    def bounds(self, amplitudes: tuple[float, ...], cup_radius_m: float) -> Bounds:
        """Where to search; amplitudes whose path the arm cannot reach are left out, but for the motion itself.

        Raises StageError where the arm cannot reach along the motion itself.
        """
        lowest = {1.0: self.swing(MotionVariation(1.0)).least_tau_scale()}
        for amplitude in amplitudes:
            try:
                lowest[amplitude] = self.swing(MotionVariation(1.0, amplitude)).least_tau_scale()
            except StageError:  # too large for the arm: the other sizes remain
                continue
        return Bounds(lowest, MOUTH_SHARE * cup_radius_m)
