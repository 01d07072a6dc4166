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
    """The simulated robot as a process of its own behind UDP on loopback, a little different from the model."""

    moves: ClassVar[bool] = False

    kind: Literal["twin"]
    realtime: bool = setting("false: lockstep, as fast as it computes, reproducible; true: paced by the wall clock")
    control_period_s: float = setting(
        "one command and one answer per period; whole milliseconds [s]", above=0, at_most=0.02
    )
    watchdog_s: float = setting("in real time: silence after which the moving robot stops for good [s]", above=0)
    silence_s: float = setting("in real time: an answer that takes longer is a broken line [s]", above=0)
    imperfection: Imperfection = setting("differences of the twin from the model")


@dataclass(frozen=True)
class SimulatedHardware:
    """The simulated robot in the stage's own process, without a line between."""

    moves: ClassVar[bool] = False

    kind: Literal["simulated"]
    control_period_s: float = setting("one position command per period; whole milliseconds [s]", above=0, at_most=0.02)
    imperfection: Imperfection | None = setting("differences from the model; null: none")


@dataclass(frozen=True)
class CommandHardware:
    """A robot's controller that runs and speaks the protocol of docs/reference/protocol.md."""

    moves: ClassVar[bool] = True

    kind: Literal["command"]
    host: str = setting("name or address of the robot's controller")
    port: int = setting("UDP port on which it listens", above=0, at_most=65535)
    key_file: str = setting("file of the key that the controller has too; 'kendama robot key' makes one")
    silence_s: float = setting("an answer that takes longer is a broken line (while this process runs) [s]", above=0)


HardwareSettings = Annotated[RobotSettingsNode, ROBOTS]
"""The node ``hardware``: settings of any registered robot."""
