"""The conformance suite itself notices each fault that it is there for."""

import dataclasses

import numpy as np
import pytest

from kendama_cli.devices.camera.interface import Frame, too_old
from kendama_cli.plugins.suites.camera import check_camera
from tests.vision.scenes import stereo


class Fake:
    """A good camera of 64 x 48 px at 100 Hz, with one fault on wish."""

    def __init__(self, fault=None):
        self.model = dataclasses.replace(stereo()[0], width_px=64, height_px=48)
        self.fault, self.t_s, self.origin = fault, 0.0, (0, 0)

    def wait(self, duration_s):
        self.t_s += duration_s

    def latest(self, *, max_age_s):
        stamp = 0.5 if self.fault == "future" else 0.0 if self.fault == "frozen" else self.t_s - 0.001
        if self.t_s - stamp > max_age_s and self.fault != "never stale":
            raise too_old("other" if self.fault == "nameless" else "left", self.t_s - stamp, max_age_s)
        kind = np.float64 if self.fault == "floats" else np.uint8
        shape = (24, 32, 3) if self.fault == "small" else (48, 64, 3)
        return Frame(stamp, np.zeros(shape, dtype=kind), self.origin)

    def set_region_of_interest(self, region):
        if self.fault == "outside" and region is not None:
            self.origin = (50, 0)

    def restart(self):
        pass

    def close(self):
        pass


def check(fault):
    camera = Fake(fault)
    check_camera(camera, lambda: camera.t_s, camera.wait, 0.01)


def test_a_good_camera_passes():
    check(None)


@pytest.mark.parametrize(
    ("fault", "rule"),
    [
        ("future", "cannot come before it was taken"),
        ("frozen", "new frames must come"),
        ("floats", "pixels must be uint8"),
        ("small", "must show its whole image"),
        ("outside", "must lie in the image"),
        ("never stale", "older than max_age_s must raise StaleFrame"),
        ("nameless", "StaleFrame must name its camera"),
    ],
)
def test_each_fault_is_named(fault, rule):
    with pytest.raises(AssertionError, match=rule):
        check(fault)
