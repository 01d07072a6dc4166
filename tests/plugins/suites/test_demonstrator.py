"""Every hand keeps the interface's promises, or says what it needs."""

import numpy as np
import pytest

from kendama_cli.devices.demonstrator.file import RecordedDemonstrator
from kendama_cli.devices.demonstrator.interface import DemonstratorSample, open_demonstrators
from kendama_cli.plugins.suites.demonstrator import CHECKS
from tests.devices.demonstrator.files import csv_lines, file_settings, write
from tests.devices.demonstrator.test_mcap_log import P, T, write_mcap


@pytest.fixture(params=["text", "mcap"])
def hands(request, tmp_path):
    if request.param == "text":
        return open_demonstrators(file_settings([write(tmp_path / f"{name}.csv", csv_lines()) for name in "ab"]))
    return open_demonstrators(
        file_settings(write_mcap(tmp_path / "a.mcap", {"/capture/cup": {"a": (T, P), "b": (T, P)}}))
    )


def test_each_demonstration_is_a_demonstrator_with_a_name(hands):
    assert [hand.name for hand in hands] == ["a", "b"]


@pytest.mark.parametrize("check", CHECKS)
def test_recorded_demonstrators_keep_every_law(hands, check):
    check(lambda: hands)


def _check_all(subject):
    for check in CHECKS:
        check(subject)


class _Wrong(RecordedDemonstrator):
    """A recorded hand with one fault."""

    def __init__(self, right, fault):
        super().__init__("" if fault == "nameless" else right.name, right._recording)
        self.rate_hz, self.fault = right.rate_hz * (2 if fault == "fast" else 1), fault

    def samples(self):
        late = 0.1 if self.fault == "late" else 0.0
        scale = {"millimetres": 1e3}.get(self.fault, 1.0)
        for one in super().samples():
            turn = one.rotation_wxyz * (2.0 if self.fault == "long quaternion" else 1.0)
            yield DemonstratorSample(one.t_s + late, scale * one.position_m, turn, self.fault != "lost")


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("nameless", "name of its own"),
        ("fast", "comes at its rate"),
        ("late", "is at time 0"),
        ("millimetres", "metres are meant"),
        ("long quaternion", "unit quaternions"),
        ("lost", "are tracked"),
    ],
)
def test_the_laws_notice_a_demonstrator_that_breaks_them(hands, fault, words):
    with pytest.raises(AssertionError, match=words):
        _check_all(lambda: [_Wrong(hands[0], fault)])


def test_samples_can_be_read_twice_and_forces_are_ignored(hands):
    for hand in hands:
        first = [sample.position_m for sample in hand.samples()]
        hand.render_force(np.array([0.0, 0.0, -1.0]))
        hand.close()
        hand.close()
        assert np.array_equal(first, [sample.position_m for sample in hand.samples()])


def test_equal_file_names_are_distinguished(tmp_path):
    for folder in ("monday", "tuesday"):
        (tmp_path / folder).mkdir()
        write(tmp_path / folder / "swing.csv", csv_lines())
    paths = sorted(tmp_path.glob("*/swing.csv"))
    assert [hand.name for hand in open_demonstrators(file_settings(paths))] == ["swing-1", "swing-2"]
