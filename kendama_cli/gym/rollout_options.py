"""Options of ``reset(options=...)``: the noise, and the body."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from kendama_cli.errors import ConfigError
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.task_settings import RandomisationSettings
from kendama_cli.simulation.swingup.noise import draw_noise
from kendama_cli.simulation.swingup.rollout import RolloutNoise

NOMINAL = RandomisationSettings(
    rope=0.0, drag=(1.0, 1.0), noise=(1.0, 1.0), acceleration=0.0, angle_deg=0.0, delay_s=0.0, workspace_shrink=0.0
)
ALLOWED = {
    "rope": (0.5, 2.0),
    "drag": (0.0, 100.0),
    "acceleration": (0.0, 2.0),
    "angle_deg": (-90.0, 90.0),
    "delay_s": (0.0, 0.1),
}
"""What a body may be asked for: factors, degrees, seconds."""


@dataclass(frozen=True)
class RolloutOptions:
    """``noise``: a factor on ``learn.noise``. ``body``: this one, instead of one that is drawn from
    ``learn.randomisation``.

    A body is given by the factors ``rope``, ``drag`` and ``acceleration``, by ``angle_deg``, by which its angle is
    misread, and ``delay_s``, after which an action takes effect; what is left out is as in the model.
    """

    noise: float = 1.0
    body: Mapping[str, float] | None = None

    @classmethod
    def of(cls, options: Mapping[str, Any] | None, *others: str) -> RolloutOptions:
        """Return the options of ``reset``; raises ConfigError for another key, or a number out of range.

        ``others`` are the names of options that the environment has read beside these.
        """
        given = {name: value for name, value in option_dictionary(options).items() if name not in others}
        for name in given:
            if name not in ("noise", "body"):
                raise ConfigError(name, f"option '{name}' is unknown; allowed: {', '.join((*others, 'noise', 'body'))}")
        noise = _number("noise", given.get("noise", 1.0), 0.0, 100.0)
        if given.get("body") is None:
            return cls(noise)
        if not isinstance(given["body"], Mapping):
            raise ConfigError(
                "body", f"option 'body' is {given['body']!r}; allowed: a dictionary of {', '.join(ALLOWED)}"
            )
        body = {}
        for name, value in given["body"].items():
            if name not in ALLOWED:
                raise ConfigError(f"body.{name}", f"option 'body.{name}' is unknown; allowed: {', '.join(ALLOWED)}")
            body[name] = _number(f"body.{name}", value, *ALLOWED[name])
        return cls(noise, body)

    def drawn(self, settings: LearnSettings, rng: np.random.Generator) -> RolloutNoise:
        """Draw one rollout's noise."""
        bodies = settings.randomisation if self.body is None else NOMINAL
        calmest, noisiest = bodies.noise
        bodies = dataclasses.replace(bodies, noise=(self.noise * calmest, self.noise * noisiest))
        noise, body = draw_noise(settings, bodies, rng), self.body
        if body is None:
            return noise
        return dataclasses.replace(
            noise,
            angle_rad=np.asarray(noise.angle_rad) + math.radians(body.get("angle_deg", 0.0)),
            gain=np.asarray(noise.gain) * body.get("acceleration", 1.0),
            rope_scale=body.get("rope", 1.0),
            drag_scale=body.get("drag", 1.0),
            delay_steps=round(body.get("delay_s", 0.0) / settings.step_s),
        )


def option_dictionary(options: Any) -> Mapping[str, Any]:
    """Return the options of ``reset``; raises ConfigError where they are no dictionary."""
    if options is not None and not isinstance(options, Mapping):
        raise ConfigError("options", f"'options' is {options!r}; allowed: a dictionary of noise and body, or None")
    return options or {}


def _number(name: str, value: Any, least: float, largest: float) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not least <= value <= largest:
        raise ConfigError(name, f"option '{name}' is {value!r}; allowed: {least:g} to {largest:g}")
    return float(value)
