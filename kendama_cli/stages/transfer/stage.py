"""Transfer: the primitive imitated on the hardware; with a policy it is learned on, and full games are played there."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.artifacts.friction_model import FrictionModel
from kendama_cli.artifacts.motion_plan import CatchMotion
from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.control.game_runner import GameBuilder, GameSetup
from kendama_cli.control.open_observer import CameraSetup, check_cameras
from kendama_cli.control.reachable import Surroundings, follow_from_s
from kendama_cli.control.settings import TransferSettings
from kendama_cli.devices.robot.compensated import compensated
from kendama_cli.devices.robot.exchange_log import RememberingRobot
from kendama_cli.devices.robot.leading import LeadingRobot
from kendama_cli.devices.robot.open_robot import open_robot
from kendama_cli.errors import HardwareError, StageError
from kendama_cli.identification.kept_servo import kept_servo
from kendama_cli.identification.servo import cup_sag_m
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.verification import load_policy, verify_policy
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.settings.camera import CameraSettings, LightingSettings
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.hardware import HardwareSettings
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.settings.safety import SafetySettings
from kendama_cli.stages.interface import StageContext, StageResult
from kendama_cli.stages.transfer.imitating import ImitationSession, imitation_over
from kendama_cli.stages.transfer.outcome import MEASURED, ToldOutcomes
from kendama_cli.stages.transfer.progress import Progress
from kendama_cli.stages.transfer.results import transfer_result, warnings
from kendama_cli.stages.transfer.session import TransferSession
from kendama_cli.vision.settings import PredictSettings

if TYPE_CHECKING:
    from kendama_cli.stages.transfer.aiming import ImitationAims


class Transfer:
    """Stage from the CatchMotion of ``adapt``, the PolicyArtifact of ``learn``, or both, to a TransferResult.

    It also takes, if there, the FrictionModel of ``identify``. Without a policy it plays the imitation alone. ``adapt``
    and ``safety`` are needed with a CatchMotion: they say how that was made, and what its visual catch has to keep to.
    """

    def __init__(
        self,
        *,
        transfer: TransferSettings,
        hardware: HardwareSettings,
        robot: RobotSettings,
        game: GameSettings,
        learn: LearnSettings,
        camera: CameraSettings,
        lighting: LightingSettings,
        predict: PredictSettings,
        adapt: AdaptSettings | None = None,
        safety: SafetySettings | None = None,
    ) -> None:
        self._adapt, self._safety = adapt, safety
        self._hardware = hardware
        self._setup = GameSetup(robot, game, learn, transfer, CameraSetup(camera, lighting, predict))

    def run(self, given: Mapping[str, Any], ctx: StageContext) -> StageResult:
        """Imitate, evaluate, learn on, evaluate again, play; what was learned survives whatever goes wrong.

        The first play of the imitation tells the arm's own servo, by which every later command leads, or checks the one
        of 'identify' or of an earlier run.

        Raises StageError before anything moves where the policy does not fit or the motion is unsafe, HardwareError
        where the line or the robot fails: the finished rollouts are kept, and the next run resumes from them; the one
        that broke off is logged as far as it went.
        """
        settings, learn = self._setup.transfer, self._setup.learn
        check_cameras(self._setup.cameras, settings.observation, realtime=False)  # the open robot says whether it is
        motion: CatchMotion | None = given.get("adapt")
        policy = self._policy(given)
        saved = ctx.restore()
        progress = Progress.resumed(saved, policy, learn, settings, ctx.rng("transfer"))
        friction: FrictionModel | None = given.get("identify")
        known = None if friction is None else friction.servo
        if settings.servo is not None:
            known = kept_servo(settings.servo, self._setup.robot, self._hardware)
        setup = self._setup if motion is None else self._setup.placed_at(motion.placement)
        builder = GameBuilder(setup, swings=policy is not None)
        held: tuple[str, ...] = ()
        aims = None
        if motion is not None:
            around = self._around(builder.arm, setup.game)
            _, held = around.correction(motion.joints, follow_from_s(motion))
            if motion.caught and not imitation_over(progress, settings):
                search = int(progress.rng("search", 0).integers(2**63))
                aims = _aims(setup, motion, around.adapt, search, now=self._hardware.moves)
        told = None
        if motion is not None and settings.outcome != MEASURED and not imitation_over(progress, settings):
            told = ToldOutcomes(settings.outcome, ctx)
        seed = int(progress.rng("body", 0).integers(2**63))
        with open_robot(self._hardware, setup.robot, setup.game) as bare:
            leading = LeadingRobot(compensated(bare, friction), builder.arm, known)
            robot = RememberingRobot(leading)
            with builder.open(robot, seed=seed) as runner:
                session = TransferSession(
                    runner, progress, ctx, settings=settings, learn=learn, arm=builder.arm, kept=robot
                )
                imitation = ImitationSession(
                    session, runner, progress, settings=settings, arm=builder.arm, leading=leading, told=told
                )
                if saved is None:
                    session.show(setup.game, setup.cameras.camera if settings.observation.source == "cameras" else None)
                try:
                    if motion is not None:
                        imitation.imitate(motion, around, aims)
                    if policy is not None:
                        session.learn_and_play(policy, setup.game, self._hardware)
                except HardwareError:
                    ctx.checkpoint(progress.saved, force=True)  # the next run resumes from before what broke off
                    session.log_broken_off()
                    raise
        sag_m = None
        if motion is not None and progress.servo is not None:
            sag_m = cup_sag_m(builder.arm, progress.servo, motion.joints.position_rad[0])
        result, metrics = transfer_result(progress, policy, settings, sag_m=sag_m, known=known)
        return StageResult(result, metrics, warnings=(*held, *warnings(progress, known)))

    def _policy(self, given: Mapping[str, Any]) -> PolicyArtifact | None:
        """Return the verified policy, None where there is a motion alone; raises StageError where there is neither."""
        file = self._setup.transfer.policy
        policy: PolicyArtifact | None = load_policy(file) if file else given.get("learn")
        if policy is not None:
            verify_policy(policy, self._setup.learn, file or "the stage 'learn'")
        elif "adapt" not in given:
            raise StageError(
                "'transfer' is given neither the motion of 'adapt' nor the policy of 'learn'; add one of them to its "
                "needs in the pipeline; nothing was moved"
            )
        return policy

    def _around(self, arm: RobotModel, game: GameSettings) -> Surroundings:
        """Return what an imitated motion of ``arm`` is checked against; raises StageError where that was not given."""
        if self._adapt is None or self._safety is None:
            missing = "adapt" if self._adapt is None else "safety"
            raise StageError(
                f"'transfer' is given the motion of 'adapt' without the settings of '{missing}'; add '{missing}' to "
                "transfer's config in the pipeline; nothing was moved"
            )
        return Surroundings(arm, game, self._adapt, self._safety)


def _aims(
    setup: GameSetup, motion: CatchMotion, adapt: AdaptSettings, seed: int, *, now: bool
) -> Callable[[], ImitationAims]:
    """Return what simulates, once, the motions that may be played after a miss of ``motion``; a search has ``seed``.

    ``now``: at once, so that a real arm does not wait for it after a miss; else if there is one.
    """
    from kendama_cli.stages.transfer.aiming import ImitationAims  # noqa: PLC0415 - it needs the simulator

    aims = functools.cache(lambda: ImitationAims(setup.robot, setup.game, motion, adapt, seed))
    if now:
        aims()
    return aims
