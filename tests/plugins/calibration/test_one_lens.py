"""Views of two lenses, zooms or like cameras, and a wrong marker, are told; good sets are not refused."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from kendama_cli.plugins.calibration.board import Board, check_markers, find_board
from kendama_cli.plugins.calibration.calibration import calibrate
from kendama_cli.plugins.calibration.one_lens import check_one_lens
from kendama_cli.vision.cameras.camera_model import CameraModel
from tests.plugins.calibration.board_views import BOARD, camera, poses, view

AT = (-0.12, -0.16, 0.42)


def seen(models: list[CameraModel], seed: int) -> list[Any]:
    """Return the board's views, rendered: each by its own camera."""
    held = poses(len(models), seed)
    found = [
        find_board(BOARD, view(model, pose, seed=seed + i), f"{i:02d}")
        for i, (model, pose) in enumerate(zip(models, held, strict=True))
    ]
    return [one for one in found if one is not None]


def check(views: list[Any]) -> None:
    check_one_lens("left", views, [BOARD.corners_m[one.ids] for one in views], (640, 480))


@pytest.mark.parametrize(
    ("focal", "centre_px", "foreign"),
    [(1.25, (0.0, 0.0), 6), (1.01, (-8.0, 7.0), 2)],
    ids=["another zoom", "a like camera"],
)
def test_views_of_another_lens_are_named(focal: float, centre_px: tuple[float, float], foreign: int) -> None:
    one = camera("left", AT)
    other = replace(one, focal_px=one.focal_px * focal, center_px=one.center_px + centre_px)
    views = seen([one] * (16 - foreign) + [other] * foreign, 10400)
    with pytest.raises(ValueError, match=f"{foreign} of its 16 views are of another lens, zoom or camera") as told:
        check(views)
    assert re.findall(r"'(\d\d)'", str(told.value)) == [view.name for view in views[-foreign:]]
    assert float(re.findall(r"(\d+) px for", str(told.value))[0]) == pytest.approx(other.focal_px[0], rel=0.03)


@pytest.mark.slow
def test_no_good_set_of_fifty_is_refused() -> None:
    one = camera("left", AT)
    for seed in range(50):
        check(seen([one] * (9 + seed % 8), 20_000 + 100 * seed))


def test_a_marker_of_another_size_is_told() -> None:
    image = view(camera("left", AT), poses(1, seed=0)[0])
    for marker_m, told in ((0.022, None), (0.018, "0.60"), (0.024, "0.80")):
        board = Board(7, 5, 0.030, marker_m)
        found = find_board(board, image, "one")
        assert found is not None
        if told is None:
            check_markers(board, [found])
            continue
        with pytest.raises(ValueError, match=rf"marker's side is 0.7\d of a square's in the images, .* mm is {told}"):
            calibrate(board, {"left": [found] * 4}, {"left": (640, 480)}, np.zeros(3))
