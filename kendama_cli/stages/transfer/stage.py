"""Transfer: the policy and the primitive on the hardware, learned on, and full games played there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from typing import Any

import numpy as np

from kendama_cli.artifacts.motion_plan import CatchMotion
from kendama_cli.artifacts.policy import Policy
from kendama_cli.artifacts.transfer_result import TransferResult
from kendama_cli.devices.robot.compensated import compensated
from kendama_cli.devices.robot.interface import Exchange
from kendama_cli.devices.robot.open_robot import open_robot
from kendama_cli.errors import HardwareError
from kendama_cli.game.game_runner import GameRunner, make_catch_geometry
from kendama_cli.game.imitation import play_motion, tempos
from kendama_cli.game.open_observer import CameraSetup, check_cameras, open_observer
from kendama_cli.game.rope_fit import fitted, measured_rope_m
from kendama_cli.game.scene_history import SceneHistory, SceneRecordingRobot, cup_turn_wxyz, joint_places
from kendama_cli.game.settings import TransferSettings
from kendama_cli.game.stored_policy import load_policy
from kendama_cli.game.transfer_progress import Progress, Start
from kendama_cli.learning.policy import GreedyPolicy
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.verification import verify_policy
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.camera import CameraSettings, LightingSettings
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.hardware import HardwareSettings
from kendama_cli.settings.placement import placed
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.simulation.placement.placement import cup_line
from kendama_cli.stages.interface import Made, Metric, StageContext
from kendama_cli.stages.transfer import trace
from kendama_cli.vision.settings import PredictSettings

_LEARNING: dict[Start, tuple[str, str]] = {
    "table": ("learn", "/transfer/rollout"),
    "scratch": ("scratch", "/transfer/scratch/rollout"),
}
"""Name and topic of the two ways to learn on the hardware."""
HORIZON_S = 0.1
"""The prediction error of a game is that of the estimate this long before the catch."""


class Transfer:
    """Takes the Policy of ``learn`` and, where they are there, the CatchMotion of ``adapt`` and the FrictionModel of
    ``identify``; gives a TransferResult.
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
    ) -> None:
        self._sight = CameraSetup(camera, lighting, predict)
        self._settings = transfer
        self._hardware = hardware
        self._robot = robot
        self._game = game
        self._learn = learn

    def run(self, given: Mapping[str, Any], ctx: StageContext) -> Made:
        """Evaluate, learn on, evaluate again, imitate, play; what was learned survives whatever goes wrong.

        Raises StageError before anything moves where the Q-table does not fit, HardwareError where the line or the
        robot fails: the finished rollouts are kept, and the next run goes on from them.
        """
        settings = self._settings
        check_cameras(self._sight, settings.observation, realtime=False)  # the robot itself says so once it is open
        policy: Policy = load_policy(settings.policy) if settings.policy else given["learn"]
        verify_policy(policy, self._learn, settings.policy or "the stage 'learn'")
        progress = Progress.resumed(ctx.restore(), policy, self._learn, settings, ctx.rng("transfer"))
        motion: CatchMotion | None = given.get("adapt")
        placed_robot = self._robot if motion is None else placed(self._robot, motion.placement)
        line = cup_line(placed_robot, self._game, max(self._learn.workspace.half_width_m, settings.catch.half_width_m))
        arm = RobotModel(placed_robot, self._game.cup, self._game.gravity_m_s2)
        history = SceneHistory(partial(joint_places, arm), self._game.rope.length_m, self._origin_m(line.home_m))
        with ExitStack() as stack:
            bare = stack.enter_context(open_robot(self._hardware, placed_robot, self._game))
            check_cameras(self._sight, settings.observation, realtime=bare.realtime)
            robot = SceneRecordingRobot(compensated(bare, given.get("identify")), history)
            seed = int(progress.rng("body", 0).integers(2**63))
            history.rope_m = measured_rope_m(robot, line.home_rad, self._game, seed)
            court = make_catch_geometry(
                line.home_m,
                np.array([1.0, 0.0, 0.0]),
                self._game,
                settings.catch,
                rope_scale=history.rope_m / self._game.rope.length_m,
                period_s=robot.period_s,
            )
            ground = GameRunner(
                robot,
                line,
                court=court,
                flight_watch=stack.enter_context(
                    open_observer(
                        self._sight,
                        settings.observation,
                        self._game,
                        cup_place=arm.tool_place_m,
                        history=history,
                        court=court,
                    )
                ),
                game=self._game,
                learn=self._learn,
                settings=settings,
                arm=arm,
            )
            visit = _Visit(ground, progress, ctx, settings=settings, learn=self._learn, arm=arm)
            try:
                visit.evaluate(progress.before, policy, "before")
                visit.learn("table")
                visit.evaluate(progress.after, progress.policy, "after")
                if settings.baseline:
                    visit.learn("scratch")
                visit.imitate(motion, self._game)
                visit.play()
            except HardwareError:
                ctx.checkpoint(progress.saved, force=True)
                raise
        games = progress.games
        result = TransferResult(
            policy=progress.policy,
            rollouts=progress.rollouts(),
            imitation_caught=any(progress.imitation) if progress.imitation else None,
            games=len(games),
            caught=sum(bool(game["caught"]) for game in games),
        )
        return Made(result, _metrics(result, progress, baseline=settings.baseline))

    def _origin_m(self, middle_m: Array) -> Array:
        """Where the cameras' poses count from (3,)."""
        return middle_m if self._settings.observation.camera_origin == "court" else np.zeros(3)


