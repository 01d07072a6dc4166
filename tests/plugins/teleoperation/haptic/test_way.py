"""Path of a stylus between the positions received, and after them."""

import numpy as np
import pytest

from kendama_cli.plugins.teleoperation.haptic.period import PREDICTED_S, DeviceWay


def places(*x_m):
    return [np.array([x, 0.0, 0.0]) for x in x_m]


def test_places_that_come_together_were_at_equal_times_before():
    way = DeviceWay(1.0, places(0.0)[0])
    way.heard(1.004, places(0.01, 0.02, 0.03, 0.04))
    assert [way.at(t_s)[0] for t_s in (0.9, 1.0, 1.0005, 1.003, 1.004)] == pytest.approx([0, 0, 0.005, 0.03, 0.04])


def test_a_hand_that_is_not_heard_of_goes_on_for_a_little_while():
    way = DeviceWay(0.0, places(0.0)[0])
    for k in range(1, 3000):
        way.heard(1e-3 * k, places(2e-3 * k))
    assert way.at(2.999 + 0.01)[0] == pytest.approx(2 * 3.009)
    assert way.at(2.999 + 1.0)[0] == pytest.approx(2 * (2.999 + PREDICTED_S))
    assert way.at(2.5)[0] == pytest.approx(5.0)


def test_a_hand_of_which_one_place_is_known_stands_there():
    assert DeviceWay(0.0, places(0.3)[0]).at(5.0)[0] == 0.3
