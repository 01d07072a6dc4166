"""What rehearse logs."""

from __future__ import annotations

from collections.abc import Mapping

from kendama_cli.schema.foxglove import JointStates

TOPICS: Mapping[str, type] = {
    "/rehearse/ghost": JointStates,
    "/rehearse/sent": JointStates,
    "/rehearse/measured": JointStates,
}
"""The twin's joints, what was really sent to the arm, and what it measured; every control period."""
