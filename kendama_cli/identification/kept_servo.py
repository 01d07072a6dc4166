"""The arm's servo as an earlier stage has logged it, for a later one to lead by from its first command on."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePath
from typing import Any

import numpy as np

from kendama_cli.artifacts.servo_model import ServoModel
from kendama_cli.errors import InputError, StageError
from kendama_cli.log.messages import ServoMessage
from kendama_cli.log.reader import LogFile
from kendama_cli.settings.hardware import HardwareSettings
from kendama_cli.settings.robot import RobotSettings


def servo_message(servo: ServoModel) -> ServoMessage:
    """Return ``servo`` for the log."""
    arrays = (servo.lag_s, servo.lag_sigma_s, servo.sag_rad_nm, servo.offset_rad)
    return ServoMessage(servo.joint_names, servo.dead_time_s, *arrays)


def kept_servo(file: str, robot: RobotSettings, hardware: HardwareSettings) -> ServoModel:
    """Return the last servo in the log ``file`` of a stage that ran on the arm ``robot``, opened as ``hardware``.

    Raises InputError for a log without a servo, StageError for one of another arm: of another name or robot
    description, or hardware of another kind, address or model.
    """
    topics = tuple(one for one in LogFile(file, topics=()).topics if one.endswith("/servo"))
    log = LogFile(file, topics)
    settings = log.stage.get("settings", {})
    if not topics or not settings.keys() >= {"robot", "hardware"}:
        raise InputError(file, "it has no servo", remedy="name a stage that has imitated or identified, or null")
    before, now = _arm(settings["robot"], settings["hardware"]), _arm(vars(robot), vars(hardware))
    if before != now:
        raise StageError(
            f"transfer.servo is of {before}, and this arm is {now}; name a run of this arm, or null; nothing was moved"
        )
    last = log.messages(topics[0], ServoMessage).messages[-1]
    arrays = (np.array(one) for one in (last.lag_s, last.lag_sigma_s, last.sag_rad_nm, last.offset_rad))
    return ServoModel(tuple(last.joints), last.dead_time_s, *arrays)


def _arm(robot: Mapping[str, Any], hardware: Mapping[str, Any]) -> str:
    """Return the arm that settings name; numbers of the hardware say how it is talked to, files go by their names."""
    fields = sorted(hardware.items(), key=lambda field: (field[0] != "kind", field[0]))  # logs sort them by name
    words = [PurePath(value).name for _, value in fields if isinstance(value, str)]
    return f"'{robot['name']}' of {PurePath(robot['path']).name} on {', '.join(words)}"
