"""Options of ``reset(options=...)``, and the rollout that waits for the next action and can be pickled meanwhile."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from kendama_cli.errors import ConfigError
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.task_settings import GoalSettings, RandomisationSettings
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.swingup.environment import Rolling, SwingUpEnvironment
from kendama_cli.simulation.swingup.rollout import RolloutNoise, draw_noise

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
CUP = 0.5, 4.0
"""Factors on the cup's radius that may be asked for."""


@dataclass(frozen=True)
class RolloutOptions:
    """``noise`` and ``cup``: factors on ``learn.noise`` and ``game.cup.radius_m``. ``body``: this one, instead of one
    that is sampled from ``learn.randomisation``.

    A body is given by the factors ``rope``, ``drag`` and ``acceleration``, by ``angle_deg``, by which its angle is
    read with an error, and ``delay_s``, after which an action takes effect; what is left out is as in the model.
    """

    noise: float = 1.0
    body: Mapping[str, float] | None = None
    cup: float = 1.0

    @classmethod
    def of(cls, options: Mapping[str, Any] | None, *others: str) -> RolloutOptions:
        """Return the options of ``reset``; raises ConfigError for another key, or a number out of range.

        ``others`` are the names of options that the environment has read beside these.
        """
        given = {name: value for name, value in option_dictionary(options).items() if name not in others}
        for name in given:
            if name not in (known := ("noise", "body", "cup")):
                raise ConfigError(name, f"option '{name}' is unknown; allowed: {', '.join((*others, *known))}")
        noise, cup = _number("noise", given.get("noise", 1.0), 0.0, 100.0), _number("cup", given.get("cup", 1.0), *CUP)
        if given.get("body") is None:
            return cls(noise, cup=cup)
        if not isinstance(given["body"], Mapping):
            raise ConfigError(
                "body", f"option 'body' is {given['body']!r}; allowed: a dictionary of {', '.join(ALLOWED)}"
            )
        body = {}
        for name, value in given["body"].items():
            if name not in ALLOWED:
                raise ConfigError(f"body.{name}", f"option 'body.{name}' is unknown; allowed: {', '.join(ALLOWED)}")
            body[name] = _number(f"body.{name}", value, *ALLOWED[name])
        return cls(noise, body, cup)

    def game(self, game: GameSettings) -> GameSettings:
        """Return ``game`` with the cup of the options."""
        return dataclasses.replace(game, cup=dataclasses.replace(game.cup, radius_m=self.cup * game.cup.radius_m))

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
        raise ConfigError("options", f"'options' is {options!r}; allowed: a dictionary of noise, body, cup, or None")
    return options or {}


def _number(name: str, value: Any, minimum: float, maximum: float) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not minimum <= value <= maximum:
        raise ConfigError(name, f"option '{name}' is {value!r}; allowed: {minimum:g} to {maximum:g}")
    return float(value)


class RolloutUnderWay:
    """The rollouts of one environment, one at a time, from inside out.

    Neither an engine nor a generator can be pickled. All that is random in a rollout is drawn before it begins, so that
    the answers that it was given lead another engine to the same state: they are what is kept.
    """

    def __init__(self, settings: LearnSettings, game: GameSettings) -> None:
        """Raise ConfigError as SwingUpEnvironment does."""
        self._settings, self._game = settings, game
        self._environment = SwingUpEnvironment(settings, game)
        self._noise: RolloutNoise | None = None
        self._goal: GoalSettings | None = None
        self._answers: list[tuple[float, float]] = []
        self._rolling: Rolling | None = None

    @property
    def waits(self) -> bool:
        """Return True if a rollout has begun and not ended."""
        return self._rolling is not None

    def begin(
        self, noise: RolloutNoise, game: GameSettings, goal: GoalSettings | None = None
    ) -> tuple[SwingState, float]:
        """Return the first reading and its time [s] in ``game``; ``goal`` takes the place of the settings'."""
        if game != self._game:
            self._game, self._environment = game, SwingUpEnvironment(self._settings, game)
        self._noise, self._goal, self._answers = noise, goal, []
        environment = self._environment if goal is None else self._environment.aimed(goal)
        self._rolling = environment.rolling(noise)
        return next(self._rolling)

    def answer(self, wanted_m_s2: float, until_s: float) -> tuple[SwingState, float]:
        """Return the next reading and its time [s], after an acceleration was held; raises StopIteration with the
        rollout.
        """
        assert self._rolling is not None
        self._answers.append((wanted_m_s2, until_s))
        try:
            return self._rolling.send(self._answers[-1])
        except StopIteration:
            self._rolling = None
            raise

    def state(self) -> SwingState:
        """Return the true plain state now."""
        return self._environment.state()

    def places(self) -> tuple[float, float, float]:
        """See SwingUpEnvironment."""
        return self._environment.places()

    def __getstate__(self) -> dict[str, Any]:
        """Return all but the engine and the rollout in it."""
        return {name: value for name, value in vars(self).items() if name not in ("_environment", "_rolling")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Open another engine, and give it the same answers."""
        noise, answers = state["_noise"], state["_answers"]
        vars(self).update(vars(RolloutUnderWay(state["_settings"], state["_game"])))
        if noise is None:
            return
        self.begin(noise, self._game, state["_goal"])
        for one in answers:
            try:
                self.answer(*one)
            except StopIteration:
                break