class _Visit:
    """The steps of one visit to the robot; each begins where ``progress`` stands."""

    def __init__(
        self,
        ground: GameRunner,
        progress: Progress,
        ctx: StageContext,
        *,
        settings: TransferSettings,
        learn: LearnSettings,
        arm: RobotModel,
    ) -> None:
        self._ground, self._arm = ground, arm
        self._progress = progress
        self._ctx = ctx
        self._settings = settings
        self._learn = learn
        self._every = max(1, round(settings.log_period_s / ground.robot.period_s))

    def evaluate(self, results: list[bool], policy: Policy, name: str) -> None:
        """Rollouts of the frozen policy; appends whether each reached the goal."""
        while len(results) < self._settings.evaluation_n:
            rng = self._progress.rng(name, len(results))
            actor = GreedyPolicy(policy, self._learn)
            swing = self._ground.swing_up(actor, seed=int(rng.integers(2**63)))
            messages = trace.step_messages(swing.steps, 0, self._progress.clock_s, self._every)
            results.append(swing.outcome == "goal")
            self._finish(messages, swing.duration_s, phase=name, success_rate=float(np.mean(results)))

    def learn(self, start: Start) -> None:
        """Learn, from the table or from scratch, until the streak of greedy successes, or the cap."""
        progress = self._progress
        phase, topic = _LEARNING[start]
        while not progress.frozen(start):
            learner = progress.learner(start)
            rng = progress.rng(phase, learner.rollouts)
            seed = int(rng.integers(2**63))
            learner.begin_rollout(rng)
            swing = self._ground.swing_up(learner, seed=seed)
            finished = learner.end_rollout(swing.outcome, swing.last)
            progress.keep(learner, start)
            start_s = progress.clock_s
            messages = [trace.rollout_message(topic, swing, finished, start_s)]
            if start == "table":
                messages += trace.step_messages(swing.steps, finished.index, start_s, self._every)
            self._finish(messages, swing.duration_s, phase=phase, rollouts=finished.index, streak=learner.count.streak)

    def imitate(self, motion: CatchMotion | None, game: GameSettings) -> None:
        """Play the imitation motion, fitted to the rope, until it catches; at slightly other tempos after a miss."""
        tried = self._progress.imitation
        wanted = tempos(self._settings.imitation_tempo_step, self._settings.imitation_tries)
        if motion is None or any(tried) or len(tried) == len(wanted):
            return
        robot = self._ground.robot
        seed = int(self._progress.rng("rope", 0).integers(2**63))
        fit = fitted(robot, self._arm, motion.joints, game, seed)
        self._progress.imitation_fit = {"imitation_rope_scale": fit.rope_scale, "imitation_resized": fit.resized}
        while not any(tried) and len(tried) < len(wanted):
            seed = int(self._progress.rng("imitation", len(tried)).integers(2**63))
            played = play_motion(robot, fit.joints, tempo=wanted[len(tried)], seed=seed)
            start_s = self._progress.clock_s
            timed = [(start_s + exchange.t_s, exchange) for exchange in played.exchanges]
            messages = self._scene(timed, under="/transfer/imitation")
            tried.append(played.caught)
            self._finish(messages, played.exchanges[-1].t_s, phase="imitation", caught=int(played.caught))

    def play(self) -> None:
        """Full games with the policy as it stands."""
        progress = self._progress
        while len(progress.games) < self._settings.games:
            index = len(progress.games)
            seed = int(progress.rng("game", index).integers(2**63))
            game = self._ground.play(GreedyPolicy(progress.policy, self._learn), seed=seed, pictured=index == 0)
            steps = [*game.swing.steps, *game.steps]
            start_s = progress.clock_s
            timed = [(start_s + step.t_s, step.exchange) for step in steps]
            messages = [
                *trace.step_messages(steps, -1 - index, start_s, self._every),
                *self._scene(timed, under="/transfer"),
                *trace.game_messages(game, index, start_s, HORIZON_S),
            ]
            error_m = game.prediction_error_m(HORIZON_S)
            progress.games.append(
                {
                    "swung_up": game.swung_up,
                    "caught": game.caught,
                    "error_mm": None if error_m is None else 1e3 * error_m,
                    "frames": len(game.watched.frames),
                    "seen": game.watched.seen,
                    "latency_frames": game.watched.latency_frames,
                }
            )
            self._finish(messages, steps[-1].t_s, phase="games", caught=sum(one["caught"] for one in progress.games))

    def _scene(self, timed: Sequence[tuple[float, Exchange]], *, under: str) -> Iterator[trace.TimedMessage]:
        names, turn = self._ground.robot.joint_names, partial(cup_turn_wxyz, self._arm)
        return trace.scene_messages(timed, names, self._every, cup_turn=turn, under=under)

    def _finish(self, messages: Any, duration_s: float, **figures: float | int | str) -> None:
        """Log a whole rollout at once and save: nothing of an unfinished rollout is ever kept."""
        for topic, t_s, message in sorted(messages, key=lambda item: item[1]):
            self._ctx.log.write(topic, t_s, message)
        self._progress.finished(duration_s, self._ground.robot.missed)
        self._ctx.progress(self._progress.count, None, **figures)
        self._ctx.checkpoint(self._progress.saved)


def _metrics(result: TransferResult, progress: Progress, *, baseline: bool) -> dict[str, Metric]:
    errors = [game["error_mm"] for game in progress.games if game["error_mm"] is not None]
    frames = sum(game["frames"] for game in progress.games)
    latencies = [game["latency_frames"] for game in progress.games if game["latency_frames"] is not None]
    compared = {
        "rollouts_from_scratch": progress.rollouts("scratch"),
        "learned_from_scratch": progress.learned("scratch"),
    }
    return {
        "rollouts": result.rollouts,
        "learned": progress.learned(),
        **(compared if baseline else {}),
        "success_rate_before": float(np.mean(progress.before)),
        "success_rate_after": float(np.mean(progress.after)),
        "imitation_caught": result.imitation_caught,
        "imitation_tries": len(progress.imitation),
        **progress.imitation_fit,
        "games": result.games,
        "caught_rate": result.caught / result.games,
        "swung_up_rate": float(np.mean([game["swung_up"] for game in progress.games])),
        "prediction_error_mm_p50": float(np.median(errors)) if errors else None,
        "latency_frames_p95": max(latencies) if latencies else None,
        "seen_rate": sum(game["seen"] for game in progress.games) / frames if frames else None,
        "missed_packets": progress.missed,
    }
