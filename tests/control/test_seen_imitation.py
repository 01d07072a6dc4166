"""An imitated swing on a robot that is not as its model says: as planned, and with the ball seen by tracking."""

from __future__ import annotations

import dataclasses
import functools

from kendama_cli.control.flight_observer import MarkerObserver, ObservationLog, WatchedFlight
from kendama_cli.control.imitation import Played, VisualImitation, play_motion
from kendama_cli.control.position_tracker import PositionTracker
from kendama_cli.devices.robot.simulated import SimulatedRobot
from kendama_cli.settings.hardware import TwinHardware
from kendama_cli.vision.settings import PredictSettings
from tests.control.observed_games import TRANSFER
from tests.control.seen_swings import ADAPT, swing
from tests.shipped_conf import configured
from tests.simulation.dart.bench_robot import bench_arm, kendama_game

PREDICT: PredictSettings = configured(PredictSettings, "predict", "flights")
TWIN: TwinHardware = configured(TwinHardware, "hardware", "twin")
AIRY = dataclasses.replace(TWIN.imperfection, rope_scale=1.0, drag_scale=3.0)
"""The default twin with the model's rope in three times the air."""


@functools.cache
def played(*, seen: bool) -> tuple[Played, ObservationLog]:
    """The swing on that twin."""
    made, game = swing(), kendama_game()
    rim_m = made.arm.tool_position_m(made.joints.position_rad[-1])[2] + game.cup.rim_m
    sigma_m = TRANSFER.observation.position_sigma_m
    tracker = PositionTracker(PREDICT.onset, PREDICT.motion, game, rim_height_m=rim_m, sigma_m=[sigma_m] * 3)
    eyes = MarkerObserver(tracker, TRANSFER.observation, rim_m=rim_m, catch_m=rim_m).without_goal()
    robot = SimulatedRobot(bench_arm(), game, imperfection=AIRY, control_period_s=TWIN.control_period_s)
    watching = VisualImitation(WatchedFlight(eyes), made.arm, ADAPT.correction, game.cup.rim_m, 0.0)
    return play_motion(robot, made.joints, tau_scale=1.0, seed=10000, seen=watching if seen else None), eyes.observed


def test_what_three_times_the_air_spoils_is_caught_when_the_ball_is_tracked() -> None:
    made, game = swing(), kendama_game()
    assert not played(seen=False)[0].caught(made.arm, game)
    assert played(seen=True)[0].caught(made.arm, game)


def test_free_flight_is_found_in_the_tracked_positions_alone() -> None:
    """The ball is then beside the cup or above it, and rises."""
    caught, observed = played(seen=True)
    assert observed.free_s is not None
    at = next(one for one in caught.exchanges if one.t_s >= observed.free_s)
    assert at.state.ball_in_world_m[2] > at.state.cup_in_world_m[2]


def test_until_then_the_robot_is_sent_the_plan() -> None:
    (as_planned, _), (seen, observed) = played(seen=False), played(seen=True)
    assert observed.free_s is not None
    for one, other in zip(as_planned.exchanges, seen.exchanges, strict=True):
        if one.t_s > observed.free_s:
            break
        assert one.sent.position_rad.tolist() == other.sent.position_rad.tolist()
