"""Messages that learn logs."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from kendama_cli.log.messages import RolloutMessage
from kendama_cli.schema.foxglove import FrameTransform


@dataclass(frozen=True)
class QTableMessage:
    """The action values after ``rollout`` rollouts: ``rows`` states by ``columns`` actions, row by row."""

    rollout: int
    rows: int
    columns: int
    values: Collection[float]


@dataclass(frozen=True)
class SwingStateMessage:
    """The state of cup and ball, the cup's commanded acceleration and the rope's tension."""

    x_m: float
    velocity_m_s: float
    angle_rad: float
    rate_rad_s: float
    action_m_s2: float
    tension_n: float


TOPICS: Mapping[str, type] = {
    "/learn/rollout": RolloutMessage,
    "/learn/table": QTableMessage,
    "/learn/step": SwingStateMessage,
    "/learn/cup": FrameTransform,
    "/learn/ball": FrameTransform,
}
"""``step``, ``cup`` and ``ball``: one rollout of the frozen policy without noise, and on through free flight."""
