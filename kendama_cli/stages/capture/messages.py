"""Messages that capture logs."""

from __future__ import annotations

from collections.abc import Mapping

from kendama_cli.schema.foxglove import FrameTransform

TOPICS: Mapping[str, type] = {"/capture/cup": FrameTransform}
"""``child`` names the demonstration."""
