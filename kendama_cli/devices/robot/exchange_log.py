"""Log of an arm's real commands and measurements, also of a motion that a fault breaks off."""

from __future__ import annotations

from collections.abc import Sequence

from kendama_cli.devices.robot.interface import Exchange, JointCommand, Robot, WrappedRobot
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


class RememberingRobot(WrappedRobot):
    """``robot``, with the control periods ``played`` since its last ``reset`` or ``forget``, the rest before them."""

    def __init__(self, robot: Robot) -> None:
        super().__init__(robot)
        self.played: list[Exchange] = []

    def exchange(self, command: JointCommand) -> Exchange:
        """Play one control period; raises HardwareError as the robot does."""
        self.played.append(super().exchange(command))
        return self.played[-1]

    def reset(self, position_rad: Array, seed: int) -> Exchange:
        """Reset the robot."""
        self.forget()
        self.played.append(super().reset(position_rad, seed))
        return self.played[-1]

    def forget(self) -> None:
        """Forget the periods played, which are logged."""
        self.played = []
