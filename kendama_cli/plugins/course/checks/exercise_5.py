"""Grades exercise 5: a policy in another body."""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.plugins.course.work import Work, WrongAnswerError, array_of, require, require_close

SEEDS, FEWER = 20, 10
GRAVITY_M_S2, ROPE_M = 9.81, 0.40


def what_breaks(work: Work) -> None:
    """Check that the fractions are those of the same rollouts."""
    shares, bodies = work.value("shares"), work.value("BODIES")
    if not isinstance(shares, dict) or set(shares) != set(bodies):
        raise WrongAnswerError(f"'shares' has to be a dictionary with the keys {', '.join(bodies)}")
    rollout, as_it_is, nominal = (work.value(name) for name in ("rollout", "as_it_is", "nominal"))
    for name, body in bodies.items():
        real = float(np.mean([rollout(nominal, as_it_is, seed, body) for seed in range(SEEDS)]))
        hint = f"the mean of rollout(nominal, as_it_is, seed, body) over the seeds 0 to {SEEDS - 1}"
        require_close(f"shares[{name!r}]", shares[name], real, 1e-6, hint)
    others = [name for name in bodies if name != "as the model"]
    said = work.choice("harmless", *others)
    best = max(shares[name] for name in others)
    require(shares[said] == best, f"'{said}' leaves {shares[said]:.2f}; there is a body that leaves {best:.2f}")


def to_model(work: Work) -> None:
    """Check similar worlds: lengths with k, times with sqrt k."""
    own = work.function("to_model")
    for k in (0.25, 0.7, 1.5):
        seen = np.array([0.1, -0.6, 2.0, 3.0])
        found = array_of(f"to_model(observation, {k})", own(seen, k), (4,))
        wanted = [0.1 / k, -0.6 / math.sqrt(k), 2.0, 3.0 * math.sqrt(k)]
        for name, have, want in zip(("place", "velocity", "angle", "rate"), found, wanted, strict=True):
            hint = "lengths there are k times, times sqrt(k) times those of the model; go back by dividing"
            require_close(f"the {name} for k = {k}", have, want, 1e-9, hint)


def ahead(work: Work) -> None:
    """Check against a fine integration."""
    own, rng = work.function("ahead"), np.random.default_rng(3)
    for _ in range(6):
        state = rng.uniform([-0.2, -1.0, -2.0, -6.0], [0.2, 1.0, 2.0, 6.0])
        coming = rng.uniform(-3.0, 3.0, 3)
        x, v, angle, rate = (float(value) for value in state)
        for a in coming:
            for _ in range(400):
                h = 0.02 / 400
                rate += h * -(GRAVITY_M_S2 * math.sin(angle) + a * math.cos(angle)) / ROPE_M
                angle, v = angle + h * rate, v + h * a
                x += h * v
        found = array_of("ahead(...)", own(tuple(state), list(coming), 0.02), (4,))
        for name, have, want, within in zip(
            ("place", "velocity", "angle", "rate"), found, (x, v, angle, rate), (0.003, 1e-6, 0.02, 0.1), strict=True
        ):
            hint = "each acceleration is held for step_s, in ten steps of step_s / 10; rate and velocity first"
            require_close(f"the {name} after {len(coming)} accelerations", have, want, within, hint)
    require_close("ahead with nothing to come", own((0.1, 0.2, 0.3, 0.4), [], 0.02), [0.1, 0.2, 0.3, 0.4], 1e-9, "stay")


def believed(work: Work) -> None:
    """Check the fractions by the same rollouts, and the conclusion from them."""
    found = array_of("'believed'", work.value("believed"), (5,))
    rollout, nominal, in_time = (work.value(name) for name in ("rollout", "nominal", "in_time"))
    body = {"delay_s": 0.06}
    for n, share in enumerate(found, 1):
        real = np.mean(
            [rollout(nominal, lambda seen, sent, n=n: in_time(seen, sent, n), seed, body) for seed in range(FEWER)]
        )
        hint = f"the mean over the seeds 0 to {FEWER - 1} with in_time(..., late={n}) and a body that is 60 ms late"
        require_close(f"believed[{n - 1}]", share, real, 1e-6, hint)
    good = found >= 0.8
    right = 40 if good.all() else 20 if good[1:4].all() else 0
    said = work.number("tolerance_ms")
    require(said == right, f"tolerance_ms is {said:g}; the shares {found.tolist()} say {right} to both sides")


CHECKS = {1: what_breaks, 2: to_model, 3: ahead, 4: believed}
