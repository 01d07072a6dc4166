"""The rollouts of one adaptation: a variation of the motion played by the arm, as planned or with the seen catch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kendama_cli.adaptation.catch_family import CatchFamily
from kendama_cli.adaptation.search_record import MotionVariation
from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.adaptation.uncertainty import MOUTH_SHARE, Draw
from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.control.catch_reach import lacking_reach
from kendama_cli.control.seen_catch import SeenCatch, cup_plan
from kendama_cli.control.steered_motion import CupPlan
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.simulation.dart.rollout import RolloutResult, play_rollout
from kendama_cli.simulation.dart.world import ArmWorld
from kendama_cli.simulation.dart.world_errors import NO_ERRORS


@dataclass(frozen=True)
class Standing:
    """Standing of a search's arm in its own world, where the swing goes along ``heading_rad`` from x."""

    robot: RobotSettings
    heading_rad: float


class Rollouts:
    """Plays the motions of ``family`` in ``world``, in which the swing goes along x; ``standing`` is outside of it."""

    def __init__(
        self, world: ArmWorld, family: CatchFamily, settings: AdaptSettings, game: GameSettings, *, standing: Standing
    ) -> None:
        self.world, self.family, self.standing = world, family, standing
        self._settings, self.game = settings, game
        self._planned: tuple[MotionVariation, JointTrajectory, CupPlan] | None = None

    def planned(self, variation: MotionVariation) -> RolloutResult:
        """Played as it is planned, in the world as the model describes it."""
        self.world.perturb(NO_ERRORS)
        return play_rollout(self.world, self.family.swing(variation).joints(variation.tau_scale, self._settings.hold_s))

    def judged(
        self,
        variation: MotionVariation,
        draw: Draw | None,
        *,
        eyes_seed: int,
        rng: np.random.Generator | None = None,
        record: bool = False,
    ) -> tuple[RolloutResult, tuple[float, float]]:
        """Played with the catch that is wanted, in the world of ``draw`` or in the model's.

        The joints' noise is drawn from ``rng``, what the eyes add from ``eyes_seed``. Returns besides how far the cup
        was moved beside its plan, at the catch and at most [m].
        """
        settings, world = self._settings, self.world
        joints, cup = self._motion(variation)
        seen = None
        if settings.catch == "visual":
            noise = np.random.default_rng([eyes_seed, 1])
            seen = SeenCatch(
                world.arm, self.game, joints, cup, eyes=settings.sensor_model, steering=settings.correction, rng=noise
            )
        world.perturb(NO_ERRORS if draw is None else draw.world)
        result = play_rollout(
            world,
            joints,
            errors=None if draw is None else draw.arm,
            noise_rad=0.0 if draw is None else settings.uncertainty.joint_noise_rad,
            rng=rng,
            steering=seen,
            record=record,
        )
        return result, (0.0, 0.0) if seen is None else seen.shifts_m

    def flight_s(self, variation: MotionVariation, flight: tuple[float, float]) -> tuple[float, float]:
        """When the ball flies that does so in the share ``flight`` of the motion."""
        swing = self.family.swing(variation)
        start_s, end_s = ((share * swing.plan.duration_s + swing.lead_in_s) * variation.tau_scale for share in flight)
        return start_s, end_s

    def lacking_reach(self, variation: MotionVariation, flight: tuple[float, float] | None) -> str | None:
        """Why a seen catch cannot go as far as the uncertainty asks for, or None.

        ``flight`` is the share of the motion in which the ball flies.
        """
        if self._settings.catch != "visual" or flight is None:
            return None
        cup = self._motion(variation)[1]
        mouth_m = MOUTH_SHARE * self.game.cup.radius_m
        flight_s = self.flight_s(variation, flight)
        return lacking_reach(cup, flight_s, self._settings, rim_m=self.game.cup.rim_m, mouth_m=mouth_m)

    def _motion(self, variation: MotionVariation) -> tuple[JointTrajectory, CupPlan]:
        """The joints and the cup of ``variation``; kept for its next rollout, which is mostly of the same."""
        if self._planned is None or self._planned[0] != variation:
            joints = self.family.swing(variation).joints(variation.tau_scale, self._settings.hold_s)
            self._planned = variation, joints, cup_plan(self.world.arm, joints)
        return self._planned[1:]
