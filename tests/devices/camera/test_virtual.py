"""The virtual camera: pictures of poses, by the laws that real pictures keep."""

import dataclasses

import numpy as np
import pytest

from kendama_cli.devices.camera.interface import StaleFrame
from kendama_cli.devices.camera.virtual import VirtualCameraBlock
from kendama_cli.errors import ConfigError, HardwareError
from kendama_cli.plugins.suites.camera import check_camera
from kendama_cli.rendering.scene import ScenePose, hanging_rope
from kendama_cli.schema.settings import build
from kendama_cli.settings.camera import VirtualCamera
from kendama_cli.vision.cameras.region import Region, around
from tests.vision.scenes import game, lighting, plain, shipped_models, virtual

NOTHING = np.empty((0, 3))


class Clock:
    def __init__(self):
        self.t_s = 0.0

    def __call__(self):
        return self.t_s

    def wait(self, duration_s):
        self.t_s += duration_s


def still(ball, arm=NOTHING):
    return lambda t_s: ScenePose(np.asarray(ball, dtype=float), np.zeros(3), np.eye(3), NOTHING, arm)


def camera(scene, clock, *, light="bright", seed=0, sensor=None):
    settings = dataclasses.replace(virtual(), sensor=dataclasses.replace(virtual().sensor, **(sensor or {})))
    return VirtualCameraBlock(
        shipped_models()[0], settings, game(), lighting(light), scene=scene, clock=clock,
        rng=np.random.default_rng(seed),
    )  # fmt: skip


@pytest.mark.parametrize("shutter", ["global", "rolling"])
def test_conforms(shutter):
    clock = Clock()
    made = camera(still([0.1, 0, 0.3]), clock, sensor={"shutter": shutter, "readout_s": 0.004})
    check_camera(made, clock, clock.wait, 1 / virtual().rate_hz)


def test_stamps_are_mid_exposure_on_the_frame_grid_and_a_frame_comes_only_after_its_exposure():
    clock, period, half = Clock(), 1 / virtual().rate_hz, virtual().sensor.exposure_s / 2
    made = camera(still([0.1, 0, 0.3]), clock)
    made.set_region_of_interest(Region(0, 0, 8, 8))
    clock.t_s = 3 * period + half - 1e-6
    assert made.latest(max_age_s=1.0).t_s == pytest.approx(2 * period)
    clock.t_s = 3 * period + half + 1e-6
    assert made.latest(max_age_s=1.0).t_s == pytest.approx(3 * period)


def test_before_the_first_exposure_there_is_no_frame():
    clock = Clock()
    clock.t_s = -1.0
    with pytest.raises(StaleFrame, match=r"camera 'left': no frame yet at -1\.000 s") as caught:
        camera(still([0, 0, 0.3]), clock).latest(max_age_s=1.0)
    assert isinstance(caught.value, HardwareError)


def test_a_stale_frame_is_refused_in_one_line():
    clock = Clock()
    clock.t_s = 0.008
    with pytest.raises(StaleFrame, match=r"camera 'left': the newest frame is 8 ms old, allowed are 1 ms; check"):
        camera(still([0, 0, 0.3]), clock).latest(max_age_s=0.001)


def test_the_same_seed_gives_the_same_bytes_and_another_seed_other_noise():
    clock = Clock()
    clock.t_s = 0.01
    region = Region(280, 150, 360, 230)

    def shot(seed):
        made = camera(still([0.0, 0, 0.3]), clock, seed=seed)
        made.set_region_of_interest(region)
        return made.latest(max_age_s=1.0).pixels

    assert np.array_equal(shot(1), shot(1))
    assert not np.array_equal(shot(1), shot(2))


def posed(ball, cup=(0.0, 0.0, -5.0), arm=NOTHING):
    return ScenePose(np.asarray(ball, dtype=float), np.asarray(cup, dtype=float), np.eye(3), NOTHING, arm)


def light_of(made, scene, region):
    """The light itself (h, w, 3), before noise and gamma, of one exposure about 0 s."""
    made._scene = scene
    return made._light(0.0)(region)


ARM = np.array([[0.6, 0.5, -0.5], [0.3, 0.3, 0.1], [0.0, 0.0, -0.04]])


@pytest.mark.parametrize("shutter", ["global", "rolling"])
def test_a_region_of_interest_shows_what_the_whole_image_shows_there_byte_for_byte(shutter):
    def scene(t_s):
        swing = np.array([0.4 * t_s, 0.0, 0.3 * t_s])
        return ScenePose(
            swing + np.array([0.1, 0, 0.3]), swing, np.eye(3), hanging_rope(swing, [0.1, 0, 0.3], 0.5), ARM + swing
        )

    def shot(region):
        clock = Clock()
        clock.t_s = 0.02
        made = camera(scene, clock, sensor={"shutter": shutter, "readout_s": 0.006})
        made.set_region_of_interest(region)
        return made.latest(max_age_s=1.0)

    part = Region(270, 110, 417, 253)
    crop = shot(part)
    assert crop.origin_px == (270, 110)
    assert np.array_equal(shot(None).pixels[part.top : part.bottom, part.left : part.right], crop.pixels)


