"""Every hand keeps the interface's promises, or says what it needs."""

import numpy as np
import pytest
import yaml

from kendama_cli.devices.hand.open_hands import open_hands
from kendama_cli.devices.hand.settings import HapticCapture, MocapCapture
from kendama_cli.errors import MissingPartError
from kendama_cli.schema.settings import build
from tests.devices.hand.files import CONF, csv_lines, file_settings, write
from tests.devices.hand.test_mcap_log import P, T, write_mcap


@pytest.fixture(params=["text", "mcap"])
def hands(request, tmp_path):
    if request.param == "text":
        return open_hands(file_settings([write(tmp_path / f"{name}.csv", csv_lines()) for name in "ab"]))
    return open_hands(file_settings(write_mcap(tmp_path / "a.mcap", {"/capture/cup": {"a": (T, P), "b": (T, P)}})))


def test_each_demonstration_is_a_hand_with_a_name(hands):
    assert [hand.name for hand in hands] == ["a", "b"]


def test_samples_start_at_zero_and_rise(hands):
    for hand in hands:
        t_s = [sample.t_s for sample in hand.samples()]
        assert t_s[0] == 0
        assert (np.diff(t_s) > 0).all()
        assert hand.rate_hz == pytest.approx(1 / np.median(np.diff(t_s)))


def test_rotations_are_unit_quaternions_and_all_samples_are_tracked(hands):
    for hand in hands:
        for sample in hand.samples():
            assert np.linalg.norm(sample.rotation_wxyz) == pytest.approx(1)
            assert sample.tracked


def test_samples_can_be_read_twice_and_forces_are_ignored(hands):
    for hand in hands:
        first = [sample.position_m for sample in hand.samples()]
        hand.render_force(np.array([0.0, 0.0, -1.0]))
        hand.close()
        hand.close()
        assert np.array_equal(first, [sample.position_m for sample in hand.samples()])


def test_equal_file_names_are_told_apart(tmp_path):
    for folder in ("monday", "tuesday"):
        (tmp_path / folder).mkdir()
        write(tmp_path / folder / "swing.csv", csv_lines())
    paths = sorted(tmp_path.glob("*/swing.csv"))
    assert [hand.name for hand in open_hands(file_settings(paths))] == ["swing-1", "swing-2"]


def test_motion_capture_says_what_it_needs():
    settings = build(MocapCapture, yaml.safe_load((CONF / "mocap.yaml").read_text()), "capture")
    with pytest.raises(MissingPartError) as caught:
        open_hands(settings)
    message = str(caught.value)
    for part in ("OptoTrak", "rigid body 'cup'", "127.0.0.1:3020", "capture.host", "driver", "capture=file"):
        assert part in message
    assert "\n" not in message


def test_the_haptic_device_says_what_it_needs():
    settings = build(HapticCapture, yaml.safe_load((CONF / "haptic.yaml").read_text()), "capture")
    with pytest.raises(MissingPartError) as caught:
        open_hands(settings)
    message = str(caught.value)
    for part in ("Phantom Omni", "'Default Device'", "capture.device", "OpenHaptics", "capture=file"):
        assert part in message
    assert "\n" not in message
