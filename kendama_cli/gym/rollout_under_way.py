"""A rollout that waits for the next action, and that can be pickled and copied meanwhile."""

from __future__ import annotations

from typing import Any

from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.task_settings import GoalSettings
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.swingup.environment import Rolling, SwingUpEnvironment
from kendama_cli.simulation.swingup.rollout import RolloutNoise


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

    def begin(self, noise: RolloutNoise, goal: GoalSettings | None = None) -> tuple[SwingState, float]:
        """Return the first reading and its time [s]; ``goal`` takes the place of the settings'."""
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
        self.begin(noise, state["_goal"])
        for one in answers:
            try:
                self.answer(*one)
            except StopIteration:
                break
