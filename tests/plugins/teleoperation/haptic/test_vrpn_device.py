"""A force device behind VRPN: what the project's own library sent and read, and that library where it is installed."""

from __future__ import annotations

import contextlib
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from kendama_cli.devices.demonstrator.interface import DemonstratorSample
from kendama_cli.errors import ConfigError, HardwareError
from kendama_cli.plugins.teleoperation.haptic.device import HapticDemonstrator, HapticLink
from kendama_cli.plugins.teleoperation.haptic.device_protocols import Grip, Place, Told, Trouble, VrpnDevice
from kendama_cli.plugins.teleoperation.haptic.settings import HapticCapture
from tests.plugins.stalls import without_stall
from tests.plugins.swing_server import replayed
from tests.plugins.teleoperation.haptic.test_device import operator, settings

HERE = Path(__file__).parent
FORCE_READ = (
    "0000005800000000000000000000000000000000000000003c449ba63cb43958bd03126f3fc00000c01000003e000000"
    + 9 * "00000000"
    + "3dcccccd"
)
"""A message of ours, of which the library's ``decode_forcefield`` made (1.5, -2.25, 0.125) N within 0.1 m."""


def recorded() -> bytes:
    lines = (HERE / "vrpn_exchange.hex").read_text().splitlines()
    return bytes.fromhex("".join(line for line in lines if not line.startswith("#")))


def phantom(port: int, **changes: object) -> HapticCapture:
    return settings(port, protocol="vrpn", device="Phantom", **changes)


def told_of(device: VrpnDevice) -> list[Told]:
    return [one for byte in recorded() for one in device.feed(bytes([byte]))]


def test_places_buttons_and_errors_of_the_librarys_device_are_read() -> None:
    assert told_of(VrpnDevice(phantom(1))) == [
        *(Grip(False), Place((0.01, 0.02, -0.03)), Place((0.011, 0.021, -0.031)), Grip(True)),
        *(Place((0.012, 0.022, -0.032)), Trouble("too large a force, hot motors or amplifiers that are off")),
        *(Place((0.013, 0.023, -0.033)), Grip(False)),
    ]


def test_another_button_or_device_is_not_the_dead_mans_switch() -> None:
    other = [one for one in told_of(VrpnDevice(phantom(1, button=1))) if isinstance(one, Grip)]
    assert other == [Grip(False)]
    assert told_of(VrpnDevice(settings(1, protocol="vrpn", device="Stylus"))) == []


def test_a_force_is_what_the_library_read() -> None:
    made = VrpnDevice(phantom(1)).force((1.5, -2.25, 0.125), (0.012, 0.022, -0.032))
    assert made.hex() == FORCE_READ


def test_a_fault_that_the_device_tells_of_stops_it_for_good(tmp_path: Path) -> None:
    """Its y points up and its z to the person: places are turned into our axes."""
    own = phantom(1)
    with replayed(recorded(), greeting=VrpnDevice(own).hello) as port:
        link = HapticLink(phantom(port))
        with pytest.raises(HardwareError, match="tells of a fault: too large a force, hot motors") as told:
            list(HapticDemonstrator("one", link, tmp_path).samples())
        assert "\n" not in str(told.value)
        assert link.device_m == pytest.approx(own.scale * np.array([0.012, 0.032, 0.022]))
        link.close()


def test_an_axis_that_occurs_twice_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"'axes' is \['x', 'z', 'z'\]; allowed: each of x, y and z once"):
        phantom(1, axes=["x", "z", "z"])


@pytest.mark.realtime
def test_a_swing_at_the_librarys_own_device_becomes_a_demonstration(tmp_path: Path) -> None:
    """Its headers and libraries are found by CPLUS_INCLUDE_PATH and LIBRARY_PATH, or where the system has them."""
    program, compiler = tmp_path / "phantom", shutil.which("g++")
    if compiler is None:
        pytest.skip("needs g++")
    made = subprocess.run(
        [compiler, "-std=c++17", "-o", program, HERE / "vrpn_phantom.cpp", "-lvrpnserver", "-lquat", "-lpthread"],
        capture_output=True,
        text=True,
        check=False,
    )
    if made.returncode != 0:
        assert "No such file" in made.stderr or "cannot find" in made.stderr, made.stderr
        pytest.skip("needs the library of github vrpn/vrpn")

    def swung(attempt: int) -> list[DemonstratorSample]:
        with operator("", str(program)) as port, contextlib.closing(HapticLink(phantom(port))) as link:
            return list(HapticDemonstrator(f"swing-{attempt}", link, tmp_path).samples())

    samples = without_stall(swung, HardwareError)
    got = np.array([one.position_m for one in samples])
    assert samples[-1].t_s > 1
    assert np.abs(got[:, 1]).max() < 1e-3  # forces and places are turned alike, so nothing pushes sideways
