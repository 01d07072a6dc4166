"""The length of a unit quaternion as it is recorded and written by hand."""

from __future__ import annotations

UNIT_SLACK = 1e-2
"""Recorded and written quaternions are rounded; a length farther from 1 means that the numbers are something else."""
