"""Background of a scene: stored for a camera that is opened again, and for no other."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np
import pytest

from kendama_cli.rendering.background import Background, background
from tests.vision.scenes import lighting, shipped_models, virtual

LEFT, RIGHT = shipped_models()
LOOK, LIGHT = virtual().appearance, lighting("bright")


def test_a_camera_that_is_opened_again_has_the_background_that_it_had() -> None:
    again = dataclasses.replace(LEFT, focal_px=LEFT.focal_px.copy())  # another object with the same numbers
    pairs = [(background(one, LOOK, LIGHT), background(RIGHT, LOOK, LIGHT)) for one in (LEFT, again)]
    assert pairs[0][0][0] is pairs[1][0][0]
    assert pairs[0][1][0] is pairs[1][1][0]
    assert pairs[0][0][0] is not pairs[0][1][0]


@pytest.mark.parametrize(
    "change",
    [
        {"model": dataclasses.replace(LEFT, position_in_world_m=LEFT.position_in_world_m + 0.01)},
        {"model": dataclasses.replace(LEFT, focal_px=LEFT.focal_px * 1.01)},
        {"model": dataclasses.replace(LEFT, distortion=LEFT.distortion + 0.01)},
        {"model": RIGHT},
        {"appearance": dataclasses.replace(LOOK, wall_rgb=(0.1, 0.2, 0.3))},
        {"lighting": lighting("side")},
    ],
    ids=["place", "focal length", "distortion", "camera", "paint", "light"],
)
def test_another_camera_paint_or_light_has_its_own(change: dict[str, object]) -> None:
    usual = {"model": LEFT, "appearance": LOOK, "lighting": LIGHT}
    background(**usual)
    kept, fresh = background(**{**usual, **change})[0], Background(**{**usual, **change})
    for name in ("rays", "points", "unlit", "lit"):
        assert np.array_equal(getattr(kept, name), getattr(fresh, name)), name


def test_a_image_on_the_wall_that_was_changed_is_seen(tmp_path) -> None:
    look = dataclasses.replace(LOOK, wall_image=str(tmp_path / "wall.png"))
    seen = []
    for grey in (20, 200):
        cv2.imwrite(str(tmp_path / "wall.png"), np.full((10, 30, 3), grey, dtype=np.uint8))
        seen.append(float(background(LEFT, look, LIGHT)[0].unlit.mean()))
    assert seen[0] < seen[1]
