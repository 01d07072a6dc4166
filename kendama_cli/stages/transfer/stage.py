"""Transfer: the policy and the primitive on the hardware, learned on, and full games played there."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.artifacts.motion_plan import CatchMotion
from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.artifacts.transfer_result import TransferResult
from kendama_cli.control.game_runner import GameBuilder, GameSetup
from kendama_cli.control.open_observer import CameraSetup, check_cameras
from kendama_cli.control.reachable import Surroundings, follow_from_s
from kendama_cli.control.settings import TransferSettings
from kendama_cli.devices.robot.compensated import compensated
from kendama_cli.devices.robot.exchange_log import RememberingRobot
from kendama_cli.devices.robot.leading import LeadingRobot
from kendama_cli.devices.robot.open_robot import open_robot
from kendama_cli.errors import HardwareError, StageError
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.verification import load_policy, verify_policy
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.settings.camera import CameraSettings, LightingSettings
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.hardware import HardwareSettings
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.settings.safety import SafetySettings
from kendama_cli.stages.interface import Metric, StageContext, StageResult
from kendama_cli.stages.transfer.imitating import ImitationSession, imitation_over
from kendama_cli.stages.transfer.progress import Progress
from kendama_cli.stages.transfer.session import TransferSession
from kendama_cli.vision.settings import PredictSettings

if TYPE_CHECKING:
    from kendama_cli.stages.transfer.aiming import ImitationAims


class Transfer:
    """Stage from the PolicyArtifact of ``learn`` to a TransferResult.

    It also takes, if there, the CatchMotion of ``adapt`` and the FrictionModel of ``identify``. ``adapt`` and
    ``safety`` are needed with a CatchMotion: they say how that was made, and what its visual catch has to keep to.
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

        The first play of the imitation tells the arm's own servo, by which every later command leads.

        Raises StageError before anything moves where the policy does not fit or the motion is unsafe, HardwareError
        where the line or the robot fails: the finished rollouts are kept, and the next run resumes from them; the one
        that broke off is logged as far as it went.
        """
        settings, learn = self._setup.transfer, self._setup.learn
        check_cameras(self._setup.cameras, settings.observation, realtime=False)  # the open robot says whether it is
        policy: PolicyArtifact = load_policy(settings.policy) if settings.policy else given["learn"]
        verify_policy(policy, learn, settings.policy or "the stage 'learn'")
        saved = ctx.restore()
        progress = Progress.resumed(saved, policy, learn, settings, ctx.rng("transfer"))
        motion: CatchMotion | None = given.get("adapt")
        setup = self._setup if motion is None else self._setup.placed_at(motion.placement)
        builder = GameBuilder(setup)
        held: tuple[str, ...] = ()
        aims = None
        if motion is not None:
            around = self._around(builder.arm, setup.game)
            _, held = around.correction(motion.joints, follow_from_s(motion))
            if motion.caught and not imitation_over(progress, settings):
                aims = _aims(setup, motion, around.adapt, now=self._hardware.moves)
        seed = int(progress.rng("body", 0).integers(2**63))
        with open_robot(self._hardware, setup.robot, setup.game) as bare:
            leading = LeadingRobot(compensated(bare, given.get("identify")), builder.arm)
            robot = RememberingRobot(leading)
            with builder.open(robot, seed=seed) as runner:
                session = TransferSession(
                    runner, progress, ctx, settings=settings, learn=learn, arm=builder.arm, kept=robot
                )
                imitation = ImitationSession(
                    session, runner, progress, settings=settings, arm=builder.arm, leading=leading
                )
                if saved is None:
                    session.show(setup.game, setup.cameras.camera if settings.observation.source == "cameras" else None)
                try:
                    if motion is not None:
                        imitation.imitate(motion, around, aims)
                    session.evaluate(progress.before, policy, "before")
                    session.learn("table")
                    session.evaluate(progress.after, progress.policy, "after")
                    if settings.baseline:
                        session.learn("scratch")
                    session.play(progress.kept(policy), setup.game, self._hardware)
                except HardwareError:
                    ctx.checkpoint(progress.saved, force=True)  # the next run resumes from before what broke off
                    session.log_broken_off()
                    raise
        result = TransferResult(
            policy=progress.kept(policy),
            rollouts=progress.rollouts(),
            imitation_caught=any(progress.imitation) if progress.imitation else None,
            games=len(progress.games),
            caught=sum(game.caught for game in progress.games),
        )
        metrics = transfer_metrics(result, progress, baseline=settings.baseline)
        return StageResult(result, metrics, warnings=(*held, *_warnings(progress)))

    def _around(self, arm: RobotModel, game: GameSettings) -> Surroundings:
        """Return what an imitated motion of ``arm`` is checked against; raises StageError where that was not given."""
        if self._adapt is None or self._safety is None:
            missing = "adapt" if self._adapt is None else "safety"
            raise StageError(
                f"'transfer' is given the motion of 'adapt' without the settings of '{missing}'; add '{missing}' to "
                "transfer's config in the pipeline; nothing was moved"
            )
        return Surroundings(arm, game, self._adapt, self._safety)


def _aims(setup: GameSetup, motion: CatchMotion, adapt: AdaptSettings, *, now: bool) -> Callable[[], ImitationAims]:
    """Return what simulates, once, the motions that may be played after a miss of ``motion``.

    ``now``: at once, so that a real arm does not wait for it after a miss; else if there is one.
    """
    from kendama_cli.stages.transfer.aiming import ImitationAims  # noqa: PLC0415 - it needs the simulator

    aims = functools.cache(lambda: ImitationAims(setup.robot, setup.game, motion, adapt))
    if now:
        aims()
    return aims


def _warnings(progress: Progress) -> Iterator[str]:
    if progress.reverted():
        yield (
            f"learning on made the table worse: {sum(progress.after)} of {len(progress.after)} frozen rollouts succeed "
            f"after it, {sum(progress.before)} of {len(progress.before)} did before; the games were played with the "
            "table as it was before, which is also the result"
        )


def transfer_metrics(result: TransferResult, progress: Progress, *, baseline: bool) -> Mapping[str, Metric]:
    """Return all figures of one transfer, with those of learning from scratch if ``baseline`` asked for it."""
    games = progress.games
    errors = [game.error_mm for game in games if game.error_mm is not None]
    latencies = [game.latency_frames for game in games if game.latency_frames is not None]
    frames = sum(game.frames for game in games)
    metrics: dict[str, Metric] = {"rollouts": result.rollouts, "learned": progress.learned()}
    if (solved := progress.solved()) is not None:
        metrics["rollouts_to_solved"] = progress.rollouts_to_solved()
        metrics["solved"] = solved
    if baseline:
        metrics["rollouts_from_scratch"] = progress.rollouts("scratch")
        metrics["learned_from_scratch"] = progress.learned("scratch")
    metrics |= {
        "success_rate_before": float(np.mean(progress.before)),
        "success_rate_after": float(np.mean(progress.after)),
        "reverted": progress.reverted(),
        "imitation_caught": result.imitation_caught,
        "imitation_attempts": len(progress.imitation),
    }
    if progress.imitation:
        metrics["imitation_caught_rate"] = float(np.mean(progress.repeats)) if progress.repeats else None
    if progress.servo is not None:
        metrics["servo_lag_s"] = float(np.median(progress.servo.lag_s))
        metrics["servo_dead_time_s"] = progress.servo.dead_time_s
    if progress.rope_fit is not None:
        metrics["imitation_rope_scale"] = progress.rope_fit.rope_scale
        metrics["imitation_resized"] = progress.rope_fit.resized
    return metrics | {
        "games": result.games,
        "caught_rate": result.caught / result.games,
        "swung_up_rate": float(np.mean([game.swung_up for game in games])),
        "prediction_error_mm_p50": float(np.median(errors)) if errors else None,
        "latency_frames_p95": max(latencies) if latencies else None,
        "detection_rate": sum(game.seen for game in games) / frames if frames else None,
        "missed_packets": progress.missed,
    }
