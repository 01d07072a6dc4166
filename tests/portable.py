"""Tests of what Linux's own means and the portable ones do alike, whose portable half is slow as others are quick."""

from __future__ import annotations

import pytest

portable_is_slow = pytest.mark.parametrize(
    "each_way",
    [pytest.param("0", id="linux"), pytest.param("1", id="portable", marks=pytest.mark.slow)],
    indirect=True,
)
"""Instead of both parameters of the fixture ``each_way``."""
