"""Tables of the Gymnasium environments for their pages, read from the registered environments."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from typing import Any

import gymnasium
import numpy as np

import kendama_cli.gym  # noqa: F401 - registers

Rows = list[tuple[str, ...]]
_CUP = ("cup position x", "m"), ("cup velocity", "m/s")
_LEFT = ("time remaining", "s")
SWING = (
    *_CUP,
    ("ball angle about the tie point; 0 hangs, positive toward +x", "rad"),
    ("ball angular velocity", "rad/s"),
    _LEFT,
)
FLIGHT = (
    *_CUP,
    ("ball from the tie point, along x", "m"),
    ("ball from the tie point, along z", "m"),
    ("ball velocity relative to the cup, along x", "m/s"),
    ("ball velocity relative to the cup, along z", "m/s"),
    _LEFT,
)
GOAL = ("ball angle from hanging, on either side", "rad"), ("angular velocity away from hanging", "rad/s")
"""Meaning and unit of each observed number."""
MEANINGS = {
    "overrides": 'settings as on the command line: `["learn/task=paper_caught"]`',
    "hold_s": "duration of an action, in whole steps of `learn.step_s` [s]",
    "actions": '`"discrete"` or `"continuous"`',
    "normalised": "observations as fractions of typical values",
    "shaping": "weight of the added energy reward",
    "gamma": "discount of your agent; needed for `shaping`",
    "reward": '`"sparse"` or `"dense"`',
    "angles_deg": "range of the goal angle [deg]",
    "rates_rad_s": "range of its angular velocity [rad/s]",
    "tolerance": "tolerance of angle [rad] and velocity [rad/s]",
    "render_mode": '`"rgb_array"` or `"human"`',
}
"""Meaning of each argument."""


def head(name: str) -> Iterator[str]:
    """Yield the table of an environment's spaces, and the lines that make it."""
    env = gymnasium.make(f"kendama/{name}")
    vector = env.spec is not None and env.spec.vector_entry_point is not None
    rows = [
        ("Action space", f"`{env.action_space}`"),
        ("Observation space", f"`{_kind(env.observation_space)}`"),
        ("Vector version", "yes, in compiled code" if vector else "no; the vectors of Gymnasium take it"),
        ("Import", f'`gymnasium.make("kendama_cli.gym:kendama/{name}")`'),
    ]
    yield from _table(("", ""), rows)
    yield from ("```python", "import gymnasium", "import kendama_cli.gym  # registers the environments", "")
    yield from (f'env = gymnasium.make("kendama/{name}")', "```")


def actions(name: str) -> Iterator[str]:
    """Yield the tables of the actions."""
    env, discrete = (gymnasium.make(f"kendama/{name}", **one) for one in ({}, {"actions": "discrete"}))
    accelerations = discrete.unwrapped.settings.actions_m_s2
    each = ", ".join(f"{one:g}" for one in accelerations)
    if isinstance(env.action_space, gymnasium.spaces.Discrete):
        yield from ("An action is an acceleration of the cup along x, held for `hold_s`.",)
        yield from ("The index chooses from `learn.actions_m_s2`:", "")
        yield from _table(
            ("index", "acceleration", "unit"), [(str(i), f"{one:g}", "m/s²") for i, one in enumerate(accelerations)]
        )
        yield 'With `actions="continuous"` it is one number from -1 to 1, a fraction of the largest acceleration.'
        return
    meaning = f"acceleration of the cup, as a fraction of {max(accelerations):g} m/s²"
    yield from ("An action is a fraction of the largest acceleration, held for `hold_s`.", "")
    rows = [("0", meaning, *_bounds(env.action_space, 0))]
    yield from _table(("index", "action", "min", "max"), rows)
    yield f'With `actions="discrete"` an index chooses from `learn.actions_m_s2`: {each} m/s².'


def observations(name: str) -> Iterator[str]:
    """Yield the tables of the observed numbers with their bounds."""
    space: Any = gymnasium.make(f"kendama/{name}").observation_space
    head = ("index", "observation", "min", "max", "unit")
    if isinstance(space, gymnasium.spaces.Dict):
        yield from ("`observation`:", "", *_table(head, _observed(space["observation"], SWING)))
        yield from ("`achieved_goal` and `desired_goal`:", "", *_table(head, _observed(space["desired_goal"], GOAL)))
    else:
        yield from _table(head, _observed(space, SWING if name.startswith("SwingUp") else FLIGHT))


def arguments(name: str) -> Iterator[str]:
    """Yield the table of the arguments of ``gymnasium.make``."""
    made = type(gymnasium.make(f"kendama/{name}").unwrapped)
    taken = [one for one in inspect.signature(made.__init__).parameters.values() if one.name != "self"]
    rows = [(f"`{one.name}`", f"`{_literal(one.default)}`", MEANINGS[one.name]) for one in taken]
    yield from _table(("argument", "default", "meaning"), rows)


PARTS: dict[str, Callable[[str], Iterator[str]]] = {
    one.__name__: one for one in (head, actions, observations, arguments)
}


def _observed(space: Any, named: tuple[tuple[str, str], ...]) -> Rows:
    pairs = zip(range(*space.shape), named, strict=True)
    return [(str(i), meaning, *_bounds(space, i), unit) for i, (meaning, unit) in pairs]


def _bounds(space: Any, i: int) -> tuple[str, str]:
    return _number(space.low[i]), _number(space.high[i])


def _number(value: np.float32) -> str:
    return np.format_float_positional(value, trim="-")


def _literal(default: Any) -> str:
    return f'"{default}"' if isinstance(default, str) else repr(default)


def _kind(space: Any) -> str:
    if isinstance(space, gymnasium.spaces.Dict):
        return "Dict(observation, achieved_goal, desired_goal)"
    return f"Box({space.shape}, {space.dtype})"


def _table(titles: tuple[str, ...], rows: Rows) -> Iterator[str]:
    for cells in (titles, ("---",) * len(titles), *rows):
        yield f"| {' | '.join(cells)} |"
    yield ""
