"""An arm of Franka Robotics behind the robot's interface; the loop of one millisecond runs in a process of its own."""

from __future__ import annotations

import dataclasses
import importlib.util
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from multiprocessing.connection import Connection
from typing import Any, TypeVar

import numpy as np

from kendama_cli.devices.robot.interface import Exchange, JointCommand, RobotState
from kendama_cli.devices.robot.limiter import approach, check_command
from kendama_cli.errors import ConfigError, HardwareError, MissingPartError, install_line
from kendama_cli.plugins.franka.messages import (
    Begin,
    Done,
    Failure,
    Message,
    Recover,
    Stands,
    Wanted,
    decode,
    encode,
)
from kendama_cli.plugins.franka.process import LIBRARY
from kendama_cli.plugins.franka.rate_limit import RateLimits
from kendama_cli.plugins.franka.settings import FrankaHardware
from kendama_cli.robot_model.limits import JointLimits
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.robot import RobotSettings

JOINTS = 7
MOST_STEP_RAD = 0.1
"""A command so far from where the arm was sent last is a mistake, whatever the limits would make of it."""
_SETTLE_S = 2.0
_SETTLED_RAD = 0.005


@contextmanager
def open_franka(hardware: FrankaHardware, robot: RobotSettings, game: GameSettings) -> Iterator[FrankaRobot]:
    """Open the arm at ``hardware.host``; raises ConfigError, MissingPartError without the library, HardwareError."""
    if importlib.util.find_spec(LIBRARY) is None:
        raise MissingPartError(LIBRARY, f"hardware=franka needs {LIBRARY}: {install_line('franka')}")
    with closing(FrankaRobot(hardware, RobotModel(robot, game.cup, game.gravity_m_s2))) as made:
        yield made


Heard = TypeVar("Heard", Stands, Done)
BRAKING_S = 2.0
"""The process gets so long to brake the arm, once nobody commands any more."""


