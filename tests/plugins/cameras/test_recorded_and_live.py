"""camera=file and camera=device: the same interface, and one clear line for what is missing or wrong."""

import dataclasses
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import cv2
import numpy as np
import pytest

from kendama_cli.devices.camera.calibration import camera_model
from kendama_cli.devices.camera.interface import StaleFrame, open_cameras
from kendama_cli.errors import ConfigError, HardwareError, InputError, MissingPartError
from kendama_cli.plugins.cameras.check import check_cameras
from kendama_cli.plugins.cameras.device import DeviceCameraBlock, open_device
from kendama_cli.plugins.cameras.file import FileCameraBlock
from kendama_cli.plugins.suites.camera import check_camera
from kendama_cli.schema.settings import build
from kendama_cli.settings.camera import DeviceCamera, FileCamera
from kendama_cli.vision.cameras.camera_model import CameraModel
from tests.devices.camera.image_folder import RATE_HZ, images
from tests.plugins.shared.test_video import trimmed
from tests.vision.ball_films import RATE_HZ as FILM_HZ
from tests.vision.ball_films import pendulum, textured, write_film
from tests.vision.scenes import game, lighting, plain, predict, stereo, virtual

MODEL = dataclasses.replace(stereo()[0], width_px=64, height_px=48)


class Clock:
    def __init__(self):
        self.t_s = 0.0

    def __call__(self):
        return self.t_s

    def wait(self, duration_s):
        self.t_s += duration_s


def video(path, n=20, size=(64, 48)):
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), RATE_HZ, size)
    if not writer.isOpened():
        pytest.skip("this OpenCV cannot write the test's video")
    for i in range(n):
        writer.write(np.full((size[1], size[0], 3), 10 * i % 256, dtype=np.uint8))
    writer.release()
    return str(path)


def test_a_folder_of_images_conforms(tmp_path):
    clock = Clock()
    check_camera(FileCameraBlock(MODEL, images(tmp_path), clock=clock), clock, clock.wait, 1 / RATE_HZ)


def test_a_video_conforms_and_its_frames_come_at_its_rate(tmp_path):
    path, clock = video(tmp_path / "flight.avi"), Clock()
    check_camera(FileCameraBlock(MODEL, path, clock=clock), clock, clock.wait, 1 / RATE_HZ)
    again = Clock()
    made = FileCameraBlock(MODEL, path, clock=again)
    again.t_s = 7.5 / RATE_HZ
    frame = made.latest(max_age_s=1.0)
    assert frame.t_s == pytest.approx(7 / RATE_HZ)
    assert abs(float(frame.pixels.mean()) - 70) < 4


def test_images_are_shown_unchanged_at_their_stamps(tmp_path):
    clock = Clock()
    made = FileCameraBlock(MODEL, images(tmp_path), clock=clock)
    clock.t_s = 5 / RATE_HZ
    frame = made.latest(max_age_s=0.001)
    assert frame.t_s == 5 / RATE_HZ
    assert np.array_equal(frame.pixels, cv2.imread(str(tmp_path / "005.png")))


def test_after_the_recordings_end_frames_grow_stale(tmp_path):
    clock = Clock()
    made = FileCameraBlock(MODEL, images(tmp_path), clock=clock)
    clock.t_s = 10.0
    with pytest.raises(StaleFrame, match="camera 'left': the newest frame is 9620 ms old"):
        made.latest(max_age_s=0.1)


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([], "it has no column 'file'; a list of images has the columns file,t_s"),
        (["file,time", "000.png,0"], "it has no column 't_s'"),
        (["file,t_s", "000.png,0", "001.png,soon"], "row 3: t_s is 'soon', not a number of seconds"),
        (["file,t_s", "000.png,1", "001.png,1"], r"row 3: t_s is 1\.0 after 1\.0; times must rise"),
        (["file,t_s", "000.png,0", "gone.png,1"], r"gone\.png, row 3: the image cannot be read \(No such file"),
        (["file,t_s", "000.png,0", "times.csv,1"], r"times\.csv, row 3: it is not an image that OpenCV can read"),
    ],
)
def test_a_wrong_list_of_images_is_reported_in_one_line(tmp_path, rows, message):
    clock = Clock()
    path = images(tmp_path, n=2, rows=rows)
    clock.t_s = 5.0
    with pytest.raises(InputError, match=message) as caught:
        FileCameraBlock(MODEL, path, clock=clock).latest(max_age_s=10.0)
    assert "\n" not in str(caught.value)


def test_a_binary_list_of_images_is_reported_in_one_line(tmp_path):
    path = tmp_path / "times.csv"
    path.write_bytes(bytes(range(256)) * 8)
    with pytest.raises(InputError, match=r"it cannot be read as a list of images|it has no column") as caught:
        FileCameraBlock(MODEL, str(path), clock=Clock())
    assert "\n" not in str(caught.value)


