"""Log of an arm's real commands and measurements, also of a motion that a fault breaks off."""

from __future__ import annotations

from collections.abc import Sequence

from kendama_cli.devices.robot.interface import Exchange, JointCommand, Robot
from kendama_cli.log.messages import JointExchangeMessage
from kendama_cli.schema.arrays import Array


def exchange_message(joint_names: Sequence[str], exchange: Exchange) -> JointExchangeMessage:
    """Return one control period for the log."""
    sent, state = exchange.sent, exchange.state
    return JointExchangeMessage(
        joints=joint_names,
        sent_rad=sent.position_rad,
        sent_rad_s=sent.velocity_rad_s,
        sent_nm=sent.effort_nm,
        measured_rad=state.position_rad,
        measured_rad_s=state.velocity_rad_s,
        measured_nm=state.effort_nm,
    )


class RememberingRobot:
    """``robot``, with the control periods ``played`` since its last ``reset`` or ``forget``, the rest before them."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self.joint_names, self.limits, self.period_s = robot.joint_names, robot.limits, robot.period_s
        self.realtime = robot.realtime
        self.torque = None  # what is commanded by torques is logged as it comes
        self.played: list[Exchange] = []

    @property
    def missed(self) -> int:
        """The robot's own count."""
        return self._robot.missed

    def exchange(self, command: JointCommand) -> Exchange:
        """Play one control period; raises HardwareError as the robot does."""
        self.played.append(self._robot.exchange(command))
        return self.played[-1]

    def reset(self, position_rad: Array, seed: int) -> Exchange:
        """Reset the robot."""
        self.forget()
        self.played.append(self._robot.reset(position_rad, seed))
        return self.played[-1]

    def forget(self) -> None:
        """Forget the periods played, which are logged."""
        self.played = []

    def halt(self) -> None:
        """Halt the robot."""
        self._robot.halt()

    def close(self) -> None:
        """Close the robot."""
        self._robot.close()