class ArmPipe:
    """Process of the arm and the pipe to it; the first failure stays, and every later call raises it."""

    def __init__(self, hardware: FrankaHardware) -> None:
        self._host = hardware.host
        self._failure: str | None = None
        ours, theirs = socket.socketpair()
        command = [sys.executable, "-m", "kendama_cli.plugins.franka.process", str(theirs.fileno())]
        self.process = subprocess.Popen(command, pass_fds=[theirs.fileno()])
        theirs.close()
        self._pipe: Connection[Any, Any] = Connection(ours.detach())

    def fail(self, problem: str) -> HardwareError:
        """Keep the first problem; the error to raise."""
        self._failure = self._failure or problem
        return HardwareError(self._failure)

    def order(self, said: Message) -> None:
        """Say it; raises HardwareError."""
        if self._failure is not None:
            raise HardwareError(self._failure)
        try:
            self._pipe.send_bytes(encode(said))
        except OSError:
            raise self.fail(self._last_words()) from None

    def hear(self, kind: type[Heard], wait_s: float) -> Heard:
        """Return the answer; raises HardwareError where it is a failure, of another kind, or missing."""
        try:
            if not self._pipe.poll(wait_s):
                raise self.fail(f"the arm at {self._host} said nothing for {wait_s:g} s")
            heard = decode(self._pipe.recv_bytes())
        except (EOFError, OSError):
            raise self.fail(self._last_words()) from None
        except HardwareError as error:
            raise self.fail(str(error)) from None
        if isinstance(heard, Failure):
            raise self.fail(heard.problem)
        if not isinstance(heard, kind):
            raise self.fail(f"the process that moves the arm said {type(heard).__name__} out of turn")
        return heard

    def close(self) -> None:
        """Let go: the process brakes the arm and ends."""
        self._pipe.close()
        self._ended()

    def _last_words(self) -> str:
        """Return the last words of the process, or how it ended."""
        try:
            while self._pipe.poll(0):
                if isinstance(heard := decode(self._pipe.recv_bytes()), Failure):
                    return heard.problem
        except (EOFError, OSError, HardwareError):
            pass
        return f"the process that moves the arm ended with {self._ended()}"

    def _ended(self) -> int:
        """Wait until the process has braked the arm and ended, kill it where it does not; its exit code."""
        try:
            return self.process.wait(BRAKING_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            return self.process.wait()


class FrankaRobot:
    """The Robot that the Franka Control Interface moves; its limits are the tighter of the arm's and its description's.

    ``missed`` counts the control periods without a command in time, in which it brakes. It adds no effort; ball and cup
    are not tracked: the cup is where the measured joints have it.
    """

    realtime = True

    def __init__(self, hardware: FrankaHardware, arm: RobotModel) -> None:
        if len(arm.joint_names) != JOINTS:
            raise ConfigError(
                "hardware.kind",
                f"'hardware.kind' is 'franka', which moves 7 joints; {arm.settings.name} has {len(arm.joint_names)}: "
                "choose robot=fr3",
            )
        self._arm, self._hardware = arm, hardware
        self.joint_names, self.period_s = arm.joint_names, hardware.control_period_s
        self.limits = tighter(arm.limits, hardware)
        self.missed = 0
        self._periods = self._began = self._exchanges = 0
        limits = self.limits
        own = (hardware.jerk_rad_s3, hardware.stop_rad_s2, hardware.stop_rad_s)
        rates = RateLimits(
            limits.lower_rad,
            limits.upper_rad,
            limits.velocity_rad_s,
            limits.acceleration_rad_s2,
            *(np.array(values) for values in own),
        )
        self._pipe = ArmPipe(hardware)
        try:
            self._pipe.order(Begin(hardware, rates))
            self._sent_rad = self._pipe.hear(Stands, hardware.wait_s).position_rad
        except BaseException:
            self._pipe.close()
            raise

    def exchange(self, command: JointCommand) -> Exchange:
        """Play one control period; raises HardwareError when the arm or the line has failed, or after ``halt``."""
        try:
            check_command(command, self.limits)
        except HardwareError as error:
            raise self._pipe.fail(str(error)) from None
        away = np.abs(command.position_rad - self._sent_rad)
        if away.max() > MOST_STEP_RAD:
            joint, far = self.joint_names[int(away.argmax())], away.max()
            raise self._pipe.fail(
                f"joint '{joint}' is commanded {far:.3f} rad from where it was sent last; allowed: {MOST_STEP_RAD} "
                "in one control period; the arm was halted"
            )
        lower, upper = self.limits.lower_rad, self.limits.upper_rad
        self._pipe.order(Wanted(np.clip(command.position_rad, lower, upper), np.array(command.velocity_rad_s)))
        done = self._pipe.hear(Done, self._hardware.silence_s)
        self._exchanges += 1
        self.missed += done.periods - self._periods - 1
        self._periods, self._sent_rad = done.periods, done.sent_rad
        sent = JointCommand(done.sent_rad, done.sent_rad_s, done.sent_rad_s2)
        return Exchange(sent, self._state(done), (done.periods - self._began) * self.period_s)

    def reset(self, position_rad: Array, seed: int) -> Exchange:
        """Go slowly to rest at ``position_rad``, wait until the arm is there; raises HardwareError where it is not."""
        goal = np.asarray(position_rad, dtype=float)
        for command in approach((self._sent_rad, goal), self._hardware.approach_rad_s, self.period_s, 0.5):
            self.exchange(command)
        rest = JointCommand(goal, np.zeros(JOINTS), np.zeros(JOINTS))
        for _ in range(round(_SETTLE_S / self.period_s)):
            last = self.exchange(rest)
            off = np.abs(last.state.position_rad - goal)
            if off.max() < _SETTLED_RAD and np.array_equal(last.sent.position_rad, goal):
                self._began, self._exchanges = self._periods, 0
                return dataclasses.replace(last, t_s=0.0)
        joint = self.joint_names[int(off.argmax())]
        raise self._pipe.fail(
            f"joint '{joint}' is {off.max():.3f} rad from where it was told to be; the arm was halted"
        )

    def recover(self) -> None:
        """Have the controller leave its reflex; raises HardwareError where it does not."""
        self._pipe.order(Recover())
        self._sent_rad = self._pipe.hear(Stands, self._hardware.wait_s).position_rad

    def halt(self) -> None:
        """Brake within the limits and stay stopped: the loop brakes where no command comes."""
        self._pipe.fail("the arm was halted from here and stays so: open it anew")

    def close(self) -> None:
        """Halt, let the arm brake, and end the process."""
        self.halt()
        self._pipe.close()

    def _state(self, done: Done) -> RobotState:
        place = self._arm.tool_position_m(done.position_rad)
        return RobotState(
            position_rad=done.position_rad,
            velocity_rad_s=done.velocity_rad_s,
            effort_nm=done.effort_nm,
            wrist_wrench=done.wrench,
            cup_in_world_m=place,
            ball_in_world_m=np.full(3, np.nan),
            caught=False,
            external_nm=done.external_nm,
        )


def tighter(limits: JointLimits, hardware: FrankaHardware) -> JointLimits:
    """Return the tighter of the description's and the arm's limits, joint by joint."""
    return JointLimits(
        np.maximum(limits.lower_rad, hardware.lower_rad),
        np.minimum(limits.upper_rad, hardware.upper_rad),
        np.minimum(limits.velocity_rad_s, hardware.velocity_rad_s),
        np.minimum(limits.acceleration_rad_s2, hardware.acceleration_rad_s2),
        limits.effort_nm,
    )
