"""Cameras of another process: the server as users start it, and what a stranger on the network gets."""

from __future__ import annotations

import dataclasses
import json
import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import closing, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from kendama_cli.devices.camera.calibration import camera_models
from kendama_cli.devices.camera.interface import Frame, StaleFrame, open_cameras
from kendama_cli.errors import ConfigError, HardwareError, InputError, MissingPartError
from kendama_cli.plugins.camera_server import server
from kendama_cli.plugins.camera_server.remote import ClockOffset
from kendama_cli.plugins.camera_server.settings import RemoteCamera
from kendama_cli.schema.settings import build
from kendama_cli.settings.camera import DeviceCamera
from kendama_cli.vision.cameras.camera_model import CameraModel
from kendama_cli.vision.cameras.region import Region
from tests.devices.robot.stand_in import LOOPBACK, SECRET, key_file
from tests.shipped_conf import plain

pytestmark = pytest.mark.realtime

PERIOD_S = 0.02


def remote(port: int, key: Path, **changed: Any) -> RemoteCamera:
    """Settings of ours for the server at ``port``."""
    return build(RemoteCamera, plain("camera", "remote") | {"port": port, "key_file": str(key), **changed}, "camera")


def picture(number: int) -> np.ndarray:
    """The image of a number, which can be read in any row of it."""
    rows = np.arange(480)[:, None, None]
    return np.broadcast_to((rows + number) % 256, (480, 640, 3)).astype(np.uint8)


def watch(camera: Any, times: int) -> list[Frame]:
    """Return the newest frame, so many times."""
    seen = []
    for _ in range(times):
        seen.append(camera.latest(max_age_s=30.0))
        time.sleep(0.01)
    return seen


class FakeCamera:
    """A camera that takes image k at k periods of the machine's clock."""

    next_s = None

    def __init__(self, model: CameraModel) -> None:
        self.model = model
        self.fault: HardwareError | None = None

    def latest(self, *, max_age_s: float) -> Frame:
        if self.fault is not None:
            raise self.fault
        number = int(time.monotonic() / PERIOD_S)
        return Frame(number * PERIOD_S, picture(number), (0, 0))

    def close(self) -> None:
        pass


@pytest.fixture
def served(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[int, list[FakeCamera]]]:
    """Port of a server in a thread, and its cameras."""
    settings = build(DeviceCamera, plain("camera", "device"), "camera")
    cameras = [FakeCamera(model) for model in camera_models(settings)]
    monkeypatch.setattr(server, "open_cameras", lambda *_: cameras)
    ready, going, facts = threading.Event(), threading.Event(), {}
    going.set()

    def on_ready(told: Any) -> None:
        facts.update(told)
        ready.set()

    thread = threading.Thread(
        target=server.serve_cameras,
        args=(settings, SECRET),
        kwargs={"on_ready": on_ready, "keep_going": going.is_set},
        daemon=True,
    )
    thread.start()
    assert ready.wait(30)
    yield facts["port"], cameras
    going.clear()
    thread.join(30)


