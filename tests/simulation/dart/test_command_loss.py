"""Commands that are lost in bursts, against the two figures that are declared."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from kendama_cli.simulation.dart.arm_errors import CommandLoss


def test_as_many_commands_are_lost_as_declared_in_bursts_of_the_declared_length() -> None:
    """100 000 commands; a burst's length has the standard deviation of a geometric one, 4.5."""
    loss = CommandLoss(0.03, 5.0, 1, np.random.default_rng(10000))
    lost = []
    for command in range(100_000):
        position, velocity, _ = loss.arrived(np.array([float(command)]), np.ones(1), np.ones(1))
        lost.append(position[0] != command)
        assert lost[-1] == (velocity[0] == 0.0)
    bursts = [len(list(group)) for is_lost, group in itertools.groupby(lost) if is_lost]
    assert np.mean(bursts) == pytest.approx(5.0, abs=4 * 4.5 / np.sqrt(len(bursts)))
    assert np.mean(lost) == pytest.approx(0.03, abs=4 * 5.0 * np.sqrt(2 * len(bursts)) / 100_000)
    assert not lost[0]


def test_the_arm_holds_the_last_position_that_arrived() -> None:
    loss = CommandLoss(0.45, 1.0, 4, np.random.default_rng(1))
    last = None
    for command in range(50):
        for step in range(4):
            sent = np.array([command + step / 4])
            position, *_ = loss.arrived(sent, np.ones(1), np.ones(1))
            assert position[0] in {sent[0], last}
        last = position[0]
