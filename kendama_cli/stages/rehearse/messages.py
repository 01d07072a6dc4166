"""Messages that rehearse logs."""

from __future__ import annotations

from collections.abc import Mapping

from kendama_cli.schema.foxglove import JointStates

TOPICS: Mapping[str, type] = {
    "/rehearse/ghost": JointStates,
    "/rehearse/sent": JointStates,
    "/rehearse/measured": JointStates,
    "/rehearse/external": JointStates,
}
"""The twin's joints, what was really sent to the arm, what it measured, and, where it estimates that, the efforts that
come from outside; every control period."""
