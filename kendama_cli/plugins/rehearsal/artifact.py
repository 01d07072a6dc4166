"""Motion that an arm played for the first time, beside that of its twin."""

from __future__ import annotations

from dataclasses import dataclass

from kendama_cli.schema.arrays import Array, array, rising


@dataclass(frozen=True)
class Rehearsal:
    """k control periods of n joints: times (k,), angles (k, n) that were sent and measured, and the twin's.

    ``stopped`` says why it ended before its end; empty where it did not.
    """

    joint_names: tuple[str, ...]
    speed: float
    t_s: Array
    sent_rad: Array
    measured_rad: Array
    ghost_rad: Array
    stopped: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "t_s", rising("t_s", self.t_s))
        shape = (len(self.t_s), len(self.joint_names))
        for name in ("sent_rad", "measured_rad", "ghost_rad"):
            object.__setattr__(self, name, array(name, getattr(self, name), shape))
