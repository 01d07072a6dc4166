"""The robots that ``hardware`` can choose: ours below, others by the entry point group ``kendama.robots``."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Annotated, ClassVar, Literal, Protocol

from kendama_cli.errors import ConfigError
from kendama_cli.schema.registry import Registry
from kendama_cli.schema.settings import setting
from kendama_cli.settings.robot import Imperfection

ROBOTS = Registry("kendama.robots", "robot")


class RobotSettingsNode(Protocol):
    """What the settings of every robot have beside fields of their own."""

    moves: ClassVar[bool]
    """Whether it may move a real arm: then it moves only when armed, and no cached result stands in for it."""

    @property
    def kind(self) -> str:
        """The name under which the robot is registered."""


@dataclass(frozen=True)
class TwinHardware:
    """The simulated robot as a process of its own behind UDP on loopback, a little different from the model."""

    moves: ClassVar[bool] = False

    kind: Literal["twin"]
    realtime: bool = setting("false: lockstep, as fast as it computes, reproducible; true: paced by the wall clock")
    control_period_s: float = setting(
        "one command and one answer per period; whole milliseconds [s]", above=0, at_most=0.02
    )
    watchdog_s: float = setting("in real time: silence after which the moving robot stops for good [s]", above=0)
    silence_s: float = setting("in real time: an answer that takes longer is a broken line [s]", above=0)
    imperfection: Imperfection = setting("how the twin differs from the model")


@dataclass(frozen=True)
class SimulatedHardware:
    """The simulated robot in the stage's own process, without a line between."""

    moves: ClassVar[bool] = False

    kind: Literal["simulated"]
    control_period_s: float = setting("one position command per period; whole milliseconds [s]", above=0, at_most=0.02)
    imperfection: Imperfection | None = setting("how it differs from the model; null: not at all")


@dataclass(frozen=True)
class CommandHardware:
    """A robot's controller that runs and speaks the protocol of docs/protocol.md."""

    moves: ClassVar[bool] = True

    kind: Literal["command"]
    host: str = setting("name or address of the robot's controller")
    port: int = setting("UDP port on which it listens", above=0, at_most=65535)
    key_file: str = setting("file of the key that the controller has too; 'kendama robot key' makes one")
    silence_s: float = setting("an answer that takes longer is a broken line (while this process runs) [s]", above=0)


@dataclass(frozen=True)
class RsiHardware:
    """A KUKA controller that runs RobotSensorInterface (RSI) over UDP."""

    moves: ClassVar[bool] = True

    kind: Literal["rsi"]
    host: str = setting("address of this machine to which the controller sends")
    port: int = setting("UDP port of this machine", above=0, at_most=65535)
    controller: str = setting("address of the controller; what others send is ignored")
    sentype: str = setting("name of this system in the controller's configuration (SENTYPE)")
    control_period_s: float = setting("the controller's cycle: 0.004 or 0.012 [s]", above=0, at_most=0.02)
    signs: tuple[Literal[-1, 1], ...] | None = setting(
        "for A1 to A6: -1 where the description turns the other way; null: nowhere"
    )
    offset_deg: tuple[float, ...] | None = setting(
        "the controller's angles where the description's are 0; null: 0 [deg]"
    )
    largest_correction_deg: float = setting("how far an axis may go from where RSI began [deg]", above=0)
    approach_rad_s: float = setting("how fast a joint goes to the start of a motion, at most [rad/s]", above=0)
    reply_s: float = setting("an answer leaves so soon after the telegram, with a new command or without [s]", above=0)
    silence_s: float = setting("so long without a telegram is a stopped controller [s]", above=0)
    wait_s: float = setting("how long the first telegram is waited for [s]", above=0)

    def __post_init__(self) -> None:
        for name in ("signs", "offset_deg"):
            values = getattr(self, name)
            if values is not None and len(values) != 6:
                raise ConfigError(name, f"'{name}' has {len(values)} values; allowed: 6, one for each axis, or null")
        if self.reply_s >= self.control_period_s:
            allowed = f"allowed: less than the control period, {self.control_period_s:g}"
            raise ConfigError("reply_s", f"'reply_s' is {self.reply_s:g}; {allowed}")


@dataclass(frozen=True)
class FrankaHardware:
    """An arm of Franka Robotics by the Franka Control Interface (FCI); every tuple is for its seven joints."""

    moves: ClassVar[bool] = True

    kind: Literal["franka"]
    host: str = setting("name or address of the arm's controller")
    realtime: Literal["enforce", "ignore"] = setting("whether this machine must have a real-time kernel")
    control_period_s: float = setting("one command per period; whole milliseconds [s]", above=0, at_most=0.02)
    lower_rad: tuple[float, ...] = setting("the arm's own least angles [rad]")
    upper_rad: tuple[float, ...] = setting("the arm's own largest angles [rad]")
    velocity_rad_s: tuple[float, ...] = setting("the arm's own speed limits [rad/s]", above=0)
    acceleration_rad_s2: tuple[float, ...] = setting("the arm's own acceleration limits [rad/s^2]", above=0)
    jerk_rad_s3: tuple[float, ...] = setting("the arm's own jerk limits [rad/s^3]", above=0)
    stop_rad_s2: tuple[float, ...] = setting("with which a joint brakes toward its stop [rad/s^2]", above=0)
    stop_rad_s: tuple[float, ...] = setting("less than that braking allows, near a stop [rad/s]", at_least=0)
    collision_nm: float = setting("a joint pushed harder than this stops the arm [Nm]", above=0)
    collision_n: float = setting("a hand pushed harder than this stops the arm [N], or turned [Nm]", above=0)
    approach_rad_s: float = setting("how fast a joint goes to the start of a motion, at most [rad/s]", above=0)
    reply_s: float = setting("so long after an answer the next command is waited for, then the arm brakes [s]", above=0)
    silence_s: float = setting("so long without a state is a broken line [s]", above=0)
    wait_s: float = setting("how long the arm is waited for at the beginning, and to recover [s]", above=0)

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, tuple) and len(value) != 7:
                raise ConfigError(field.name, f"'{field.name}' has {len(value)} values; allowed: 7, one for each joint")
        cycles = self.control_period_s / 0.001
        if abs(cycles - round(cycles)) > 1e-6:
            raise ConfigError(
                "control_period_s", f"'control_period_s' is {self.control_period_s:g}; allowed: whole milliseconds"
            )
        if self.realtime == "enforce" and self.reply_s >= 0.001:  # a simulator may have a slower clock
            raise ConfigError("reply_s", f"'reply_s' is {self.reply_s:g}; allowed: less than the arm's cycle, 0.001")


HardwareSettings = Annotated[RobotSettingsNode, ROBOTS]
"""The node ``hardware``: settings of any registered robot."""
