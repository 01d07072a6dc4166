"""A primitive from demonstrations of your own, played slower and to another goal."""

import dataclasses

import numpy as np

import kendama_cli as kendama

t_s = np.linspace(0.0, 1.5, 151)
share = t_s / t_s[-1]
rise = share**3 * (10 - 15 * share + 6 * share**2)
demonstrations = [
    kendama.Demonstration(f"swing {i}", t_s, np.column_stack([size * rise, 0 * t_s, 0.2 * np.sin(np.pi * rise)]))
    for i, size in enumerate((0.28, 0.30, 0.33))
]
plan = kendama.encode(demonstrations)
slower = dataclasses.replace(plan, tau_scale=1.2, goal_m=plan.goal_m + np.array([0.05, 0.0, 0.0]))
motion = kendama.play(slower, np.linspace(0.0, 2.0, 9))
print("tau", round(slower.tau_scale * slower.duration_s, 3), "s; ends at", motion.position_m[-1].round(3), "m")
