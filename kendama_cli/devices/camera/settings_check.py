"""Checks that the settings of several kinds of camera need."""

from __future__ import annotations

from collections.abc import Sized

from kendama_cli.errors import ConfigError


def require_one_each(key: str, given: Sized, what: str, cameras: int) -> None:
    """Raise ConfigError where ``given``, the value of ``key``, does not have one entry for each of the cameras."""
    if len(given) != cameras:
        raise ConfigError(
            key, f"'{key}' has {len(given)} entries for {cameras} cameras: give {what} per camera, as in {key}=[a,b]"
        )
