"""Settings of ``hardware=franka``."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import ClassVar, Literal

from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class FrankaHardware:
    """An arm of Franka Robotics through the Franka Control Interface (FCI); lists have a value for each joint."""

    moves: ClassVar[bool] = True

    kind: Literal["franka"]
    host: str = setting("Name or address of the arm's controller.")
    realtime: Literal["enforce", "ignore"] = setting(
        "Check for a real-time kernel on this machine: 'enforce' refuses to run without one."
    )
    control_period_s: float = setting("Period of one command, in whole milliseconds [s].", above=0, at_most=0.02)
    lower_rad: tuple[float, ...] = setting("Lower limits of the joint angles, as the arm states them [rad].")
    upper_rad: tuple[float, ...] = setting("Upper limits of the joint angles, as the arm states them [rad].")
    velocity_rad_s: tuple[float, ...] = setting(
        "Velocity limits of the joints, as the arm states them [rad/s].", above=0
    )
    acceleration_rad_s2: tuple[float, ...] = setting(
        "Acceleration limits of the joints, as the arm states them [rad/s^2].", above=0
    )
    jerk_rad_s3: tuple[float, ...] = setting("Jerk limits of the joints, as the arm states them [rad/s^3].", above=0)
    stop_rad_s2: tuple[float, ...] = setting(
        "Deceleration from which the arm derives a joint's velocity limit near a stop [rad/s^2].", above=0
    )
    stop_rad_s: tuple[float, ...] = setting(
        "Near a stop, the arm allows this much less velocity than its deceleration would [rad/s].", at_least=0
    )
    collision_nm: float = setting("The arm stops when an external torque at a joint exceeds this [Nm].", above=0)
    collision_n: float = setting(
        "The arm stops when an external force at the hand exceeds this [N], or a torque the same number [Nm].", above=0
    )
    approach_rad_s: float = setting(
        "Maximum velocity of a joint while the arm moves to the start of a motion [rad/s].", above=0
    )
    reply_s: float = setting(
        "The driver waits this long after a state of the arm for the next command, then brakes the arm [s].", above=0
    )
    silence_s: float = setting("The connection counts as lost when no state has arrived for this long [s].", above=0)
    wait_s: float = setting("Time to wait for the arm at the start and for its recovery from an error [s].", above=0)

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
