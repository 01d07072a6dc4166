"""Messages that interact logs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from kendama_cli.log.messages import WrenchMessage
from kendama_cli.schema.foxglove import FrameTransform, JointStates


@dataclass(frozen=True)
class ContactMessage:
    """Force of the tool in step ``step`` on ``body`` (empty: on nothing), along the desired force and across it."""

    step: str
    body: str
    wanted_n: float
    along_n: float
    across_n: float


TOPICS: Mapping[str, type] = {
    "/interact/joints": JointStates,
    "/interact/tool": FrameTransform,
    "/interact/reference": FrameTransform,
    "/interact/body": FrameTransform,
    "/interact/wrench": WrenchMessage,
    "/interact/contact": ContactMessage,
}
"""``child`` of ``/interact/body`` names the movable body of the scene."""
