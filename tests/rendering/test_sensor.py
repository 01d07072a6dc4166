"""Response to light of a sensor and the path to the computer, and balls of two colours before pictures."""

import dataclasses

import cv2
import numpy as np
import pytest

from kendama_cli.devices.camera.virtual import VirtualCameraBlock
from kendama_cli.errors import InputError
from kendama_cli.rendering.scene import ScenePose
from kendama_cli.vision.cameras.region import Region
from tests.vision.scenes import game, lighting, shipped_models, virtual

BALL_M = np.array([0.1, 0.0, 0.3])
MODEL = shipped_models()[0]
RADIUS_PX = game().ball.radius_m * float(MODEL.focal_px[0]) / float(MODEL.depth_m(BALL_M[None])[0])
AROUND = Region(*(int(c) for c in np.hstack((MODEL.project(BALL_M)[0] - 37, MODEL.project(BALL_M)[0] + 38))))


def camera(*, t_s=0.0, seed=0, sensor=None, appearance=None):
    made = dataclasses.replace(
        virtual(),
        sensor=dataclasses.replace(virtual().sensor, read_noise_e=0.0, full_well_e=1e9, **(sensor or {})),
        appearance=dataclasses.replace(virtual().appearance, **(appearance or {})),
    )
    nothing = np.empty((0, 3))

    def scene(_):
        return ScenePose(BALL_M, np.array([0.0, 0.0, -0.2]), np.eye(3), nothing, nothing)

    return VirtualCameraBlock(
        MODEL, made, game(), lighting("bright"), scene=scene, clock=lambda: t_s + 0.02, rng=np.random.default_rng(seed)
    )


def seen(region=AROUND, **options):
    made = camera(**options)
    made.set_region_of_interest(region)
    return made.latest(max_age_s=1.0).pixels.astype(float)


@pytest.mark.parametrize(
    "sensor", [{"focus_sigma_px": 1.2}, {"encoding": "jpeg", "jpeg_quality": 60}, {"encoding": "yuv420"}]
)
def test_a_region_shows_what_the_whole_image_shows_there(sensor):
    whole = seen(None, sensor=sensor)
    part = whole[AROUND.top : AROUND.bottom, AROUND.left : AROUND.right]
    assert np.array_equal(seen(sensor=sensor), part)
    assert not np.array_equal(seen(), part)


def test_a_lens_out_of_focus_widens_an_edge_by_its_blur():
    def rise_px(pixels):
        row = pixels[37].sum(axis=1)
        slope = np.abs(np.diff(row[: int(37 - 0.3 * RADIUS_PX)]))  # the ball's left edge
        at = np.arange(len(slope))
        middle = (slope @ at) / slope.sum()
        return np.sqrt((slope @ (at - middle) ** 2) / slope.sum())

    flat = {"gamma": 1.0}
    sharp, blurred = rise_px(seen(sensor=flat)), rise_px(seen(sensor={**flat, "focus_sigma_px": 2.0}))
    # a quarter of a pixel: an edge of finite length is not cut off at its ends
    assert blurred**2 - sharp**2 == pytest.approx(4.0, abs=1.0)


def test_halved_colours_keep_the_brightness():
    raw, sent = seen(), seen(sensor={"encoding": "yuv420"})
    grey = [cv2.cvtColor(one.astype(np.uint8), cv2.COLOR_BGR2GRAY).astype(float) for one in (raw, sent)]
    assert np.abs(grey[0] - grey[1]).mean() < 1.5
    assert np.abs(raw - sent).max() > 20  # a red ball's edge smears


def test_the_gain_drifts_as_set():
    drift = {"gain_drift": 0.5, "gain_drift_hz": 0.25, "gamma": 1.0}
    least, most = (seen(sensor=drift, t_s=t_s)[:8, :8].mean() for t_s in (3.0, 1.0))
    assert most / least == pytest.approx(3.0, rel=0.02)


def second_part(pattern, spin_hz=0.0, t_s=0.0):
    """Part of the ball's disc that shows its second colour."""
    look = {"ball_rgb": (0.9, 0.0, 0.0), "ball_second_rgb": (0.0, 0.9, 0.0)}
    flat = {"gamma": 1.0}
    pixels = seen(appearance={**look, "ball_pattern": pattern, "ball_spin_hz": spin_hz}, sensor=flat, t_s=t_s)
    disc = np.hypot(*(np.indices(pixels.shape[:2]) - 37.0)) < 0.8 * RADIUS_PX
    return float((pixels[..., 1] > pixels[..., 2])[disc].mean())


def test_a_ball_shows_its_pattern_and_turns():
    assert second_part("plain") == 0.0
    # the axis of the halves points up at time 0: the camera sees about half of each
    assert 0.3 < second_part("two_tone") < 0.7
    # a band of a = 0.25 / 0.8 of the disc to either side of its middle: 2/pi (asin a + a sqrt(1 - a^2)) = 0.39
    assert second_part("striped") == pytest.approx(0.39, abs=0.06)
    assert 0.15 < second_part("wooden") < 0.55
    turning = [second_part("two_tone", 1.0, t_s) for t_s in np.arange(0.0, 1.0, 0.125)]
    assert max(turning) - min(turning) > 0.5


def test_a_image_hangs_on_the_wall(tmp_path):
    picture = np.zeros((100, 300, 3), dtype=np.uint8)
    picture[:, 150:] = (0, 255, 0)
    cv2.imwrite(str(tmp_path / "wall.png"), picture)
    image = seen(None, appearance={"wall_image": str(tmp_path / "wall.png")})
    wall = image[:150]
    edge = float(MODEL.project(np.array([0.0, virtual().appearance.wall_y_m, 1.0]))[0][0])
    assert wall[:, : int(edge) - 10, 1].max() < 5
    assert wall[:, int(edge) + 10 :, 1].min() > 50
    (tmp_path / "bad.png").write_text("no picture")
    with pytest.raises(InputError, match=r"bad\.png: no image that can be read; give a PNG or JPEG file"):
        camera(appearance={"wall_image": str(tmp_path / "bad.png")})
