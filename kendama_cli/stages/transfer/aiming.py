"""Aims of an imitation on the robot: the motions that may be played after a miss, and which of them is next."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from kendama_cli.adaptation.aim import Aim, AimedRollout, Miss, next_aim, observed_miss
from kendama_cli.adaptation.aim_search import AimedMotions
from kendama_cli.adaptation.aim_words import next_aim_by_words, read_outcome
from kendama_cli.adaptation.catch_family import CatchFamily, attempt_of
from kendama_cli.adaptation.search_record import MOUTH_SHARE, Attempt, MotionVariation
from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.artifacts.motion_plan import CatchMotion, JointTrajectory
from kendama_cli.artifacts.servo_model import ServoModel
from kendama_cli.control.imitation import scaled_motion
from kendama_cli.errors import SimulationError
from kendama_cli.identification.servo import followed
from kendama_cli.motion.dmp.heading import heading_turn, swing_heading_rad, turned_plan
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.placement import turned
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.simulation.dart.rollout import play_rollout
from kendama_cli.simulation.dart.world import ArmWorld
from kendama_cli.stages.transfer.progress import AttemptFigures


class ImitationAims:
    """Motions about ``motion`` that an aim chooses among, simulated as modelled before anything moves.

    The swing's plane is turned onto x, along which the aim counts. A rope of another length than the model's scales
    motion and miss alike (``scaled_motion``), so that the simulations serve for every rope.
    """

    def __init__(
        self, robot: RobotSettings, game: GameSettings, motion: CatchMotion, adapt: AdaptSettings, seed: int
    ) -> None:
        """Take ``robot`` at the placement of ``motion``; about 180 motions are simulated (15 s).

        ``seed`` is that of the search that is left where no aim leads to a catch.
        """
        self._heading_rad = swing_heading_rad(motion.plan)
        self._adapt, self._seed, self._planned = adapt, seed, motion.joints
        self._arm = RobotModel(robot, game.cup, game.gravity_m_s2)
        self._world = ArmWorld(turned(robot, -self._heading_rad), game)
        plan = turned_plan(motion.plan, -self._heading_rad)
        self._family = CatchFamily(self._world.arm, plan, adapt.lead_in_m_s2)
        self._mouth_m = MOUTH_SHARE * game.cup.radius_m
        self._tau = motion.plan.tau_scale
        self._motions = AimedMotions(adapt, self._family, self._simulated, self._tau)

    @property
    def first(self) -> Aim:
        """Aim of the motion as planned."""
        return Aim(self._motions.path.first_m)

    @property
    def path_m(self) -> tuple[float, float]:
        """Least and largest predicted miss of the motions."""
        return self._motions.path.miss_m[0], self._motions.path.miss_m[-1]

    def _simulated(self, variation: MotionVariation) -> Attempt:
        limit = self._family.limit(variation)
        if limit is not None:
            return Attempt(variation, False, None, None, 0.0, None, limit)
        swing = self._family.swing(variation)
        try:
            result = play_rollout(self._world, swing.joints(variation.tau_scale, self._adapt.hold_s))
        except SimulationError as error:
            return Attempt(variation, False, None, None, 0.0, None, str(error))
        return attempt_of(variation, swing, result)

    def next(self, played: Sequence[AttemptFigures], rope_scale: float, servo: ServoModel | None = None) -> Aim:
        """Return the aim after the attempts ``played``; where aiming has failed, a motion of the search.

        Attempts that no servo led count by what they missed beside the model's miss with ``servo``.
        """
        if words := [(self.aim(one), told) for one in played if (told := read_outcome(one.outcome)) is not None]:
            return next_aim_by_words(self._motions.path, words)
        rollouts = [rollout for one in played if (rollout := self._rollout(one, rope_scale, servo)) is not None]
        aimed = [one for one in rollouts if not one.aim.bent]
        aim = next_aim(self._motions.path, aimed, self._mouth_m)
        costs_m = [math.hypot(*one.miss_m) for one in rollouts if one.aim.bent]
        return self._motions.searched(aimed, costs_m, self._seed) if aim is None else aim

    def _rollout(self, one: AttemptFigures, rope_scale: float, servo: ServoModel | None) -> AimedRollout | None:
        miss_m = None
        if one.miss_m is not None:
            x, y, _ = heading_turn(-self._heading_rad) @ np.array([*one.miss_m, 0.0]) / rope_scale
            miss_m = (float(x), float(y))
        miss_m = observed_miss(miss_m, (one.apex_m or 0.0) / rope_scale, self._motions.path.forward)
        if not one.led:
            unled_m = None if servo is None else self._unled_m(servo)
            if unled_m is None:
                return None
            miss_m = (miss_m[0] - unled_m[0] + self.first.along_m, miss_m[1] - unled_m[1])
        return AimedRollout(self.aim(one), one.caught, miss_m)

    def _unled_m(self, servo: ServoModel) -> Miss | None:
        """Return the miss in the model of the motion as planned that no command leads; None without a descent."""
        try:
            result = play_rollout(self._world, followed(self._arm, self._planned, servo))
        except SimulationError:
            return None
        return None if result.signed_miss_m is None else (result.signed_miss_m, result.side_miss_m or 0.0)

    def aim(self, one: AttemptFigures) -> Aim:
        """Return the aim of an attempt."""
        return self.first if one.along_m is None else Aim(one.along_m, one.shift_m, one.bent)

    def joints(self, aim: Aim, rope_scale: float) -> tuple[Aim, JointTrajectory, float]:
        """Return ``aim`` as near as the arm's limits allow, its motion for the rope, and its tau over the planned one.

        Raises StageError where the motion is beyond the limits on that rope.
        """
        nearer, variation = self._motions.playable(aim)
        plan = turned_plan(self._family.plan(variation), self._heading_rad)
        lead_in_m_s2, hold_s = self._adapt.lead_in_m_s2, self._adapt.hold_s
        joints = scaled_motion(self._arm, plan, rope_scale, lead_in_m_s2=lead_in_m_s2, hold_s=hold_s)
        return nearer, joints, variation.tau_scale / self._tau

    def nearer(self, aim: Aim, halvings: int) -> Aim:
        """Return ``aim`` brought nearer to the planned motion by so many halvings."""
        part, first_m = 0.5**halvings, self.first.along_m
        x, y = aim.shift_m
        bent = tuple(part * one for one in aim.bent)
        return Aim(first_m + part * (aim.along_m - first_m), (part * x, part * y), bent)
