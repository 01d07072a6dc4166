"""Test that an extra is installed that a test needs."""

from __future__ import annotations

import importlib.metadata

import pytest


def require_robot_descriptions() -> None:
    """Skip the test where the robots' descriptions are not installed."""
    try:
        importlib.metadata.distribution("example-robot-data")
    except importlib.metadata.PackageNotFoundError:
        pytest.skip("example-robot-data (the extra 'robots') is not installed")
