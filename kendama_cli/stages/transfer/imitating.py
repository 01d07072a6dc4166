"""The demonstrated swing on the robot: plays until it catches, and then to tell how often it does."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from kendama_cli.adaptation.settings import CorrectionSettings
from kendama_cli.artifacts.motion_plan import CatchMotion, JointTrajectory
from kendama_cli.artifacts.proportion import Evaluation
from kendama_cli.artifacts.servo_model import ServoModel
from kendama_cli.control.flight_observer import WatchedFlight
from kendama_cli.control.game_runner import GameRunner
from kendama_cli.control.imitation import Played, VisualImitation, fitted, play_motion
from kendama_cli.control.reachable import Surroundings, follow_from_s
from kendama_cli.control.settings import TransferSettings
from kendama_cli.devices.robot.leading import LeadingRobot
from kendama_cli.errors import StageError
from kendama_cli.identification.kept_servo import servo_message
from kendama_cli.identification.servo import servo_changed, servo_of
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.settings.game import GameSettings
from kendama_cli.stages.transfer import trace
from kendama_cli.stages.transfer.messages import ImitationMessage
from kendama_cli.stages.transfer.outcome import ToldOutcomes
from kendama_cli.stages.transfer.progress import AttemptFigures, Progress, RopeFitFigures, UntoldRollout
from kendama_cli.stages.transfer.session import TransferSession

if TYPE_CHECKING:  # it needs the simulator, which a policy alone does not
    from kendama_cli.adaptation.aim import Aim
    from kendama_cli.stages.transfer.aiming import ImitationAims

HALVINGS = 4
"""A change of the motion that is not safe is halved so often, then left out."""

MAX_UNLED_S = 0.04
"""A play that no servo led counts up to this delay: of a larger one the miss has so large a share (0.19 m at 60 ms)
that an error of a tenth would lose the next catch.
"""


def imitation_over(progress: Progress, settings: TransferSettings) -> bool:
    """Return True if nothing is left to play: caught and repeated, or attempted as often as allowed."""
    if progress.untold is not None:
        return False
    if any(progress.imitation):
        repeats = Evaluation(settings.imitation_repeats, settings.thorough)
        return not repeats.to_play(sum(progress.repeats), len(progress.repeats))
    return len(progress.attempts) >= settings.imitation_attempts


class ImitationSession:
    """Plays of one motion in ``session``; its first play tells the servo by which ``leading`` then leads all commands.

    A servo by which ``leading`` leads already is checked by that play. The session resumes where ``progress`` stands.
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
        told: ToldOutcomes | None,
    ) -> None:
        """Take what tells the outcomes, None where they are measured."""
        self._told, self._identified = told, leading.servo
        self._session, self._runner, self._progress = session, runner, progress
        self._settings, self._arm, self._leading = settings, arm, leading
        leading.lead(progress.servo or leading.servo)

    def imitate(self, motion: CatchMotion, around: Surroundings, aims: Callable[[], ImitationAims] | None) -> None:
        """Play the imitation motion, fitted to the rope, until it catches, aimed by what was missed before.

        ``aims`` simulates the motions that an aim chooses among, at the first miss; without it the motion is played as
        planned. After a catch that motion is played again, to tell how often it does.
        """
        if imitation_over(self._progress, self._settings):
            return
        progress, game = self._progress, around.game
        seed = int(progress.rng("rope", 0).integers(2**63))
        known = None if progress.rope_fit is None else progress.rope_fit.rope_scale
        fit = fitted(self._runner.robot, motion, around, seed=seed, rope_scale=known)
        progress.rope_fit = RopeFitFigures(fit.rope_scale, fit.resized)
        planned = _Playable(None, fit.joints, fit.correction, follow_from_s(motion))
        attempts = _Attempts(planned, aims, around, fit.rope_scale if fit.resized else 1.0)
        while not imitation_over(progress, self._settings):
            if progress.untold is not None:
                self._tell(progress.untold)
                continue
            caught = [one for one in progress.attempts if one.caught]
            if caught:
                playable = attempts.again(caught[0])
                self._play(playable, "repeat", len(progress.repeats), game, around.adapt.catch == "visual")
                continue
            chosen = attempts.next(progress.attempts, None if self._identified else progress.servo)
            self._play(chosen, "imitation", len(progress.attempts), game, around.adapt.catch == "visual")

    def _play(self, chosen: _Playable, phase: str, index: int, game: GameSettings, visual: bool) -> None:
        """Play ``chosen`` once, and log and keep what came of it."""
        progress, runner, arm = self._progress, self._runner, self._arm
        seed = int(progress.rng(phase, index).integers(2**63))
        since = 0 if self._told is None else self._told.mark()
        seen = None
        if visual:
            watched = WatchedFlight(runner.observer.without_goal())
            seen = VisualImitation(watched, arm, chosen.correction, game.cup.rim_m, chosen.from_s)
        played = play_motion(runner.robot, chosen.joints, tau_scale=1.0, seed=seed, seen=seen)
        timed = trace.timed(played.exchanges, progress.clock_s)
        messages = [*self._session.scene(timed, under="/transfer/imitation"), *self._session.exchanges(timed)]
        found = progress.servo is None
        led = self._identify(played)
        if found and progress.servo is not None:
            messages.append(("/transfer/servo", timed[-1][0], servo_message(progress.servo)))
        aim = chosen.aim
        figures = AttemptFigures(
            along_m=None if aim is None else aim.along_m,
            shift_m=(0.0, 0.0) if aim is None else aim.shift_m,
            caught=self._told is None and played.caught(arm, runner.game),
            miss_m=None if self._told is not None else played.miss_m(arm, runner.game, from_plan=visual),
            apex_m=None if math.isnan(played.apex_m) else played.apex_m - game.cup.rim_m,
            led=led,
            path_m=chosen.path_m,
            bent=() if aim is None else aim.bent,
        )
        if self._told is None:
            messages += self._conclude(phase, figures, timed[-1][0])
        else:
            progress.untold = UntoldRollout(phase, figures, since)
        duration_s = played.exchanges[-1].t_s
        self._session.finish(messages, duration_s, durable=True, phase=phase, caught=int(figures.caught))

    def _tell(self, untold: UntoldRollout) -> None:
        """Wait until the outcome of the newest rollout is told."""
        progress = self._progress
        assert self._told is not None
        outcome = self._told.wait(len(progress.attempts) + len(progress.repeats) + 1, untold.since)
        progress.untold = None
        figures = dataclasses.replace(untold.figures, caught=outcome.caught, outcome=outcome.text)
        self._session.note(self._conclude(untold.phase, figures, progress.clock_s))

    def _conclude(self, phase: str, figures: AttemptFigures, t_s: float) -> list[trace.TimedMessage]:
        """Keep what came of a rollout, and return the message that says it."""
        progress = self._progress
        if phase == "repeat":
            progress.repeats.append(figures.caught)
            return []
        progress.attempts.append(figures)
        return [("/transfer/imitation/rollout", t_s, attempt_message(len(progress.attempts) - 1, figures))]

    def _identify(self, played: Played) -> bool:
        """Find or check the servo in the first play; return True if ``played`` was led as later commands will be."""
        progress, identified = self._progress, self._identified
        if progress.servo is not None:
            return True
        found = servo_of(self._arm, played.exchanges, self._runner.robot.period_s)
        if found is None:
            same = True
        elif identified is None:
            same = found.follows
        else:
            same = not servo_changed(identified, found)
        progress.servo = (identified or found) if same else found
        self._leading.lead(progress.servo)
        return same