def test_a_corrupt_video_is_reported_in_one_line(tmp_path):
    path = tmp_path / "rubbish.mp4"
    path.write_bytes(np.random.default_rng(0).bytes(5000))
    with pytest.raises(InputError, match=r"rubbish\.mp4: OpenCV cannot read it as a video; convert it"):
        FileCameraBlock(MODEL, str(path), clock=Clock())


def test_a_video_that_was_cut_short_is_reported_where_it_breaks_off(tmp_path):
    path, clock = tmp_path / "flight.avi", Clock()
    name = video(path, n=60)
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 6 // 10])
    clock.t_s = 10.0
    with pytest.raises(InputError, match=r"flight\.avi: it can be read up to frame \d+ of 60; it is damaged"):
        FileCameraBlock(MODEL, name, clock=clock).latest(max_age_s=100.0)


def test_images_of_a_size_that_the_calibration_does_not_know_are_refused(tmp_path):
    expected = "its images are 32 x 24 px, but camera 'left' is calibrated for 64 x 48 px; calibrate"
    with pytest.raises(InputError, match=expected):
        FileCameraBlock(MODEL, images(tmp_path, n=2, size=(24, 32)), clock=Clock())


def file_settings(**changes):
    return build(FileCamera, plain("camera", "file") | changes, "camera")


def test_camera_file_says_what_it_needs():
    with pytest.raises(
        ConfigError, match=r"'camera\.paths' has 0 entries for 2 cameras: give a video, or the times\.csv"
    ):
        open_cameras(file_settings(), Clock(), None)


class Device:
    """A camera device that answers like OpenCV's."""

    def __init__(self, size=(48, 64), opened=True, silent=False, hangs=False):
        self.size, self.opened, self.silent, self.hangs, self.released = size, opened, silent, hangs, 0
        self.count = 0

    def isOpened(self):  # noqa: N802 - OpenCV's name
        return self.opened

    def set(self, *_):
        return True

    def read(self):
        time.sleep(0.002)
        self.count += not self.hangs
        return (False, None) if self.silent else (True, np.full((*self.size, 3), self.count % 256, dtype=np.uint8))

    def release(self):
        self.released += 1


def live(device):
    settings = build(DeviceCamera, plain("camera", "device") | {"latency_s": 0.001}, "camera")
    return DeviceCameraBlock(MODEL, 0, settings, clock=time.monotonic, open_device=lambda _: device)


def test_a_live_camera_conforms_and_lets_go_of_its_device():
    device = Device()
    check_camera(live(device), time.monotonic, time.sleep, 0.02)
    assert device.released >= 1


def test_a_silent_live_camera_is_stale():
    made = live(Device(silent=True))
    with pytest.raises(StaleFrame, match=r"camera 'left': no frame came within 0\.05 s; check its cable"):
        made.latest(max_age_s=0.05)
    made.close()


def test_a_live_camera_that_repeats_one_image_is_stale():
    made = live(Device(hangs=True))
    time.sleep(0.15)
    with pytest.raises(StaleFrame, match=r"came \d+ times again byte for byte: the camera hangs; connect it anew"):
        made.latest(max_age_s=0.1)
    made.close()


def test_a_live_camera_of_another_size_is_refused():
    made = live(Device(size=(24, 32)))
    with pytest.raises(HardwareError, match="camera 'left' delivers 32 x 24 px, but is calibrated for 64 x 48 px"):
        made.latest(max_age_s=1.0)
    made.close()


def test_camera_device_says_what_it_needs():
    settings = build(DeviceCamera, plain("camera", "device"), "camera")
    with pytest.raises(MissingPartError, match="no camera answers at index 97") as caught:
        open_cameras(dataclasses.replace(settings, indices=(97, 98)), Clock(), None)
    assert "\n" not in str(caught.value)


class Stream(BaseHTTPRequestHandler):
    """MJPEG over HTTP, as cameras in a network send it; each image is one grey level, for 20 images a connection."""

    def do_GET(self):
        self.send_response(200)
        self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=frame")
        self.end_headers()
        for number in range(20):
            data = cv2.imencode(".jpg", np.full((48, 64, 3), 10 * number, dtype=np.uint8))[1].tobytes()
            self.wfile.write(b"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n" % len(data) + data)
            self.wfile.write(b"\r\n")
            time.sleep(0.02)
        self.server.connections += 1

    def log_message(self, *_):
        pass