def light_of_ball(made, ball, velocity=(0, 0, 0)):
    """Difference that the ball makes to the light of a region about it, and the region."""
    ball, v = np.asarray(ball, dtype=float), np.asarray(velocity, dtype=float)
    region = around(made.model.project(ball)[0], 30)
    shown = light_of(made, lambda t_s: posed(ball + t_s * v), region)
    empty = light_of(made, lambda _: posed([0.0, -30.0, 0.0]), region)
    return np.abs(shown - empty).sum(axis=2), region


def test_the_ball_covers_the_pixels_that_projective_geometry_says():
    made = camera(still([0, 0, 0]), Clock(), light="backlit")
    for ball in ([0.0, 0.0, 0.3], [-0.3, 0.1, 0.1], [0.25, -0.2, 0.45]):
        difference, region = light_of_ball(made, ball)
        covered = difference / difference.max()  # an evenly dark ball before an evenly bright wall
        rows, columns = np.indices(covered.shape)
        centre = np.array([(covered * columns).sum(), (covered * rows).sum()]) / covered.sum()
        centre += (region.left, region.top)
        assert np.abs(centre - made.model.project(ball)[0]).max() < 0.1
        expected = np.pi * (600 * 0.02 / made.model.depth_m(np.array(ball))) ** 2
        assert covered.sum() == pytest.approx(expected, rel=0.12)  # distortion shrinks


def test_motion_blurs_along_the_path_and_leaves_the_middle_where_it_is():
    made = camera(still([0, 0, 0]), Clock(), sensor={"exposure_s": 0.008})
    resting, moving = (light_of_ball(made, [0, 0, 0.3], (speed, 0, 0))[0] > 0.02 for speed in (0.0, 3.0))
    grown = np.ptp(np.nonzero(moving)[1]) - np.ptp(np.nonzero(resting)[1])
    assert grown == pytest.approx(0.024 * 600 / 1.5, abs=2.5)
    assert np.ptp(np.nonzero(moving)[0]) == pytest.approx(np.ptp(np.nonzero(resting)[0]), abs=1)
    assert np.nonzero(moving)[1].mean() == pytest.approx(np.nonzero(resting)[1].mean(), abs=0.3)


def test_a_moving_arm_blurs_too():
    def scene(speed):
        return lambda t_s: posed([0, -30, 0], arm=np.array([[0, 0, -0.3], [0, 0, 0.6]]) + np.array([speed * t_s, 0, 0]))

    made = camera(still([0, 0, 0]), Clock(), light="backlit", sensor={"exposure_s": 0.008})
    row = Region(200, 200, 440, 201)
    still_row, moving_row = (light_of(made, scene(speed), row)[0].sum(axis=1) for speed in (0.0, 3.0))
    between = [((line > 1.1 * line.min()) & (line < 0.95 * line.max())).sum() for line in (still_row, moving_row)]
    assert between[0] <= 4
    assert between[1] / 2 == pytest.approx(0.024 * 600 / 1.5, abs=2.5)  # two borders, 9.6 px each


def test_a_rolling_shutter_leans_what_moves_and_dates_each_row():
    """A falling pole's x in row v is that of the moment t_s + (v - 239.5) row_s."""
    speed, readout_s = 3.0, 0.006

    def scene(t_s):
        return posed([0, -30, 0], arm=np.array([[speed * t_s, 0, -0.35], [speed * t_s, 0, 0.85]]))

    made = camera(scene, Clock(), light="backlit", sensor={"shutter": "rolling", "readout_s": readout_s})
    made._clock.t_s = 0.0052
    assert made.model.row_s == pytest.approx(readout_s / 480)
    for v in (60, 240, 420):
        row = light_of(made, scene, Region(100, v, 540, v + 1))[0].sum(axis=1)
        dark = np.nonzero(row < (row.max() + row.min()) / 2)[0].mean() + 100
        t_s = (v - 239.5) * made.model.row_s
        along = [made.model.project([speed * t_s, 0, z])[0] for z in np.linspace(-0.35, 0.85, 4001)]
        seen = min(along, key=lambda pixel: abs(pixel[1] - v))
        assert dark == pytest.approx(seen[0], abs=0.6)


