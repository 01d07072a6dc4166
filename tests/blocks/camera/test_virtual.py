"""The virtual camera: pictures of poses, by the laws that real pictures keep."""

import dataclasses

import numpy as np
import pytest

from kendama_cli.blocks.camera.conformance import check_camera
from kendama_cli.blocks.camera.interface import StaleFrame
from kendama_cli.blocks.camera.scene import ScenePose, hanging_rope
from kendama_cli.blocks.camera.virtual import VirtualCameraBlock
from kendama_cli.errors import HardwareError
from kendama_cli.vision.region import Region, around
from tests.vision.scenes import game, lighting, shipped_models, virtual

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


def camera(scene, clock, *, light="bright", seed=0, model=0):
    made = shipped_models()[model]
    return VirtualCameraBlock(
        made, virtual(), game(), lighting(light), scene=scene, clock=clock, rng=np.random.default_rng(seed)
    )


def test_conforms():
    clock = Clock()
    check_camera(camera(still([0.1, 0, 0.3]), clock), clock, clock.wait, 1 / virtual().rate_hz)


def test_stamps_are_mid_exposure_on_the_frame_grid_and_a_frame_comes_only_after_its_exposure():
    clock, period, half = Clock(), 1 / virtual().rate_hz, virtual().sensor.exposure_s / 2
    made = camera(still([0.1, 0, 0.3]), clock)
    made.watch(Region(0, 0, 8, 8))
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
        made.watch(region)
        return made.latest(max_age_s=1.0).pixels

    assert np.array_equal(shot(1), shot(1))
    assert not np.array_equal(shot(1), shot(2))


def test_a_watched_region_shows_what_the_whole_image_shows_there():
    """Before noise: the light itself, pixel for pixel."""
    made = camera(still([0.1, 0, 0.3], np.array([[0.6, 0.5, -0.5], [0.3, 0.3, 0.1], [0, 0, -0.04]])), Clock())
    bodies = made._bodies(made._scene(0.0), made._scene(0.002), 0.002)
    image = made._raycaster.render(bodies, Region(0, 0, 640, 480), 0.0, 0.002)
    part = Region(270, 110, 410, 250)
    crop = made._raycaster.render(bodies, part, 0.0, 0.002)
    assert np.abs(image[part.top : part.bottom, part.left : part.right] - crop).max() < 1e-6


def light_of_ball(made, ball, velocity=(0, 0, 0), exposure_s=0.002):
    """Difference that the ball makes to the light of a region about it, and the region."""
    ball, v = np.asarray(ball, dtype=float), np.asarray(velocity, dtype=float)

    def at(t_s):
        return ScenePose(ball + t_s * v, np.array([0, 0, -5.0]), np.eye(3), NOTHING, NOTHING)

    half = exposure_s / 2
    region = around(made.model.project(ball)[0], 30)
    with_ball = made._bodies(at(-half), at(half), exposure_s)
    shown = made._raycaster.render(with_ball, region, 0.0, exposure_s)
    empty = made._raycaster.render(with_ball[:-1], region, 0.0, exposure_s)
    return np.abs(shown - empty).sum(axis=2) > 0.02, shown, region


def test_the_ball_covers_the_pixels_that_projective_geometry_says():
    made = camera(still([0, 0, 0]), Clock())
    for ball in ([0.0, 0.0, 0.3], [-0.3, 0.1, 0.1], [0.25, -0.2, 0.45]):
        covered, _, region = light_of_ball(made, ball)
        rows, columns = np.nonzero(covered)
        centre = np.array([columns.mean() + region.left, rows.mean() + region.top])
        assert np.abs(centre - made.model.project(ball)[0]).max() < 0.35
        expected = np.pi * (600 * 0.02 / made.model.depth_m(np.array(ball))) ** 2
        assert covered.sum() == pytest.approx(expected, rel=0.22)  # edge pixels count whole; distortion shrinks


def test_motion_blurs_along_the_path_and_leaves_the_middle_where_it_is():
    made = camera(still([0, 0, 0]), Clock())
    resting, _, _ = light_of_ball(made, [0, 0, 0.3])
    moving, _, _ = light_of_ball(made, [0, 0, 0.3], velocity=(3.0, 0, 0), exposure_s=0.01)
    grown = np.ptp(np.nonzero(moving)[1]) - np.ptp(np.nonzero(resting)[1])
    assert grown == pytest.approx(0.03 * 600 / 1.5, abs=2.5)
    assert np.ptp(np.nonzero(moving)[0]) == pytest.approx(np.ptp(np.nonzero(resting)[0]), abs=1)
    assert np.nonzero(moving)[1].mean() == pytest.approx(np.nonzero(resting)[1].mean(), abs=0.3)


def test_the_nearer_body_hides_the_farther():
    made = camera(still([0, 0, 0]), Clock())

    def red_pixels(cup_y):
        pose = ScenePose(np.array([0, 0, 0.02]), np.array([-0.02, cup_y, 0.0]), np.eye(3), NOTHING, NOTHING)
        bodies = made._bodies(pose, pose, 0.002)
        region = around(made.model.project(pose.ball_m)[0], 25)
        light = made._raycaster.render(bodies, region, 0.0, 0.002)
        return int((light[..., 0] > 3 * light[..., 1]).sum())

    assert red_pixels(0.12) > 150
    assert red_pixels(-0.12) == 0


def test_one_looks_into_the_cup_from_above_but_not_from_the_side():
    made = camera(still([0, 0, 0]), Clock())

    def red_pixels(tie_z):
        pose = ScenePose(np.array([0, 0.02, tie_z + 0.045]), np.array([0, 0, tie_z]), np.eye(3), NOTHING, NOTHING)
        bodies = made._bodies(pose, pose, 0.002)
        light = made._raycaster.render(bodies, Region(0, 0, 640, 480), 0.0, 0.002)
        return int((light[..., 0] > 3 * light[..., 1]).sum())

    assert red_pixels(0.25) == 0
    assert red_pixels(-0.4) > 5


def test_a_body_throws_a_shadow_on_the_table_and_only_a_lamp_makes_one():
    bright = camera(still([0, 0, 0]), Clock())
    unlit = dataclasses.replace(lighting("bright"), lamps=())
    dark = VirtualCameraBlock(
        shipped_models()[0], virtual(), game(), unlit,
        scene=still([0, 0, 0]), clock=Clock(), rng=np.random.default_rng(0),
    )  # fmt: skip
    table = Region(0, 380, 640, 480)

    def darker(made, z):
        pose = ScenePose(np.array([0.0, 0.3, z]), np.array([0, 0, -9.0]), np.eye(3), NOTHING, NOTHING)
        far = ScenePose(np.array([0.0, -30.0, z]), pose.cup_m, np.eye(3), NOTHING, NOTHING)
        light, free = (made._raycaster.render(made._bodies(p, p, 0.002), table, 0.0, 0.002) for p in (pose, far))
        return (light.sum(axis=2) < 0.95 * free.sum(axis=2)).sum()

    assert darker(bright, -0.4) > 30
    assert darker(dark, -0.4) == 0


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
        made.watch(Region(100, 60, 160, 120))
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