@dataclass(frozen=True)
class _Playable:
    """Motion that is safe to play, with the aim that it is for, None as planned, and the bounds of its visual catch."""

    aim: Aim | None
    joints: JointTrajectory
    correction: CorrectionSettings
    from_s: float
    path_m: tuple[float, ...] = ()


@dataclass(frozen=True)
class _Attempts:
    """Choice of the attempts about the ``planned`` motion on a rope ``rope_scale`` times the model's."""

    planned: _Playable
    aims: Callable[[], ImitationAims] | None
    around: Surroundings
    rope_scale: float

    def next(self, played: Sequence[AttemptFigures], servo: ServoModel | None = None) -> _Playable:
        """Return the motion to play after the attempts ``played``, of which the first may have been unled by ``servo``.

        Without one of at most MAX_UNLED_S, or told in words, an attempt that was not led counts for nothing.
        """
        known = servo is not None and servo.delay_s <= MAX_UNLED_S
        counted = [one for one in played if one.led or (known and not one.outcome)]
        told = [one for one in counted if one.outcome or one.apex_m is not None]
        if self.aims is None or not told:
            return self.planned
        aims = self.aims()
        return self._safe(aims, aims.next(told, self.rope_scale, servo))

    def again(self, one: AttemptFigures) -> _Playable:
        """Return the motion of an attempt."""
        if one.along_m is None or self.aims is None:
            return self.planned
        aims = self.aims()
        return self._safe(aims, aims.aim(one))

    def _safe(self, aims: ImitationAims, aim: Aim) -> _Playable:
        """Return the motion of ``aim``, nearer to the planned one where links, table, room or limits ask for it."""
        for halvings in range(HALVINGS):
            try:
                nearer, joints, tau_scale = aims.joints(aims.nearer(aim, halvings), self.rope_scale)
                from_s = self.planned.from_s * tau_scale
                correction, _ = self.around.correction(joints, from_s)
            except StageError:
                continue
            return _Playable(nearer, joints, correction, from_s, aims.path_m)
        return self.planned


def attempt_message(index: int, one: AttemptFigures) -> ImitationMessage:
    """Return an attempt for the log."""
    miss_x, miss_y = (math.nan, math.nan) if one.miss_m is None else one.miss_m
    apex_m = math.nan if one.apex_m is None else one.apex_m
    along_m = math.nan if one.along_m is None else one.along_m
    return ImitationMessage(
        index, along_m, *one.shift_m, one.caught, miss_x, miss_y, apex_m, one.led, one.outcome, one.path_m, one.bent
    )
