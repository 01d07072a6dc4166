"""The servo in an earlier stage's log: it comes back as it was, and only for the arm that it is of."""

from __future__ import annotations

import dataclasses
from pathlib import Path, PurePath
from typing import Any

import numpy as np
import pytest

from kendama_cli.artifacts.servo_model import ServoModel
from kendama_cli.errors import InputError, StageError
from kendama_cli.identification.kept_servo import kept_servo, servo_message
from tests.log.made_logs import memory_log
from tests.stages.transfer_setup import ROBOT, TWIN

JOINTS = ("a", "b")
SERVO = ServoModel(JOINTS, -0.002, *(np.array([k, k + 0.5]) for k in (0.1, 1e-4, 5e-4, 0.01)))
PLAIN = {"robot": {"name": ROBOT.name, "path": PurePath(ROBOT.path).name}, "hardware": {"kind": "twin"}}


def logged(path: Path, stage: str = "transfer", settings: dict[str, Any] = PLAIN, *servos: ServoModel) -> str:
    log = memory_log()
    for k, servo in enumerate(servos):
        log.write(f"/{stage}/servo", float(k), servo_message(servo))
    log.finish(path, stage=stage, settings=settings, metrics={})
    return str(path)


@pytest.mark.parametrize("stage", ["transfer", "identify"])
def test_the_last_servo_comes_back_as_it_was(tmp_path: Path, stage: str) -> None:
    earlier = dataclasses.replace(SERVO, dead_time_s=0.01)
    found = kept_servo(logged(tmp_path / "log.mcap", stage, PLAIN, earlier, SERVO), ROBOT, TWIN)
    for field in dataclasses.fields(ServoModel):
        assert np.array_equal(getattr(found, field.name), getattr(SERVO, field.name)), field.name


@pytest.mark.parametrize(
    ("node", "other", "says"),
    [
        ("robot", {"name": "panda"}, "transfer.servo is of 'panda' of pa10"),
        ("robot", {"path": "long.urdf"}, "of long.urdf on twin, and this arm is 'pa10' of pa10"),
        ("hardware", {"kind": "mujoco", "model": "arm.xml"}, "on mujoco, arm.xml, and this arm is"),
        ("hardware", {"host": "10.0.0.2"}, "on twin, 10.0.0.2, and this arm is"),
    ],
)
def test_that_of_another_arm_is_refused(tmp_path: Path, node: str, other: dict[str, Any], says: str) -> None:
    settings = {**PLAIN, node: {**PLAIN[node], **other}}
    with pytest.raises(StageError, match=says) as caught:
        kept_servo(logged(tmp_path / "log.mcap", "transfer", settings, SERVO), ROBOT, TWIN)
    assert str(caught.value).endswith("name a run of this arm, or null; nothing was moved")


def test_numbers_of_the_hardware_make_no_other_arm(tmp_path: Path) -> None:
    settings = {**PLAIN, "hardware": {**PLAIN["hardware"], "control_period_s": 0.008}}
    kept_servo(logged(tmp_path / "log.mcap", "transfer", settings, SERVO), ROBOT, TWIN)


@pytest.mark.parametrize("settings", [PLAIN, {}])
def test_a_log_without_a_servo_is_one_clear_line(tmp_path: Path, settings: dict[str, Any]) -> None:
    servos = () if settings else (SERVO,)
    with pytest.raises(InputError, match="it has no servo; name a stage that has imitated or identified"):
        kept_servo(logged(tmp_path / "log.mcap", "transfer", settings, *servos), ROBOT, TWIN)