def test_a_camera_behind_the_line_keeps_its_images_and_times(
    served: tuple[int, list[FakeCamera]], tmp_path: Path
) -> None:
    port, _ = served
    left, right = open_cameras(remote(port, key_file(tmp_path), jpeg_quality=None), time.monotonic, None)
    with closing(right), closing(left):
        off_s, numbers, belongs = [], [], []
        for _ in range(100):
            frame = left.latest(max_age_s=30.0)
            number = round(frame.t_s / PERIOD_S)
            assert np.array_equal(frame.pixels, picture(int(frame.pixels[0, 0, 0])))  # to the last bit
            off_s.append(frame.t_s - number * PERIOD_S)
            numbers.append(number)
            belongs.append(number % 256 == frame.pixels[0, 0, 0])  # the stamp is of this image
            time.sleep(0.005)
        assert len(set(numbers)) > 5
        assert np.mean(belongs) > 0.9
        assert abs(np.median(off_s)) < PERIOD_S / 4  # one machine: both clocks are the same
        right.set_region_of_interest(Region(100, 50, 180, 90))
        end_s = time.monotonic() + 30
        while (frame := right.latest(max_age_s=30.0)).pixels.shape != (40, 80, 3):
            assert time.monotonic() < end_s
            time.sleep(0.005)
        assert frame.origin_px == (100, 50)
        assert np.array_equal(np.diff(frame.pixels[:, 0, 0].astype(int)) % 256, np.ones(39))
    jpeg = remote(port, key_file(tmp_path))
    (alone,) = open_cameras(dataclasses.replace(jpeg, cameras=jpeg.cameras[:1]), time.monotonic, None)
    with closing(alone):
        frame = alone.latest(max_age_s=30.0)
        steps = np.diff(frame.pixels[:, 300, 1].astype(float))
        assert 0.5 < steps[steps > -50].mean() < 1.5  # each row is one brighter than the one above, and 256 is 0
        assert frame.pixels.shape == (480, 640, 3)
        with pytest.raises(StaleFrame, match="camera 'left': the newest frame is"):
            alone.latest(max_age_s=-1.0)


def test_who_has_another_key_sees_nothing(served: tuple[int, list[FakeCamera]], tmp_path: Path) -> None:
    port, _ = served
    other = tmp_path / "other.key"
    other.write_text(bytes(32).hex())
    other.chmod(0o600)
    with pytest.raises(
        MissingPartError, match=r"camera 'left' at 127\.0\.0\.1:\d+ is not there: the other end has hung"
    ):
        open_cameras(remote(port, other), time.monotonic, None)
    other.chmod(0o644)
    with pytest.raises(InputError, match="other users may use this key"):
        open_cameras(remote(port, other), time.monotonic, None)


@pytest.mark.parametrize(
    "rubbish",
    [b"GET / HTTP/1.1\r\n\r\n" * 4, b"\xff" * 400, b"\x40\x00\x00\x00" + bytes(64)],
    ids=["http", "ff", "zeros"],
)
def test_a_stranger_is_hung_up_on_without_a_byte(rubbish: bytes, served: tuple[int, list[FakeCamera]]) -> None:
    with socket.create_connection((LOOPBACK, served[0]), timeout=20) as stranger:
        stranger.sendall(rubbish)
        with suppress(ConnectionResetError):
            assert stranger.recv(100) == b""


def test_what_was_recorded_on_the_line_gets_no_image_again(
    served: tuple[int, list[FakeCamera]], tmp_path: Path
) -> None:
    port, _ = served
    heard = bytearray()
    with socket.create_server((LOOPBACK, 0)) as relay:

        def forward() -> None:
            ours, _ = relay.accept()
            with ours, socket.create_connection((LOOPBACK, port)) as theirs:

                def back() -> None:
                    with suppress(OSError):  # the line ends under it
                        while data := theirs.recv(1 << 16):
                            ours.sendall(data)

                threading.Thread(target=back, daemon=True).start()
                while data := ours.recv(1 << 16):
                    heard.extend(data)
                    theirs.sendall(data)

        threading.Thread(target=forward, daemon=True).start()
        one = remote(relay.getsockname()[1], key_file(tmp_path))
        (camera,) = open_cameras(dataclasses.replace(one, cameras=one.cameras[:1]), time.monotonic, None)
        with closing(camera):
            camera.latest(max_age_s=30.0)
    with socket.create_connection((LOOPBACK, port), timeout=20) as thief:
        thief.sendall(bytes(heard))
        got = b""
        with suppress(ConnectionResetError):
            while data := thief.recv(1 << 16):
                got += data
    assert len(got) < 200  # another challenge, to which the recording has no answer


