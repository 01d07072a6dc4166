"""capture=haptic with an operator model in the person's place, in a process of its own."""

import contextlib
import subprocess
import sys

import numpy as np
import pytest

from kendama_cli.devices.hand.haptic.device import HapticHand, HapticLink
from kendama_cli.devices.hand.haptic.settings import HapticCapture
from kendama_cli.errors import HardwareError
from kendama_cli.schema.settings import build
from tests.devices.hand.haptic.operator_model import Operator
from tests.devices.hand.play.table_top import swing
from tests.shipped_conf import CONF, plain


@contextlib.contextmanager
def operator(fault=""):
    command = [sys.executable, "-m", "tests.devices.hand.haptic.operator_model", "2.0", fault]
    process = subprocess.Popen(command, cwd=CONF.parent, stdout=subprocess.PIPE, text=True)
    try:
        yield int(process.stdout.readline())
    finally:
        process.kill()
        process.wait(timeout=20)


def settings(port):
    values = plain("capture", "haptic") | {"port": port, "game": plain("game", "kendama"), "watchdog_s": 0.5}
    return build(HapticCapture, values)


class Lockstep:
    """A link whose person takes a millisecond for each of the loop's, however long that takes: no stalls."""

    def __init__(self):
        self.settings, self.person = settings(1), Operator(2.0)
        self.gripped, self.device_m, self.late_s, self._now_s = True, np.zeros(3), [], 0.0
        self.force, self.most_n = np.zeros(3), 0.0

    def clock(self):
        self._now_s += 0.00025
        return self._now_s

    def listen(self):
        self.person.step(self.force.copy())
        self.device_m = self.settings.scale * self.person.place
        self.gripped = len(self.late_s) < 1000 * (self.person.t_s[-1] + 1)

    def feel(self, force_n):
        self.force = force_n * self.settings.scale * self.settings.felt_share
        self.most_n = max(self.most_n, float(np.linalg.norm(self.force)))


def test_a_swing_at_the_device_becomes_a_demonstration():
    link = Lockstep()
    samples = list(HapticHand("one", link).samples())
    got, (_, places) = np.array([one.position_m for one in samples]), swing()
    # the arm's impedance gives way to the rope by some centimetres
    for axis, planned in ((0, places[:, 0]), (2, places[:, 1])):
        assert np.ptp(got[:, axis]) == pytest.approx(np.ptp(planned), rel=0.25)
    assert np.abs(got[:, 1]).max() < 1e-3
    assert samples[0].t_s == 0
    assert np.ptp(np.diff([one.t_s for one in samples])) < 1e-9
    assert 0.3 < link.most_n <= 3.2 + 1e-9


def test_a_person_in_another_process_swings_until_the_grip_is_let_go():
    with operator() as port:
        link = HapticLink(settings(port))
        samples = list(HapticHand("one", link).samples())
        link.close()
    assert samples[-1].t_s > 1
    assert not link.gripped or len(link.late_s) > 100


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("nan", "no place"),
        ("jump", "jumped by"),
        ("silence", "no TRANSFORM 'Stylus' of the haptic device for"),
        ("leave", "has closed the line"),
    ],
)
def test_a_device_that_lies_or_leaves_is_stopped_for_good(fault, words):
    with operator(fault) as port:
        link = HapticLink(settings(port))
        with pytest.raises(HardwareError, match=words):
            list(HapticHand("one", link).samples())
        with pytest.raises(HardwareError, match="stays so: run it anew"):
            link.listen()
        link.close()


def test_a_device_that_is_not_there_is_told():
    with pytest.raises(HardwareError, match=r"no OpenIGTLink server of a haptic device at 127\.0\.0\.1:1 "):
        HapticLink(settings(1))
