"""The game as Gymnasium environments, under the name that users import; the part ``agents`` brings them.

    import gymnasium, kendama_cli.gym
    env = gymnasium.make("kendama/SwingUp-v1")
    env = gymnasium.make("kendama_cli.gym:kendama/SwingUp-v1")  # does both

The part's modules are this one's too: ``kendama_cli.gym.stable_baselines3``.
"""

from __future__ import annotations

import sys
from typing import Any

from kendama_cli.schema.registry import brought

_register = brought(__name__, "kendama.environments", "gym")
_register()
_part = sys.modules[_register.__module__]
__path__ = _part.__path__


def __getattr__(name: str) -> Any:
    return getattr(_part, name)