def test_a_camera_that_is_not_served_or_has_another_size_is_refused(
    served: tuple[int, list[FakeCamera]], tmp_path: Path
) -> None:
    settings = remote(served[0], key_file(tmp_path))
    other = dataclasses.replace(settings.cameras[0], name="top")
    with pytest.raises(
        ConfigError, match=r"camera 'top' at .* is not served; the cameras there are called left, right"
    ):
        open_cameras(dataclasses.replace(settings, cameras=(other,)), time.monotonic, None)
    small = dataclasses.replace(settings.cameras[0], width_px=320)
    with pytest.raises(ConfigError, match="has 640 x 480 px, but is calibrated for 320 x 480 px"):
        open_cameras(dataclasses.replace(settings, cameras=(small,)), time.monotonic, None)


def test_a_camera_that_fails_there_fails_here_with_its_words(
    served: tuple[int, list[FakeCamera]], tmp_path: Path
) -> None:
    port, cameras = served
    left, right = open_cameras(remote(port, key_file(tmp_path)), time.monotonic, None)
    with closing(left), closing(right):
        left.latest(max_age_s=30.0)
        cameras[0].fault = HardwareError("its lens fell off")
        with pytest.raises(
            HardwareError, match=r"camera 'left' at .*: its lens fell off; look at 'kendama camera serve'"
        ):
            watch(left, 3000)
        right.latest(max_age_s=30.0)


def test_the_other_clock_is_known_to_half_the_delay_of_the_quickest_exchange() -> None:
    offset, rng = ClockOffset(), np.random.default_rng(0)
    for k in range(50):
        there_s, back_s = 0.001 + rng.exponential(0.02), 0.001 + rng.exponential(0.02)
        if k == 30:
            there_s, back_s = 0.0012, 0.0010
        left_s = 7.0 + k
        came_s = left_s + there_s + 1e6
        answered_s = came_s + 0.013
        offset.add(left_s, came_s, answered_s, answered_s - 1e6 + back_s)
    assert offset.offset_s == pytest.approx(1e6 + 0.0001, abs=1e-8)  # half of 0.2 ms too much: as the law says


class Stream(BaseHTTPRequestHandler):
    """A camera in a network: grey images over HTTP."""

    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=frame")
        self.end_headers()
        for number in range(3000):
            data = cv2.imencode(".jpg", np.full((480, 640, 3), 10 * (number % 20), dtype=np.uint8))[1].tobytes()
            self.wfile.write(b"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n" % len(data) + data)
            self.wfile.write(b"\r\n")
            time.sleep(0.05)

    def log_message(self, *_: object) -> None:
        pass


@pytest.mark.slow
def test_the_command_serves_a_camera_of_another_process_until_it_is_killed(tmp_path: Path) -> None:
    key = key_file(tmp_path)
    with ThreadingHTTPServer((LOOPBACK, 0), Stream) as stream:
        threading.Thread(target=stream.serve_forever, daemon=True).start()
        address = f"http://{LOOPBACK}:{stream.server_port}/video"
        words = ["camera", "serve", "camera=device", f"camera.addresses=[{address},{address}]", "--port", "0"]
        command = [sys.executable, "-m", "kendama_cli.cli.main", *words, "--key-file", str(key)]
        environment = {**os.environ, "KENDAMA_HOME": str(tmp_path / "home")}
        with subprocess.Popen(command, stdout=subprocess.PIPE, env=environment) as process:
            try:
                assert process.stdout is not None
                told = json.loads(process.stdout.readline())
                assert (told["host"], told["cameras"]) == (LOOPBACK, ["left", "right"])
                left, right = open_cameras(remote(told["port"], key), time.monotonic, None)
                with closing(left), closing(right):
                    assert len({int(frame.pixels[200, 300, 0]) // 10 for frame in watch(left, 200)}) > 5
                    process.kill()
                    with pytest.raises(HardwareError, match=r"look at 'kendama camera serve' there|newest frame is"):
                        watch(left, 3000)
            finally:
                process.kill()
        stream.shutdown()
