"""Speed of detection and estimator, and of OpenCV's HoughCircles and a batch fit with numpy on the same images.

``python -m tests.benchmarks.vision`` prints name, value, unit and ratio; CPU time, one thread, warmed up, the best of
many. The flight is that of the accuracy tests (two cameras, 120 fps, 90 % of 0.37 s); the estimator is asked for a
pose after every frame, which the batch fit answers by ``numpy.linalg.lstsq`` over all frames so far.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import Any

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import cv2  # noqa: E402
import numpy as np  # noqa: E402

from kendama_cli.vision.cameras.region import around  # noqa: E402
from kendama_cli.vision.cameras.triangulation import ray_constraints  # noqa: E402
from kendama_cli.vision.prediction.catch_pose import CatchPoseEstimator  # noqa: E402
from kendama_cli.vision.settings import BallisticMotion, ColouredMotion  # noqa: E402
from tests.vision.scenes import first_found, stereo  # noqa: E402
from tests.vision.seen_flight import DRAG, FLIGHT, RIM_M, SIGMA_PX, START, VELOCITY, stamps  # noqa: E402
from tests.vision.studio import DETECTOR, Studio  # noqa: E402

NOISE_PX2 = SIGMA_PX**2 * np.eye(2)


def best_us(work: Callable[[], object], tries: int) -> float:
    """The shortest CPU time of ``work`` [us]."""
    work()
    times = []
    for _ in range(tries):
        began = time.process_time_ns()
        work()
        times.append(time.process_time_ns() - began)
    return min(times) / 1e3


def sights() -> list[tuple[float, Any, Any]]:
    """(time, camera, pixel) of the flight, in order."""
    rng, t = np.random.default_rng(0), stamps(0.9)
    seen = []
    for camera in stereo():
        pixels = camera.project(FLIGHT.position_m(START, VELOCITY, t))
        seen += [(float(s), camera, p + SIGMA_PX * rng.standard_normal(2)) for s, p in zip(t, pixels, strict=True)]
    return sorted(seen, key=lambda one: one[0])


def estimate(seen: list[tuple[float, Any, Any]], motion: Any) -> None:
    """Every sight taken, a pose asked for after every second one."""
    estimator = CatchPoseEstimator(9.81, DRAG, RIM_M, motion=motion)
    for number, (t_s, camera, pixel) in enumerate(seen):
        estimator.update_pixels(camera, t_s, pixel, NOISE_PX2)
        if number % 2:
            estimator.catch()


def batch(seen: list[tuple[float, Any, Any]]) -> None:
    """The same by least squares over all rows, from the start after every frame."""
    rows: list[np.ndarray] = []
    right: list[np.ndarray] = []
    for number, (t_s, camera, pixel) in enumerate(seen):
        sight = ray_constraints(camera, pixel, NOISE_PX2)
        a, b = FLIGHT.velocity_gain_s(t_s), FLIGHT.gravity_gain_s2(t_s)
        rows.append(np.hstack([sight.rows, a * sight.rows]))
        right.append(sight.right - b * sight.rows @ FLIGHT.gravity_m_s2)
        if number % 2 and number > 4:
            state = np.linalg.lstsq(np.concatenate(rows), np.concatenate(right), rcond=None)[0]
            FLIGHT.descent_s(state[:3], state[3:], RIM_M)


def hough(pixels: Any) -> Any:
    """OpenCV's circles in the grey image."""
    grey = cv2.cvtColor(pixels, cv2.COLOR_BGR2GRAY)
    return cv2.HoughCircles(grey, cv2.HOUGH_GRADIENT, 1, 20, param1=100, param2=15, minRadius=4, maxRadius=20)


def main() -> None:
    """Print the table."""
    cv2.setNumThreads(1)
    seen = sights()
    studio = Studio()
    whole = studio.shoot([0.15, 0.0, 0.3], (1.0, 0.0, 1.0)).pixels.copy()
    near = around(studio.true_centre(), 26)
    region = whole[near.top : near.bottom, near.left : near.right].copy()
    fit = best_us(lambda: batch(seen), 30) / len(seen)
    rows = [
        (f"estimator, {name}, per frame and camera", best_us(lambda m=motion: estimate(seen, m), 30) / len(seen), fit)
        for name, motion in (
            ("ballistic", BallisticMotion("ballistic")),
            ("coloured", ColouredMotion("coloured", 1.0, 3e-3, 0.2, 0.01)),
        )
    ]
    print(f"{'numpy.linalg.lstsq over all frames':44s} {fit:8.0f} us")
    for name, value, peer in rows:
        print(f"{name:44s} {value:8.0f} us {value / peer:7.2f} x numpy.linalg.lstsq")
    for name, pixels in ((f"{region.shape[1]}x{region.shape[0]}", region), ("640x480", whole)):
        mine = best_us(lambda p=pixels: first_found(DETECTOR, p), 200)
        peer = best_us(lambda p=pixels: hough(p), 50)
        print(f"{'cv2.HoughCircles ' + name:44s} {peer:8.0f} us")
        print(f"{'detection ' + name:44s} {mine:8.0f} us {mine / peer:7.2f} x cv2.HoughCircles")


if __name__ == "__main__":
    main()
