"""Rendered phone films of a swing from the side, with the truth, and boxes as a person draws them.

    python -m tests.plugins.films.swing_film FILM.mp4

writes the film of the tutorial and, into FILM-boxes, its boxes.
"""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from kendama_cli.devices.camera.interface import SceneSource
from kendama_cli.devices.camera.virtual import open_virtual
from kendama_cli.plugins.films.ball_box import BallBox, TrainedImage
from kendama_cli.plugins.films.boxes import write_labelled
from kendama_cli.plugins.shared.videos.video_writer import h264_video
from kendama_cli.rendering.scene import ScenePose, hanging_rope
from kendama_cli.simulation.dart.hand_world import Swing, carry_cup
from kendama_cli.vision.cameras.camera_model import CameraModel
from kendama_cli.vision.cameras.region import around
from tests.vision.scenes import game, lighting, virtual

ROOT = Path(__file__).parents[3]
CAUGHT = {12: 1.04, 8: 1.07, 7: 1.04, 6: 0.95, 11: 1.07, 4: 0.98, 10: 1.10, 3: 0.92}
"""Bundled swings by number, and times as long as they last for the ball to fall into the cup, as it did for who was
filmed."""
BEHIND_M = np.array([0.0, -50.0, 0.0])
"""Behind every camera."""
MARGIN_M = 0.09
"""Metres about the middles of what moves: a cup, and a ball in the time of an exposure."""
FOREARM_M = np.array([(0.0, 0.0, -0.045), (0.33, 0.10, -0.17)])
"""Hand and elbow from the tie point."""


@dataclass(frozen=True)
class Shoot:
    """Conditions of a film: the camera's distance, how far it is turned from square and leans to a side, its rate,
    and the shake of the hand that holds it (0: it leans on something)."""

    away_m: float = 2.0
    yaw_deg: float = 0.0
    roll_deg: float = 0.0
    rate_hz: float = 60.0
    shake_px: float = 0.0
    width_px: int = 1280
    height_px: int = 720
    focal_px: float = 1000.0
    exposure_s: float = 0.004


@dataclass(frozen=True)
class Filmed:
    """A film's frames, their times (n,) [s], the cup's middle and the ball's centre in each (n, 2) [px], half the sides
    of a box about them (n, 2, 2) [px], and the swing behind it."""

    frames: list[np.ndarray]
    t_s: np.ndarray
    cup_px: np.ndarray
    ball_px: np.ndarray
    half_px: np.ndarray
    swing: Swing


def person_swing(number: int = 12, rests_s: float = 0.3) -> Swing:
    """The bundled swing ``number``, at a tempo at which the ball is caught."""
    rows = np.loadtxt(ROOT / f"data/demonstrations/swing-{number:02d}.csv", delimiter=",", comments=("#", "t"))
    t_s, cup_m = CAUGHT[number] * rows[:, 0], rows[:, 1:] - rows[0, 1:]
    t_s = np.concatenate([[0.0], t_s + rests_s])
    return carry_cup(game(), t_s, np.vstack([cup_m[:1], cup_m]), rope_m=None, aside_m=0.0, after_s=rests_s)


def camera(shoot: Shoot) -> CameraModel:
    """A camera that looks at the middle of the swing, level but for its roll."""
    yaw, roll = np.radians([shoot.yaw_deg, shoot.roll_deg])
    ahead = np.array([np.sin(yaw), np.cos(yaw), 0.0])
    right, down = np.array([np.cos(yaw), -np.sin(yaw), 0.0]), np.array([0.0, 0.0, -1.0])
    rows = np.array([np.cos(roll) * right + np.sin(roll) * down, np.cos(roll) * down - np.sin(roll) * right, ahead])
    middle = np.array([(shoot.width_px - 1) / 2, (shoot.height_px - 1) / 2])
    focal = np.full(2, shoot.focal_px)
    position = np.array([-0.15, 0.0, 0.05]) - shoot.away_m * ahead
    return CameraModel("phone", shoot.width_px, shoot.height_px, focal, middle, np.zeros(5), rows, position)


def upright(t_s: float) -> np.ndarray:
    """A cup that never turns: its axes (3, 3) in the world."""
    return np.eye(3)


