"""MuJoCo as a library: imported where it is used, for it comes with an extra."""

from __future__ import annotations

from typing import Any

from kendama_cli.errors import MissingPartError, install_line


def mujoco() -> Any:
    """Import MuJoCo; raises MissingPartError without it."""
    try:
        import mujoco as found  # noqa: PLC0415 - an extra
    except ImportError as error:
        raise MissingPartError("mujoco", f"this needs MuJoCo: {install_line('mujoco')}") from error
    return found