def test_a_frame_of_a_rolling_shutter_comes_only_after_its_last_row():
    clock, period = Clock(), 1 / virtual().rate_hz
    made = camera(still([0.1, 0, 0.3]), clock, sensor={"shutter": "rolling", "readout_s": 0.006})
    made.set_region_of_interest(Region(0, 0, 8, 8))
    clock.t_s = 3 * period + 0.004 - 1e-6
    assert made.latest(max_age_s=1.0).t_s == pytest.approx(2 * period)
    clock.t_s = 3 * period + 0.004 + 1e-6
    assert made.latest(max_age_s=1.0).t_s == pytest.approx(3 * period)


def test_a_frame_that_takes_longer_than_its_period_is_refused():
    slow = {"sensor": plain("camera", "virtual")["sensor"] | {"shutter": "rolling", "readout_s": 0.007}}
    with pytest.raises(ConfigError, match=r"takes 0\.009 s per frame .* 'rate_hz' 120 leaves 0\.008333 s; shorten"):
        build(VirtualCamera, plain("camera", "virtual") | slow, "camera")


def test_the_nearer_body_hides_the_farther():
    made = camera(still([0, 0, 0]), Clock())

    def red_pixels(cup_y):
        pose = posed([0, 0, 0.02], [-0.02, cup_y, 0.0])
        light = light_of(made, lambda _: pose, around(made.model.project(pose.ball_m)[0], 25))
        return int((light[..., 0] > 3 * light[..., 1]).sum())

    assert red_pixels(0.12) > 150
    assert red_pixels(-0.12) == 0


def test_one_looks_into_the_cup_from_above_but_not_from_the_side():
    made = camera(still([0, 0, 0]), Clock())

    def red_pixels(tie_z):
        pose = posed([0, 0.02, tie_z + 0.045], [0, 0, tie_z])
        light = light_of(made, lambda _: pose, Region(0, 0, 640, 480))
        return int((light[..., 0] > 3 * light[..., 1]).sum())

    assert red_pixels(0.25) == 0
    assert red_pixels(-0.4) > 5


@pytest.mark.parametrize("body", ["ball", "cup", "arm"])
def test_a_body_throws_a_shadow_on_the_table_and_only_a_lamp_makes_one(body):
    far = [0.0, -30.0, 0.0]
    pole = np.array([[0.0, 0.3, -0.4], [0.1, 0.3, -0.4]])
    shown = {
        "ball": posed([0.0, 0.3, -0.4], far), "cup": posed(far, [0.0, 0.3, -0.45]), "arm": posed(far, far, pole)
    }[body]  # fmt: skip
    table = Region(0, 380, 640, 480)

    def darker(lamps):
        light = dataclasses.replace(lighting("bright"), lamps=lamps)
        made = VirtualCameraBlock(
            shipped_models()[0], virtual(), game(), light, scene=None, clock=Clock(), rng=np.random.default_rng(0)
        )
        with_body, free = (light_of(made, lambda _, p=p: p, table) for p in (shown, posed(far, far)))
        return (with_body.sum(axis=2) < 0.95 * free.sum(axis=2)).sum()

    lamps = lighting("bright").lamps
    only_itself = darker(())  # a darker body than the table counts as well
    assert darker(lamps[:1]) > only_itself + 30
    assert darker(lamps) > only_itself + 30


def test_lighting_changes_the_light_but_not_the_geometry():
    means = {}
    for name in ("bright", "dim", "side"):
        clock = Clock()
        clock.t_s = 0.01
        means[name] = camera(still([0, 0, 0.3]), clock, light=name).latest(max_age_s=1).pixels.mean()
    assert means["bright"] > means["side"] > means["dim"]


def test_flicker_changes_from_frame_to_frame_and_bright_does_not():
    def scatter(light):
        clock, means = Clock(), []
        made = camera(still([0, 0, 0.3]), clock, light=light)
        made.set_region_of_interest(Region(100, 60, 160, 120))
        for frame in range(1, 7):
            clock.t_s = frame / virtual().rate_hz + 0.0011
            means.append(made.latest(max_age_s=1).pixels.mean())
        return np.std(means)

    assert scatter("flicker") > 5
    assert scatter("bright") < 0.5


def test_a_slack_rope_hangs_and_a_taut_one_is_straight():
    tie, ball = np.zeros(3), np.array([0.3, 0.0, 0.1])
    taut = hanging_rope(tie, ball, float(np.linalg.norm(ball)))
    assert np.abs(np.cross(taut - tie, ball)).max() < 1e-12
    slack = hanging_rope(tie, ball, 0.4)
    assert slack[4, 2] < taut[4, 2] - 0.03
    assert np.allclose(slack[[0, -1]], [tie, ball])
    length = np.linalg.norm(np.diff(hanging_rope(tie, ball, 0.33, 400), axis=0), axis=1).sum()
    assert length == pytest.approx(0.33, rel=0.02)
