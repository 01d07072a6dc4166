"""Grades exercise 2: a movement primitive from nothing."""

from __future__ import annotations

import numpy as np

from kendama_cli.motion.dmp.basis import features as reference_features
from kendama_cli.plugins.course.work import Work, array_of, require, require_close
from kendama_cli.schema.arrays import Array

STIFFNESS, DECAY, FUNCTIONS = 1000.0, 1.0, 20


def _basis() -> tuple[Array, Array]:
    centers = np.exp(-DECAY * np.linspace(0.0, 1.0, FUNCTIONS))
    return centers, np.abs(np.diff(centers, append=centers[-1] ** 2 / centers[-2]))


def _swing(seed: int) -> tuple[Array, Array]:
    """Return a smooth path that starts and ends at rest."""
    rng = np.random.default_rng(seed)
    t_s = np.linspace(0.0, rng.uniform(1.2, 2.2), 240)
    share = t_s / t_s[-1]
    rise = share**3 * (10 - 15 * share + 6 * share**2)
    return t_s, 0.1 + 0.3 * rise + rng.uniform(0.1, 0.25) * np.sin(np.pi * rise) ** 3 * np.sin(3 * np.pi * rise)


def features(work: Work) -> None:
    """Check against the library's own."""
    s = np.linspace(0.0, 1.0, 57)
    hint = "entry (i, j) is x_i psi_j(x_i) / sum_k psi_k(x_i) with x = exp(-ALPHA s); each row sums to x"
    wanted = reference_features(np.exp(-DECAY * s), *_basis())
    require_close("features(s)", work.function("features")(s), wanted, 1e-9, hint)


def force(work: Work) -> None:
    """Check on a motion whose derivatives are known."""
    t_s = np.linspace(0.0, 1.7, 400)
    s = t_s / t_s[-1]
    y, rate, second = (
        0.2 + 0.4 * (10 * s**3 - 15 * s**4 + 6 * s**5),
        0.4 * (30 * s**2 - 60 * s**3 + 30 * s**4),
        0.4 * (60 * s - 180 * s**2 + 120 * s**3),
    )
    wanted = second + 2 * np.sqrt(STIFFNESS) * rate - STIFFNESS * (y[-1] - y)
    found = array_of("force(t_s, y_m)", work.function("force")(t_s, y), t_s.shape)
    hint = "f = y'' + D y' - K (g - y), all derivatives by s = t / T (so y' = T dy/dt), D = 2 sqrt K, g the last place"
    require_close("force(t_s, y_m)", found, wanted, 0.3, hint)


def fit(work: Work) -> None:
    """Check that the residual can hardly be smaller, and the weights stay small."""
    for seed in (1, 2):
        t_s, y = _swing(seed)
        f = np.asarray(work.function("force")(t_s, y), dtype=np.float64)
        made = reference_features(np.exp(-DECAY * t_s / t_s[-1]), *_basis())
        best = np.linalg.solve(made.T @ made + 1e-6 * np.eye(FUNCTIONS), made.T @ f)
        found = array_of("fit(t_s, y_m)", work.function("fit")(t_s, y), (FUNCTIONS,))
        least, own = (float(np.sqrt(np.mean((made @ w - f) ** 2))) for w in (best, found))
        hint = f"{own:.3g} rms is left of the force, {least:.3g} is possible: solve (F^T F + 1e-6 I) w = F^T f"
        require(own <= 1.02 * least + 1e-6, hint)


def play(work: Work) -> None:
    """Check that it reproduces, scales in time, and goes to another goal."""
    own, t_and_y = work.function("play"), _swing(3)
    t_s, y = t_and_y
    w = array_of("fit(t_s, y_m)", work.function("fit")(t_s, y), (FUNCTIONS,))
    again = array_of("play(...)", own(w, y[0], y[-1], t_s[-1], t_s), t_s.shape)
    rms_mm = 1000 * float(np.sqrt(np.mean((again - y) ** 2)))
    require(rms_mm < 4.0, f"played with its own weights the motion is {rms_mm:.1f} mm rms off; allowed: 4 mm")
    slow = array_of("play at 1.6 tau", own(w, y[0], y[-1], 1.6 * t_s[-1], 1.6 * t_s), t_s.shape)
    hint = "with tau 1.6 times as long the same way is gone 1.6 times slower: integrate by s = t / tau"
    require_close("play at 1.6 tau", slow, again, 0.001, hint)
    late = np.linspace(0.0, 2.0 * t_s[-1], 200)
    there = array_of("play to another goal", own(w, y[0], y[-1] + 0.15, t_s[-1], late), late.shape)
    hint = "long after tau the cup rests on the goal: no force after s = 1, the spring alone"
    require_close("the end of play to another goal", there[-1], y[-1] + 0.15, 0.001, hint)


def average(work: Work) -> None:
    """Check the average of all swings, with the student's own fit."""
    parts = [work.function("trimmed")(one) for one in work.value("swings")]
    own = work.function("fit")
    weights = np.mean([np.asarray(own(t, y - y[0]), dtype=np.float64) for t, y in parts], axis=0)
    scale = float(np.abs(weights).max())
    hint = "fit every swing by itself, then take the mean over the swings (axis=0)"
    require_close("mean_w", work.value("mean_w"), weights, 1e-6 * scale, hint)
    goal = float(np.mean([y[-1] - y[0] for _, y in parts]))
    require_close("mean_goal_m", work.number("mean_goal_m"), goal, 1e-9, "the mean of last place minus first")
    duration = float(np.mean([t[-1] for t, _ in parts]))
    require_close(
        "mean_duration_s", work.number("mean_duration_s"), duration, 1e-9, "the mean of the trimmed durations"
    )


CHECKS = {1: features, 2: force, 3: fit, 4: play, 5: average}
