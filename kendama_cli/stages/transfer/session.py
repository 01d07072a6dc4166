"""Steps of one transfer on an opened robot (evaluate, learn, play), each logged and saved at once."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import partial

import numpy as np

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.artifacts.proportion import Evaluation
from kendama_cli.control.camera_solids import camera_solids
from kendama_cli.control.game_runner import GameRunner
from kendama_cli.control.scene_history import cup_rotation_wxyz
from kendama_cli.control.settings import TransferSettings
from kendama_cli.devices.robot.exchange_log import RememberingRobot
from kendama_cli.devices.robot.interface import Exchange
from kendama_cli.learning.learners import make_policy
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.robot_model.arm_scene import ArmScene
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.foxglove import SceneUpdate
from kendama_cli.settings.camera import CameraSettings
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.hardware import HardwareSettings
from kendama_cli.stages.interface import StageContext
from kendama_cli.stages.transfer import trace
from kendama_cli.stages.transfer.progress import GameFigures, Progress, Start
from kendama_cli.stages.transfer.trace import imperfection, replay_message

_LEARNING: dict[Start, tuple[str, str]] = {
    "table": ("learn", "/transfer/rollout"),
    "scratch": ("scratch", "/transfer/scratch/rollout"),
}
"""Name and topic of the two ways to learn on the hardware."""
HORIZON_S = 0.1
"""The prediction error of a game is that of the estimate this long before the catch."""


class TransferSession:
    """Each step begins where ``progress`` stands, and ends when it has what the settings want."""

    def __init__(
        self,
        runner: GameRunner,
        progress: Progress,
        ctx: StageContext,
        *,
        settings: TransferSettings,
        learn: LearnSettings,
        arm: RobotModel,
        kept: RememberingRobot,
    ) -> None:
        """Take ``kept``, the robot below the runner's, which remembers what is not logged yet."""
        self._runner, self._arm, self._kept = runner, arm, kept
        self._drawn = ArmScene(arm)
        self._progress = progress
        self._ctx = ctx
        self._settings = settings
        self._learn = learn
        self._every = max(1, round(settings.log_period_s / runner.robot.period_s))

    def show(self, game: GameSettings, cameras: CameraSettings | None) -> None:
        """Log what the arm, its cup, the ball of ``game`` and the cameras look like; once, before anything moves."""
        solids = self._drawn.shapes(game).solids
        history = self._runner.history
        if cameras is not None and history is not None:
            solids = (*solids, *camera_solids(cameras, history.origin_m, self._drawn.holder))
        self._ctx.log.write("/transfer/scene", self._progress.clock_s, SceneUpdate(solids))

    def learn_and_play(self, policy: PolicyArtifact, settings: GameSettings, hardware: HardwareSettings) -> None:
        """Evaluate ``policy``, learn on, evaluate again, and play full games; ``hardware`` is what was opened."""
        progress = self._progress
        self.evaluate(progress.before, policy, "before")
        self.learn("table")
        self.evaluate(progress.after, progress.policy, "after")
        if self._settings.baseline:
            self.learn("scratch")
        self.play(progress.kept(policy), settings, hardware)

    def evaluate(self, results: list[bool], policy: PolicyArtifact, name: str) -> None:
        """Run rollouts of the frozen policy and append to ``results`` whether each reached the goal."""
        while len(results) < self._settings.evaluation_rollouts:
            rng = self._progress.rng(name, len(results))
            actor = make_policy(policy, self._learn)
            swing = self._runner.swing_up(actor, seed=int(rng.integers(2**63)))
            start_s = self._progress.clock_s
            messages = [
                *trace.step_messages(swing.steps, 0, start_s, self._every),
                *self.exchanges([(start_s + step.t_s, step.exchange) for step in swing.steps]),
            ]
            results.append(swing.outcome == "goal")
            self.finish(messages, swing.duration_s, phase=name, success_rate=float(np.mean(results)))

    def learn(self, start: Start) -> None:
        """Learn, from the table or from scratch, until the streak of greedy successes, or the cap."""
        progress = self._progress
        phase, topic = _LEARNING[start]
        while not progress.frozen(start):
            learner = progress.learner(start)
            rng = progress.rng(phase, learner.count.rollouts)
            seed = int(rng.integers(2**63))
            learner.begin_rollout(rng)
            swing = self._runner.swing_up(learner, seed=seed)
            finished = learner.end_rollout(swing.outcome, swing.last)
            progress.keep(learner, start)
            start_s = progress.clock_s
            messages = [
                trace.rollout_message(topic, swing, finished, start_s),
                *self.exchanges([(start_s + step.t_s, step.exchange) for step in swing.steps]),
            ]
            if start == "table":
                messages += trace.step_messages(swing.steps, finished.index, start_s, self._every)
            self.finish(messages, swing.duration_s, phase=phase, rollouts=finished.index, streak=learner.count.streak)

    def play(self, policy: PolicyArtifact, settings: GameSettings, hardware: HardwareSettings) -> None:
        """Play full games of the frozen policy; ``hardware`` is what the robot was opened as."""
        progress, evaluation = self._progress, Evaluation(self._settings.games, self._settings.thorough)
        while evaluation.to_play(sum(one.caught for one in progress.games), len(progress.games)):
            index = len(progress.games)
            seed = int(progress.rng("game", index).integers(2**63))
            game = self._runner.play(make_policy(policy, self._learn), seed=seed, pictured=index == 0)
            steps = [*game.swing.steps, *game.steps]
            start_s = progress.clock_s
            timed = [(start_s + step.t_s, step.exchange) for step in steps]
            messages = [
                *trace.step_messages(steps, -1 - index, start_s, self._every),
                *self.scene(timed, under="/transfer"),
                *self.exchanges(timed),
                *trace.game_messages(game, index, start_s, HORIZON_S),
            ]
            if self._runner.history is not None:
                made = imperfection(hardware)
                again = replay_message(index, game, steps, self._runner.history, settings, made=made)
                messages.append(("/transfer/replay", start_s, again))
            progress.games.append(GameFigures.of(game, HORIZON_S))
            self.finish(messages, steps[-1].t_s, phase="games", caught=sum(one.caught for one in progress.games))

    def scene(self, timed: Sequence[tuple[float, Exchange]], *, under: str) -> Iterator[trace.TimedMessage]:
        """Yield links, wrench, cup and ball of a rollout under the topic ``under``."""
        names, rotation = self._runner.robot.joint_names, partial(cup_rotation_wxyz, self._arm)
        frames = self._drawn.frames
        return trace.scene_messages(timed, names, self._every, cup_rotation=rotation, links=frames, under=under)

    def exchanges(self, timed: Sequence[tuple[float, Exchange]]) -> Iterator[trace.TimedMessage]:
        """Yield commands and measurements of a rollout."""
        return trace.exchange_messages(timed, self._runner.robot.joint_names)

    def finish(
        self,
        messages: Iterable[trace.TimedMessage],
        duration_s: float,
        *,
        durable: bool = False,
        **figures: float | int | str,
    ) -> None:
        """Log a whole rollout at once and save; ``durable``: in any case, as it must not be played twice."""
        self._log(messages)
        self._kept.forget()
        self._progress.finished(duration_s, self._runner.robot.missed)
        self._ctx.progress(self._progress.count, None, **figures)
        self._ctx.checkpoint(self._progress.saved, force=durable)

    def note(self, messages: Iterable[trace.TimedMessage]) -> None:
        """Log what was told after a rollout, and save."""
        self._log(messages)
        self._ctx.checkpoint(self._progress.saved, force=True)

    def log_broken_off(self) -> None:
        """Log what was played of a rollout that did not end: what was sent and measured, and the scene."""
        timed = trace.timed(self._kept.played, self._progress.clock_s)
        self._log([*self.scene(timed, under="/transfer"), *self.exchanges(timed)])

    def _log(self, messages: Iterable[trace.TimedMessage]) -> None:
        for topic, t_s, message in sorted(messages, key=lambda item: item[1]):
            self._ctx.log.write(topic, t_s, message)
