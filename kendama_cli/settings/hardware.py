"""The robots that ``hardware`` can choose, by the entry point group ``kendama.robots``; those of the core below."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, Protocol

from kendama_cli.schema.registry import Registry
from kendama_cli.schema.settings import setting
from kendama_cli.settings.robot import Imperfection

ROBOTS = Registry("kendama.robots", "robot")


class RobotSettingsNode(Protocol):
    """Settings of every robot beside fields of its own."""

    moves: ClassVar[bool]
    """Whether it may move a real arm: then it moves only when armed, and no cached result stands in for it."""

    @property
    def kind(self) -> str:
        """The name under which the robot is registered."""


@dataclass(frozen=True)
class TwinHardware:
    """The twin: a simulated robot in its own process behind UDP on loopback, slightly different from the model."""

    moves: ClassVar[bool] = False

    kind: Literal["twin"]
    realtime: bool = setting(
        "If true, the twin runs in real time. If false, it computes in lockstep as fast as it can, and every run is "
        "reproducible."
    )
    control_period_s: float = setting(
        "Period of one command and its answer, in whole milliseconds [s].", above=0, at_most=0.02
    )
    watchdog_s: float = setting(
        "In real time, a moving twin stops for good when no command has arrived for this long [s].", above=0
    )
    silence_s: float = setting(
        "In real time, the connection counts as lost when an answer takes longer than this [s].", above=0
    )
    imperfection: Imperfection = setting("Differences of the twin from its controller's model.")


@dataclass(frozen=True)
class SimulatedHardware:
    """The simulated robot in the process of the stage, without a connection between them."""

    moves: ClassVar[bool] = False

    kind: Literal["simulated"]
    control_period_s: float = setting(
        "Period of one position command, in whole milliseconds [s].", above=0, at_most=0.02
    )
    imperfection: Imperfection | None = setting(
        "Differences of the simulated robot from its controller's model; null for none."
    )


@dataclass(frozen=True)
class CommandHardware:
    """A robot's running controller that speaks the protocol of docs/reference/protocol.md."""

    moves: ClassVar[bool] = True

    kind: Literal["command"]
    host: str = setting("Name or address of the robot's controller.")
    port: int = setting("UDP port on which the controller listens.", above=0, at_most=65535)
    key_file: str = setting(
        "File of the key that this machine and the controller share; 'kendama robot key' makes one."
    )
    silence_s: float = setting(
        "The connection counts as lost when an answer takes longer than this [s]. Pauses of this process do not count.",
        above=0,
    )


HardwareSettings = Annotated[RobotSettingsNode, ROBOTS]
"""The node ``hardware``: settings of any registered robot."""
