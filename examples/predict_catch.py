"""Landing of a thrown ball, in space and time, from noisy positions as motion capture gives them."""

import numpy as np

import kendama_cli as kendama

rng = np.random.default_rng(7)
game = kendama.configuration()["game"]
estimator = kendama.estimator(rim_height_m=1.0)
sigma_m = 0.002
for t_s in np.arange(0.0, 0.2, 1 / 120):
    place = np.array([0.5 * t_s, 0.0, 1.1 + 2.0 * t_s - 0.5 * game.gravity_m_s2 * t_s**2])
    estimator.update_position(t_s, place + rng.normal(0.0, sigma_m, 3), sigma_m**2 * np.eye(3))
pose = estimator.catch()
assert pose is not None
print(
    "after 0.2 s: down at",
    round(pose.t_s, 3),
    "s,",
    pose.position_m.round(3),
    "m, +-",
    round(pose.time_sigma_s, 4),
    "s",
)
