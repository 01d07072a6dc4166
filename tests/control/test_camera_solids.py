"""The cameras that are drawn stand where they are calibrated, and their wires are the edges of what they see."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from kendama_cli.control.camera_solids import SEEN_M, camera_solids
from kendama_cli.devices.camera.calibration import camera_models
from kendama_cli.motion.rotation import matrix_of
from kendama_cli.robot_model.arm_scene import Pose
from kendama_cli.settings.camera import CameraSettings
from tests.shipped_conf import configured

ORIGIN = np.array([0.1, -0.2, 1.2])


def no_arm(link: str) -> tuple[str, Pose]:
    raise AssertionError(link)


def test_the_wires_meet_in_the_camera_and_end_at_the_images_corners() -> None:
    settings = configured(CameraSettings, "camera", "virtual")
    solids = camera_solids(settings, ORIGIN, no_arm)
    for number, model in enumerate(camera_models(settings)):
        own = solids[number * 10 : number * 10 + 10]
        assert [one.name for one in own] == ["camera"] * 2 + ["view"] * 8
        ends = []
        for wire in own[2:6]:
            half = matrix_of(wire.rotation_wxyz)[:, 2] * wire.size_m[2] / 2
            start, end = np.array(wire.position_m) - half - ORIGIN, np.array(wire.position_m) + half - ORIGIN
            assert np.linalg.norm(start - model.position_in_world_m) == pytest.approx(0.0, abs=1e-9)
            ends.append(end)
        assert model.depth_m(ends) == pytest.approx([SEEN_M] * 4)
        w, h = model.width_px - 0.5, model.height_px - 0.5
        # a pixel's ray through the lens and back: OpenCV inverts its distortion to a thousandth of a pixel
        np.testing.assert_allclose(model.project(ends), [(-0.5, -0.5), (w, -0.5), (w, h), (-0.5, h)], atol=5e-3)


def test_a_camera_on_a_link_moves_with_the_frame_that_holds_the_link() -> None:
    settings = configured(CameraSettings, "camera", "virtual")
    carried = dataclasses.replace(settings.cameras[0], link="wrist")
    pose = matrix_of([0.5, 0.5, 0.5, 0.5]), np.array([0.1, 0.2, 0.3])
    solids = camera_solids(
        dataclasses.replace(settings, cameras=(carried,)), ORIGIN, lambda link: (f"holder of {link}", pose)
    )
    assert {one.frame for one in solids} == {"holder of wrist"}
    wire = solids[2]
    start = np.array(wire.position_m) - matrix_of(wire.rotation_wxyz)[:, 2] * wire.size_m[2] / 2
    np.testing.assert_allclose(start, pose[1] + pose[0] @ carried.position_m, atol=1e-9)
