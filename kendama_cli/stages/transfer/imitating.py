"""The demonstrated swing on the robot: plays until it catches, and then to tell how often it does."""

from __future__ import annotations

from kendama_cli.artifacts.motion_plan import CatchMotion, JointTrajectory
from kendama_cli.control.flight_observer import WatchedFlight
from kendama_cli.control.game_runner import GameRunner
from kendama_cli.control.imitation import VisualImitation, fitted, play_motion, tau_scales_to_try
from kendama_cli.control.reachable import Surroundings, follow_from_s
from kendama_cli.control.settings import TransferSettings
from kendama_cli.devices.robot.leading import LeadingRobot
from kendama_cli.identification.servo import servo_of
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.stages.transfer import trace
from kendama_cli.stages.transfer.progress import Progress, RopeFitFigures
from kendama_cli.stages.transfer.session import TransferSession


class ImitationSession:
    """Plays of one motion in ``session``; its first play tells the servo by which ``leading`` then leads all commands.

    The session resumes where ``progress`` stands.
    """

    def __init__(
        self,
        session: TransferSession,
        runner: GameRunner,
        progress: Progress,
        *,
        settings: TransferSettings,
        arm: RobotModel,
        leading: LeadingRobot,
    ) -> None:
        self._session, self._runner, self._progress = session, runner, progress
        self._settings, self._arm, self._leading = settings, arm, leading
        leading.lead(progress.servo)

    def imitate(self, motion: CatchMotion, around: Surroundings) -> None:
        """Play the imitation motion, fitted to the rope, until it catches; at slightly other tau after a miss.

        Then play it again at the tau that caught, to tell how often it does.
        """
        progress, settings = self._progress, self._settings
        attempted = progress.imitation
        tau_scales = tau_scales_to_try(settings.imitation_tau_step, settings.imitation_attempts)
        if len(attempted) == len(tau_scales) and not any(attempted):
            return
        if any(attempted) and len(progress.repeats) >= settings.imitation_repeats:
            return
        game, seed = around.game, int(progress.rng("rope", 0).integers(2**63))
        known = None if progress.rope_fit is None else progress.rope_fit.rope_scale
        fit = fitted(self._runner.robot, motion, around, seed=seed, rope_scale=known)
        progress.rope_fit = RopeFitFigures(fit.rope_scale, fit.resized)
        tau_scales = around.playable(fit.joints, tau_scales)
        seen = None
        if around.adapt.catch == "visual":
            watched = WatchedFlight(self._runner.observer.without_goal())
            seen = VisualImitation(watched, self._arm, fit.correction, game.cup.rim_m, follow_from_s(motion))
        while not any(attempted) and len(attempted) < len(tau_scales):
            tau_scale = tau_scales[len(attempted)]
            self._imitate_once(fit.joints, tau_scale, "imitation", attempted, seen)
        while any(attempted) and len(progress.repeats) < settings.imitation_repeats:
            self._imitate_once(fit.joints, tau_scales[attempted.index(True)], "repeat", progress.repeats, seen)

    def _imitate_once(
        self, joints: JointTrajectory, tau_scale: float, phase: str, results: list[bool], seen: VisualImitation | None
    ) -> None:
        """Play once and append to ``results`` whether it caught."""
        seed = int(self._progress.rng(phase, len(results)).integers(2**63))
        played = play_motion(self._runner.robot, joints, tau_scale=tau_scale, seed=seed, seen=seen)
        timed = trace.timed(played.exchanges, self._progress.clock_s)
        messages = [*self._session.scene(timed, under="/transfer/imitation"), *self._session.exchanges(timed)]
        results.append(played.caught(self._arm, self._runner.game))
        if self._progress.servo is None:
            self._progress.servo = servo_of(self._arm, played.exchanges, self._runner.robot.period_s)
            self._leading.lead(self._progress.servo)
        self._session.finish(messages, played.exchanges[-1].t_s, phase=phase, caught=int(results[-1]))
