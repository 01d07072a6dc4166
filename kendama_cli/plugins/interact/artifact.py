"""Result of a script that an arm played in a scene."""

from __future__ import annotations

from dataclasses import dataclass

from kendama_cli.schema.arrays import Array, array, rising


@dataclass(frozen=True)
class InteractionResult:
    """The tool's motion and its contact, every control period."""

    steps: tuple[str, ...]
    """names of the script's steps"""
    touched: tuple[str, ...]
    """names of the bodies that the tool touched, sorted"""
    t_s: Array
    """(n,)"""
    step: Array
    """(n,) number of the step that was going on"""
    tool_m: Array
    """(n, 3) in the world"""
    reference_m: Array
    """(n, 3) where the tool should have been"""
    wanted_n: Array
    """(n, 3) force that the tool should have exerted"""
    contact_n: Array
    """(n, 3) force that it exerted, as the sensor felt it"""

    def __post_init__(self) -> None:
        object.__setattr__(self, "t_s", rising("t_s", self.t_s))
        n = len(self.t_s)
        object.__setattr__(self, "step", array("step", self.step, (n,)))
        for name in ("tool_m", "reference_m", "wanted_n", "contact_n"):
            object.__setattr__(self, name, array(name, getattr(self, name), (n, 3)))
