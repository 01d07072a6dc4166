"""The twin by the wall clock, alone in a file that runs with the others of real time."""

from __future__ import annotations

import dataclasses
import time

import pytest

from kendama_cli.devices.robot.open_robot import open_robot
from tests.faults.test_twin_process import GAME, ROBOT, TWIN, session


@pytest.mark.realtime
def test_in_real_time_the_twin_runs_by_the_wall_clock() -> None:
    hardware = dataclasses.replace(TWIN, realtime=True, watchdog_s=5.0)
    with open_robot(hardware, ROBOT, GAME) as robot:
        assert robot.realtime
        begin = time.monotonic()
        told = session(robot, 1)
        took_s = time.monotonic() - begin
    # longer than the periods that were commanded where this machine stalled a process, never longer than it took
    assert 100 * TWIN.control_period_s - 0.01 <= told[-1].t_s <= took_s + 0.01