def filmed(swing: Swing, shoot: Shoot, seed: int, turn: Callable[[float], np.ndarray] = upright) -> Filmed:
    """Film the swing with the product's virtual camera; ``turn`` returns the cup's axes (3, 3) at a time.

    The wall without anything before it is rendered once, and each frame about what moves.
    """
    rng = np.random.default_rng(seed)
    shipped = virtual()
    appearance = dataclasses.replace(
        shipped.appearance,
        ball_rgb=(0.62, 0.42, 0.10), ball_pattern="two_tone", ball_second_rgb=(0.05, 0.12, 0.35),
        cup_rgb=(0.55, 0.12, 0.10), arm_rgb=(0.45, 0.30, 0.24), wall_y_m=1.2, table_z_m=-0.9,
    )  # fmt: skip
    sensor = dataclasses.replace(shipped.sensor, exposure_s=shoot.exposure_s, full_well_e=6000.0)
    settings = dataclasses.replace(shipped, rate_hz=shoot.rate_hz, appearance=appearance, sensor=sensor)
    rope_m = game().rope.length_m

    def scene(t_s: float) -> ScenePose:
        cup, ball = (np.array([np.interp(t_s, swing.t_s, one) for one in path.T]) + away_m[0] for path in paths)
        return ScenePose(ball, cup, turn(t_s), hanging_rope(cup, ball, rope_m), cup + FOREARM_M)

    paths, away_m = (swing.cup_m, swing.ball_m), [BEHIND_M]
    clock = [0.5 / shoot.rate_hz]
    source = SceneSource(scene, game(), lighting("bright"), [rng])
    (device,) = open_virtual(settings, [camera(shoot)], lambda: clock[0], source)
    times = np.arange(0.0, swing.t_s[-1], 1 / shoot.rate_hz)
    shake = np.array([_hand_shake(len(times), shoot, rng) for _ in range(2)]).T
    wall = device.latest(max_age_s=1.0).pixels
    device.restart()
    away_m[0] = np.zeros(3)
    frames = []
    for t_s, (u, v) in zip(times, shake, strict=True):
        clock[0] = t_s + 0.5 / shoot.rate_hz
        here = scene(t_s)
        seen_px = camera(shoot).project(np.vstack([here.cup_m, here.ball_m, here.arm_m]))
        middle_px = (seen_px.min(axis=0) + seen_px.max(axis=0)) / 2
        device.set_region_of_interest(
            around(middle_px, np.ptp(seen_px, axis=0) / 2 + MARGIN_M * shoot.focal_px / shoot.away_m)
        )
        frame = device.latest(max_age_s=1.0)
        (left, top), (height, width) = frame.origin_px, frame.pixels.shape[:2]
        pixels = wall.copy()
        pixels[top : top + height, left : left + width] = frame.pixels
        if shoot.shake_px:
            way = np.array([[1.0, 0.0, u], [0.0, 1.0, v]])
            size = (shoot.width_px, shoot.height_px)
            pixels = cv2.warpAffine(pixels, way, size, borderMode=cv2.BORDER_REPLICATE)
        frames.append(np.ascontiguousarray(pixels))
    model = camera(shoot)
    cup, ball = (np.column_stack([np.interp(times, swing.t_s, one) for one in path.T]) for path in paths)
    depth = model.depth_m(cup)
    cup_px, ball_px = (
        model.project(cup + np.array([0.0, 0.0, game().cup.depth_m / 2])) + shake,
        model.project(ball) + shake,
    )
    sides = [[game().cup.outer_radius_m, game().cup.depth_m / 2], 2 * [game().ball.radius_m]]
    half = (shoot.focal_px / depth)[:, None, None] * np.array(sides)
    return Filmed(frames, times, cup_px, ball_px, half, swing)


def _hand_shake(count: int, shoot: Shoot, rng: np.random.Generator) -> np.ndarray:
    """A hand's tremor of a few hertz, ``shake_px`` rms."""
    t_s = np.arange(count) / shoot.rate_hz
    waves = sum(np.sin(2 * np.pi * (hz * t_s + rng.random())) / hz for hz in (0.3, 0.7, 1.3, 2.9, 7.1))
    return shoot.shake_px * waves / max(float(np.std(waves)), 1e-9)


def write_film(path: Path, film: Filmed, rate_hz: float) -> None:
    """Write the frames as H.264 in MP4."""
    height, width = film.frames[0].shape[:2]
    with h264_video(path, rate_hz, width, height) as write:
        for frame in film.frames:
            write(frame)


def write_boxes(folder: Path, name: str, film: Filmed, seed: int, *, count: int = 6, error_px: float = 1.0) -> None:
    """Write ``count`` boxes of the ball, and of the cup into its folder, each side wrong by ``error_px``.

    A ball in the cup is no ball to draw a box about.
    """
    rng = np.random.default_rng(seed)
    parts = (folder / "cup", film.cup_px, film.half_px[:, 0]), (folder, film.ball_px, film.half_px[:, 1])
    apart = np.linalg.norm(film.ball_px - film.cup_px, axis=1) > 2.0 * film.half_px.max(axis=(1, 2))
    for part, centres, half in parts:
        shown = np.flatnonzero(apart)
        for frame in shown[np.linspace(0, len(shown) - 1, count + 2)[1:-1].astype(int)]:
            u, v = centres[frame] + rng.normal(0, error_px / 2**0.5, 2)
            side = 2 * half[frame] + rng.normal(0, error_px, 2)
            box = BallBox(float(u), float(v), float(side[0]), float(side[1]))
            write_labelled(part, f"{name}-{frame:06d}", TrainedImage(film.frames[frame], (box,)))


if __name__ == "__main__":
    target = Path(sys.argv[1])
    made = filmed(person_swing(), Shoot(), 1)
    write_film(target, made, Shoot().rate_hz)
    write_boxes(target.with_name(f"{target.stem}-boxes"), target.stem, made, 1)
