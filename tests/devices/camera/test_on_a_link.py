"""A camera on a link of the arm: its images, and the model that the tracker uses of it."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kendama_cli.devices.camera.calibration import camera_model
from kendama_cli.devices.camera.virtual import VirtualCameraBlock
from kendama_cli.errors import ConfigError
from kendama_cli.rendering.scene import ScenePose
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.camera import VirtualCamera
from kendama_cli.stages.predict.stage import Predict
from kendama_cli.vision.cameras.camera_model import CameraModel
from kendama_cli.vision.cameras.region import Region
from kendama_cli.vision.detection.interface import make_detector
from tests.memory_context import MemoryContext
from tests.vision.scenes import first_found, game, lighting, predict, virtual

NOTHING = np.empty((0, 3))
BALL_M = np.array([0.1, 0.0, 0.3])


def on_link() -> CameraModel:
    """The left camera of the pair, its pose as if in a link."""
    first = dataclasses.replace(virtual().cameras[0], link="hand")
    return camera_model(first, carried=True)


def whirled(model: CameraModel, t_s: float) -> CameraModel:
    """A link that passes the world's origin at 2 m/s and turns by 3 rad/s about an oblique axis."""
    rotation = Rotation.from_rotvec(np.array([1.0, 2.0, -2.0]) * (t_s - 0.02)).as_matrix()
    return model.carried(rotation, np.array([1.2, 0.0, 1.6]) * (t_s - 0.02))


def standing(model: CameraModel, _: float) -> CameraModel:
    return model.carried(np.eye(3), np.zeros(3))


def camera(model: CameraModel, placed: Any = None, **sensor: Any) -> VirtualCameraBlock:
    settings = dataclasses.replace(virtual(), sensor=dataclasses.replace(virtual().sensor, **sensor))
    return VirtualCameraBlock(
        model,
        settings,
        game(),
        lighting("bright"),
        scene=lambda _: ScenePose(BALL_M, np.array([0.0, 0.0, -5.0]), np.eye(3), NOTHING, NOTHING),
        clock=lambda: 0.03,
        rng=np.random.default_rng(0),
        placed=placed,
    )


def test_a_point_of_the_link_keeps_its_pixel_wherever_the_link_goes() -> None:
    model, point = on_link(), np.array([0.2, 0.3, 0.1])
    rotation, position = Rotation.from_rotvec([0.4, -1.0, 0.3]).as_matrix(), np.array([0.5, -0.2, 1.1])
    carried = model.carried(rotation, position)
    assert carried.link is None
    np.testing.assert_allclose(carried.project(position + rotation @ point), model.project(point), atol=1e-9)


def pixels(made: VirtualCameraBlock, region: Region | None) -> Array:
    made.set_region_of_interest(region)
    return made.latest(max_age_s=1.0).pixels.astype(float)


def test_on_a_link_that_stands_it_sees_what_a_fixed_camera_there_sees() -> None:
    """Each window is rendered for itself, so that a ray differs by its rounding: one level at most."""
    region, model = Region(290, 150, 420, 260), on_link()
    fixed = pixels(camera(standing(model, 0.0)), region)
    assert np.abs(pixels(camera(model, standing), region) - fixed).max() <= 1
    assert np.ptp(fixed) > 100  # the ball is in it


@pytest.mark.parametrize("shutter", ["global", "rolling"])
def test_the_ball_is_seen_where_the_moving_cameras_model_has_it_then(shutter: Any) -> None:
    """Measured 0.012 px; 2 ms of the link's motion, a fraction of the rolling shutter's 6, are 1.8 px."""
    made = camera(on_link(), whirled, shutter=shutter, readout_s=0.006)
    frame = made.latest(max_age_s=1.0)
    seen = first_found(make_detector(predict().detector), frame.pixels, expected_px=None)
    assert seen is not None
    at_s = float(made.model.exposed_s(frame.t_s, seen.centre_px))
    centre_px = made.model.optics.sphere_centre(seen.centre_px, seen.radius_px)
    off_px = [
        float(np.linalg.norm(centre_px - whirled(made.model, t_s).project(BALL_M)[0]))
        for t_s in (at_s, at_s - 0.002, at_s + 0.002)
    ]
    assert off_px[0] < 0.1
    assert min(off_px[1:]) > 1.5


def carried_settings() -> VirtualCamera:
    one, two = virtual().cameras
    return dataclasses.replace(virtual(), cameras=(one, dataclasses.replace(two, link="flange")))


def test_where_there_is_no_arm_a_camera_on_a_link_is_refused_in_one_line() -> None:
    says = "camera 'right' is on link 'flange', but no arm carries it here; use it in 'transfer'"
    stage = Predict(predict=predict(), camera=carried_settings(), game=game(), lighting=lighting("bright"))
    with pytest.raises(ConfigError, match=says):
        stage.run({}, MemoryContext(seed=0))