def test_a_stream_by_its_address_is_a_camera_which_is_opened_anew_where_it_breaks_off():
    with ThreadingHTTPServer(("127.0.0.1", 0), Stream) as server:
        server.connections = 0
        threading.Thread(target=server.serve_forever, daemon=True).start()
        address = f"http://user:secret@127.0.0.1:{server.server_port}/video"
        settings = build(DeviceCamera, plain("camera", "device") | {"latency_s": 0.0, "addresses": [address]}, "camera")
        (made,) = open_device(settings, [MODEL], time.monotonic, None)
        levels, end_s = [], time.monotonic() + 60.0
        while server.connections < 2 and time.monotonic() < end_s:
            frame = made.latest(max_age_s=30.0)
            assert frame.pixels.shape == (48, 64, 3)
            levels.append(int(frame.pixels[0, 0, 0]))
            time.sleep(0.005)
        made.close()
        server.shutdown()
    assert server.connections >= 2
    assert len(set(levels)) > 10  # most of its images were seen
    assert np.diff(levels).min() < 0  # and the first ones again
    with pytest.raises(MissingPartError, match=r"no stream at http://127\.0\.0\.1:\d+/video \(camera\.addresses\)"):
        open_device(settings, [MODEL], time.monotonic, None)  # its password is not told


def test_an_address_that_is_none_or_is_not_of_each_camera_is_refused():
    of_file = plain("camera", "device") | {"addresses": ["/dev/video0"]}
    with pytest.raises(ConfigError, match=r"'camera\.addresses' has '/dev/video0'; an address begins with http"):
        build(DeviceCamera, of_file, "camera")
    one = build(DeviceCamera, plain("camera", "device") | {"addresses": ["rtsp://10.0.0.5/video"]}, "camera")
    with pytest.raises(ConfigError, match=r"'camera\.addresses' has 1 entries for 2 cameras"):
        open_cameras(one, Clock(), None)


def test_a_virtual_camera_without_a_scene_is_refused():
    with pytest.raises(ConfigError, match="shows a simulated scene only"):
        open_cameras(virtual(), Clock(), None)


def test_two_cameras_of_one_name_or_no_camera_are_refused():
    both = plain("camera", "file")["cameras"]
    twins = [both[0], both[1] | {"name": both[0]["name"]}]
    with pytest.raises(ConfigError, match="make each name unique"):
        open_cameras(file_settings(cameras=twins), Clock(), None)
    with pytest.raises(ConfigError, match="give at least one calibrated camera"):
        open_cameras(file_settings(cameras=[]), Clock(), None)


def test_a_pose_is_reported_once_and_only_once():
    one = plain("camera", "file")["cameras"][0]
    with pytest.raises(ConfigError, match=r"'look_at_m' or 'rotation_wxyz' must give|look_at_m"):
        file_settings(cameras=[one | {"rotation_wxyz": [1, 0, 0, 0]}])
    turned = file_settings(cameras=[one | {"look_at_m": None, "rotation_wxyz": [0.5, 0, 0, 0]}]).cameras[0]
    with pytest.raises(ConfigError, match=r"has length 0\.5; it must be 1"):
        camera_model(turned)


def test_a_quaternion_and_a_target_tell_the_same_pose():
    one = plain("camera", "virtual")["cameras"][0] | {"position_m": [0, -1.5, 0], "look_at_m": [0, 0, 0]}
    by_target = camera_model(file_settings(cameras=[one]).cameras[0])
    half = np.sqrt(0.5)  # camera x, y, z along world x, -z, y: a quarter turn about x
    quaternion = one | {"look_at_m": None, "rotation_wxyz": [half, -half, 0.0, 0.0]}
    by_rotation = camera_model(file_settings(cameras=[quaternion]).cameras[0])
    assert np.allclose(by_target.world_to_camera, by_rotation.world_to_camera, atol=1e-12)


def test_a_recorded_camera_takes_a_trimmed_video_for_a_whole_one(tmp_path):
    mp4 = tmp_path / "film.mp4"
    write_film(mp4, pendulum(24, 10310, background=textured(10311))[0], "mp4v")
    trimmed(mp4, 8)
    model = CameraModel(
        "film", 320, 240, np.full(2, 300.0), np.array([159.5, 119.5]), np.zeros(5), np.eye(3), np.zeros(3)
    )
    camera = FileCameraBlock(model, str(mp4), clock=lambda: 100.0)
    assert camera.latest(max_age_s=1000.0).t_s < 12 / FILM_HZ


def test_a_look_through_a_camera_on_a_link_is_refused_where_no_arm_carries_it():
    one, two = virtual().cameras
    carried = dataclasses.replace(virtual(), cameras=(one, dataclasses.replace(two, link="flange")))
    with pytest.raises(ConfigError, match="camera 'right' is on link 'flange', but no arm carries it here"):
        check_cameras(carried, lighting("bright"), game(), predict(), seconds=0.1, seed=0)
