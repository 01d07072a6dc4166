"""Pictures of the environments' pages: ``python -m tests.docs.environments`` makes them anew."""

from __future__ import annotations

import gymnasium
from PIL import Image

import kendama_cli.gym  # noqa: F401 - registers
from tests.docs.measure import DOCS

FOLDER = DOCS / "reference" / "environments"
PICTURES = {
    "SwingUp-v1": ("swing-up", 1.4),
    "SwingUpGoal-v1": ("swing-up-goal", 0.85),
    "Catch-v0": ("catch", 0.12),
    "Game-v0": ("game", 1.05),
}
"""Name of each environment's picture, and its time [s]; until then an energy pump plays."""


def main() -> None:
    """Write the pictures."""
    for name, (picture, time_s) in PICTURES.items():
        env = gymnasium.make(f"kendama/{name}", actions="continuous", render_mode="rgb_array")
        observation, _ = env.reset(seed=2)
        for _ in range(round(time_s / env.unwrapped._hold_s if hasattr(env.unwrapped, "_hold_s") else time_s / 0.02)):
            seen = observation["observation"] if isinstance(observation, dict) else observation
            observation, *_ = env.step([pump(name, seen)])
        Image.fromarray(env.render()).save(FOLDER / f"{picture}.png", optimize=True)


def pump(name: str, seen: object) -> float:
    """Return the action that gives the ball energy."""
    angle, rate = seen[2:4] if name.startswith("SwingUp") else (seen[2], seen[4])
    return float(-1.0 if rate > 0 else 1.0) if abs(angle) < 1.0 else 0.0


if __name__ == "__main__":
    main()
