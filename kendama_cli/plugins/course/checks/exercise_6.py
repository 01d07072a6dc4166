"""Grades exercise 6: from pixels to a prediction, and its bound."""

from __future__ import annotations

import numpy as np

from kendama_cli.plugins.course.work import Work, WrongAnswerError, array_of, require, require_close
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.cameras.camera_model import CameraModel, looking_at

GRAVITY_M_S2 = 9.81
DRAWN_WITHIN = 0.06
"""The ratio of 2000 draws scatters by 1 / sqrt(4000) = 0.016; almost four of these."""


def _cameras() -> list[CameraModel]:
    places = ((-0.4, -1.2, 1.3), (0.3, -1.6, 1.0), (0.9, -1.0, 1.5))
    return [
        CameraModel(
            f"camera {i}",
            640,
            480,
            np.array([550.0, 560.0]),
            np.array([320.0, 236.0]),
            np.zeros(5),
            looking_at(place, (0.0, 0.1, 1.2)),
            np.array(place),
        )
        for i, place in enumerate(places)
    ]


def project(work: Work) -> None:
    """Check against the library's camera."""
    for camera in _cameras():
        for point in ([0.0, 0.0, 1.2], [0.2, -0.1, 1.4]):
            found = work.function("project")(camera, np.array(point))
            hint = "q = R (p - o), then f q_xy / q_z + c; mind that R multiplies from the left"
            require_close("project(camera, point)", found, camera.project(point)[0], 0.01, hint)


def triangulate(work: Work) -> None:
    """Check that exact pixels give the position back; three cameras too."""
    for count in (2, 3):
        cameras, place = _cameras()[:count], np.array([0.12, 0.07, 1.31])
        pixels = [camera.project(place)[0] for camera in cameras]
        hint = "stack two rows for each camera, (R[0] - u_x R[2]) and (R[1] - u_y R[2]), and solve by lstsq"
        found = work.function("triangulate")(cameras, pixels)
        require_close(f"triangulate with {count} cameras", found, place, 1e-6, hint)


def _flight(seed: int) -> tuple[Array, Array, Array, Array]:
    rng = np.random.default_rng(seed)
    p0, v0 = np.array([0.1, -0.2, 1.2]), rng.uniform([-1, -0.3, 1.0], [1, 0.3, 2.5])
    t_s = np.arange(0.0, 0.2, 1 / 120)
    return t_s, p0 + np.outer(t_s, v0) + np.outer(0.5 * t_s**2, [0.0, 0.0, -GRAVITY_M_S2]), p0, v0


def fit_flight(work: Work) -> None:
    """Check for an exact result on an exact flight, least squares on a noisy one."""
    for seed in (1, 2):
        t_s, places, p0, v0 = _flight(seed)
        found = array_of("fit_flight(...)", work.function("fit_flight")(t_s, places), (2, 3))
        hint = "take -g t^2 / 2 off the heights first (that is: add g t^2 / 2), then fit a line for each axis"
        require_close("p0", found[0], p0, 1e-6, hint)
        require_close("v0", found[1], v0, 1e-6, hint)
        noisy = places + np.random.default_rng(seed).normal(0.0, 0.01, places.shape)
        fallen = np.outer(0.5 * t_s**2, [0.0, 0.0, -GRAVITY_M_S2])
        best = np.linalg.lstsq(np.column_stack([np.ones(len(t_s)), t_s]), noisy - fallen, rcond=None)[0]
        hint = "of noisy places all have to count alike: least squares over every sample"
        require_close("p0, v0 of noisy places", work.function("fit_flight")(t_s, noisy), best, 1e-6, hint)


def crossing(work: Work) -> None:
    """Check that the time is the later of both solutions."""
    for seed in (3, 4):
        _, _, p0, v0 = _flight(seed)
        for height in (1.0, 1.22):
            t = (v0[2] + np.sqrt(v0[2] ** 2 + 2 * GRAVITY_M_S2 * (p0[2] - height))) / GRAVITY_M_S2
            found = work.function("crossing")(p0, v0, height)
            hint = "of the two times at which z is height_m the later one, on the way down; then x and y there"
            require_close("crossing(...)", found, [t, p0[0] + v0[0] * t, p0[1] + v0[1] * t], 1e-6, hint)


def _bound(t_s: Array, sigma_m: float, p0: Array, v0: Array, height_m: float) -> tuple[float, float]:
    t = (v0[2] + np.sqrt(v0[2] ** 2 + 2 * GRAVITY_M_S2 * (p0[2] - height_m))) / GRAVITY_M_S2
    matrix, at = np.column_stack([np.ones(len(t_s)), t_s]), np.array([1.0, t])
    s = sigma_m * float(np.sqrt(at @ np.linalg.inv(matrix.T @ matrix) @ at))
    sigma_t = s / abs(float(v0[2]) - GRAVITY_M_S2 * t)
    return sigma_t, float(np.hypot(s, v0[0] * sigma_t))


def bound(work: Work) -> None:
    """Check the formula, at two flights and durations of sight."""
    for seed, seen in ((5, 12), (6, 24)):
        t_s, _, p0, v0 = _flight(seed)
        wanted = _bound(t_s[:seen], 0.002, p0, v0, 1.0)
        found = array_of("bound(...)", work.function("bound")(t_s[:seen], 0.002, p0, v0, 1.0), (2,))
        hint = "s^2 = (1, t) C (1, t)^T with C = sigma^2 (A^T A)^-1 ; t and |v_z| = |v0_z - g t| are the crossing's"
        require_close("sigma_t", found[0], wanted[0], 0.005 * wanted[0], hint)
        require_close("sigma_x", found[1], wanted[1], 0.005 * wanted[1], hint)


def ratios(work: Work) -> None:
    """Check for about one, but never exactly: it was sampled."""
    for name in ("ratio_t", "ratio_x"):
        found = work.number(name)
        if abs(found - 1.0) > DRAWN_WITHIN:
            raise WrongAnswerError(
                f"'{name}' is {found:.3f}; 2000 draws give 1 within {DRAWN_WITHIN}: rms error of the crossing over its "
                "bound, both for the first half of the flight at 120 Hz and sigma = 2 mm"
            )
        require(found != 1.0, f"'{name}' is exactly 1: draw the flights instead of writing down what is expected")


CHECKS = {1: project, 2: triangulate, 3: fit_flight, 4: crossing, 5: bound, 6: ratios}
