"""Attempts at the imitation: what is played next, what counts for the aim, and what is safe."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from kendama_cli.adaptation.aim import Aim
from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.artifacts.servo_model import ServoModel
from kendama_cli.control.settings import TransferSettings
from kendama_cli.errors import StageError
from kendama_cli.stages.transfer.imitating import (
    ImitationSession,
    _Attempts,
    _Playable,
    attempt_message,
    imitation_over,
)
from kendama_cli.stages.transfer.progress import AttemptFigures, Progress, UntoldRollout
from kendama_cli.stages.transfer.results import warnings
from tests.control.test_games import LEARN, TRANSFER
from tests.identification.test_servo import ARM, leading, played
from tests.stages.transfer.test_progress import POLICY

MISSED = AttemptFigures(None, (0.0, 0.0), False, (-0.1, 0.02), 0.2, led=True)
CAUGHT = dataclasses.replace(MISSED, along_m=0.1, shift_m=(0.01, 0.0), caught=True, miss_m=(0.0, 0.0))
JOINTS = JointTrajectory(("a",), np.arange(3.0), *(np.zeros((3, 1)),) * 3)


class FakeAims:
    """Aims whose motions stand for their own ``along_m``; ``next`` moves by what was missed last."""

    path_m = (-0.2, 0.2)

    def next(self, played: Sequence[AttemptFigures], rope_scale: float, servo: ServoModel | None) -> Aim:
        last = played[-1]
        assert last.miss_m is not None
        return Aim(-last.miss_m[0] / rope_scale)

    def aim(self, one: AttemptFigures) -> Aim:
        assert one.along_m is not None
        return Aim(one.along_m, one.shift_m, one.bent)

    def nearer(self, aim: Aim, halvings: int) -> Aim:
        return Aim(aim.along_m / 2**halvings)

    def joints(self, aim: Aim, rope_scale: float) -> tuple[Aim, JointTrajectory, float]:
        return aim, dataclasses.replace(JOINTS, position_rad=np.full((3, 1), aim.along_m)), 1.1


class FakeSurroundings:
    """Room for motions up to ``room_m``."""

    def __init__(self, room_m: float) -> None:
        self.room_m = room_m

    def correction(self, joints: JointTrajectory, from_s: float) -> tuple[str, tuple[str, ...]]:
        if joints.position_rad.max() > self.room_m:
            raise StageError("not safe")
        return "kept", ()


def attempts(room_m: float = 1.0, *, aims: Any = FakeAims()) -> _Attempts:
    planned = _Playable(None, JOINTS, cast("Any", "planned"), 0.5)
    return _Attempts(planned, None if aims is None else lambda: aims, cast("Any", FakeSurroundings(room_m)), 1.0)


def test_the_planned_motion_comes_first_and_again_once_the_servo_leads() -> None:
    first = attempts().next([])
    assert first.aim is None
    before = dataclasses.replace(MISSED, led=False)
    chosen = attempts().next([before])
    assert chosen.aim is None, "what was missed before the servo was known says nothing of the motion"


@pytest.mark.parametrize(("delay_s", "aimed"), [(0.03, True), (0.1, False)])
def test_a_miss_before_the_servo_was_known_counts_where_it_is_fast(delay_s: float, aimed: bool) -> None:
    before = dataclasses.replace(MISSED, led=False)
    none = np.zeros(1)
    servo = ServoModel(("a",), 0.01, none + delay_s - 0.01, none, none, none)
    assert (attempts().next([before], servo).aim == Aim(0.1)) == aimed
    assert attempts().next([dataclasses.replace(before, outcome="short")], servo).aim is None


def test_a_miss_aims_the_next_attempt() -> None:
    chosen = attempts().next([MISSED])
    assert chosen.aim == Aim(0.1)
    assert chosen.joints.position_rad.max() == pytest.approx(0.1)
    assert chosen.from_s == pytest.approx(0.55), "the visual catch begins at the stretched time"


@pytest.mark.parametrize(("room_m", "expected_m"), [(0.06, 0.05), (0.03, 0.025)])
def test_a_motion_that_is_not_safe_is_brought_nearer_to_the_plan(room_m: float, expected_m: float) -> None:
    chosen = attempts(room_m).next([MISSED])
    assert chosen.aim == Aim(expected_m)


def test_where_nothing_else_is_safe_the_plan_is_played() -> None:
    chosen = attempts(0.001).next([MISSED])
    assert chosen.aim is None


def test_a_miss_that_nobody_measured_aims_nothing_unless_words_tell_it() -> None:
    unseen = dataclasses.replace(MISSED, apex_m=None)
    chosen, told = attempts().next([unseen]), attempts().next([dataclasses.replace(unseen, outcome="short")])
    assert (chosen.aim, told.aim) == (None, Aim(0.1))


def test_without_aims_the_plan_is_repeated() -> None:
    chosen = attempts(aims=None).next([MISSED, MISSED])
    assert chosen.aim is None


def test_what_caught_is_played_again() -> None:
    assert attempts().again(CAUGHT).joints.position_rad.max() == pytest.approx(0.1)
    assert attempts().again(MISSED).aim is None


@functools.cache
def settings() -> TransferSettings:
    return dataclasses.replace(TRANSFER, imitation_attempts=3, imitation_repeats=2)


def test_the_imitation_is_over_after_its_attempts_or_its_repeats() -> None:
    progress = Progress.resumed(None, POLICY, LEARN, settings(), np.random.default_rng(1))
    progress.attempts = [MISSED, MISSED]
    assert not imitation_over(progress, settings())
    progress.attempts = [MISSED] * 3
    assert imitation_over(progress, settings())
    progress.attempts = [MISSED, CAUGHT]
    assert not imitation_over(progress, settings())
    progress.repeats = [True, False]
    assert imitation_over(progress, settings())


def test_attempts_survive_a_checkpoint() -> None:
    progress = Progress.resumed(None, POLICY, LEARN, settings(), np.random.default_rng(1))
    progress.attempts = [dataclasses.replace(MISSED, miss_m=None, led=False), CAUGHT]
    progress.untold = UntoldRollout("repeat", dataclasses.replace(CAUGHT, apex_m=None, path_m=(-0.2, 0.2)), 17)
    assert not imitation_over(progress, settings()), "its outcome is still to be told"
    again = Progress.resumed(progress.saved(), POLICY, LEARN, settings(), np.random.default_rng(2))
    assert (again.attempts, again.untold) == (progress.attempts, progress.untold)
    assert again.imitation == [False, True]


def test_a_ball_that_never_came_down_is_logged_as_nan() -> None:
    message = attempt_message(2, dataclasses.replace(MISSED, miss_m=None))
    assert (message.index, message.led) == (2, True)
    assert np.isnan([message.miss_x_m, message.miss_y_m, message.along_m]).all()


@pytest.mark.parametrize(("lag_s", "same"), [(0.12, True), (0.09, False), (None, False)])
def test_the_first_play_checks_the_servo_that_was_identified(lag_s: float | None, same: bool) -> None:
    """The arm follows 0.12 s late after a dead time of 10 ms."""
    robot = leading(0.12, 0.010)
    each = None if lag_s is None else np.full(7, lag_s)
    none = np.zeros(7)
    identified = None if each is None else ServoModel(robot.joint_names, 0.012, each, none + 1e-4, none, none)
    robot.lead(identified)
    progress = Progress.resumed(None, POLICY, LEARN, settings(), np.random.default_rng(1))
    session = ImitationSession(
        cast("Any", None),
        cast("Any", SimpleNamespace(robot=robot)),
        progress,
        settings=settings(),
        arm=ARM,
        leading=robot,
        told=None,
    )
    assert robot.servo is identified
    assert session._identify(played(robot)) == same, "a miss under another servo says nothing of the motion"
    assert progress.servo is not None
    assert progress.servo.delay_s == pytest.approx(0.13, abs=0.004)
    assert (progress.servo is identified) == same
    assert robot.servo is progress.servo
    told = list(warnings(progress, identified))
    assert bool(told) == (lag_s == 0.09)
    assert all("late, 0.102 s when it was identified; commands lead by what was found now" in line for line in told)
