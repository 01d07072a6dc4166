"""An engine of the swing-up whose ball moves as a network predicts, and the environments of all models."""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.errors import ConfigError
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.physics.taut_rope import TautRope
from kendama_cli.plugins.offline.artifact import FittedModels
from kendama_cli.plugins.offline.network import Network
from kendama_cli.plugins.offline.recording import on_rail, strung, unlike, world
from kendama_cli.plugins.offline.settings import FitSettings
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.swingup.engine import SwingEngine
from kendama_cli.simulation.swingup.environment import SwingUpEnvironment
from kendama_cli.simulation.swingup.rail import CompiledRail

SLACK = 0.1
"""A tension below this fraction of the ball's weight counts as none: no network predicts exactly 0."""
BEYOND = 0.5
"""The ball is kept within the data's bounds and this fraction of their width more, so that all numbers stay finite."""


def network_steps(learn: LearnSettings) -> int:
    """Return the time steps of one transition of the network: the shortest time for which an action is held."""
    return max(1, round(learn.decision.min_s / learn.step_s))


class NetworkSwing:
    """Cup on a rail; the ball by a network, once in ``every`` steps, and linear in between. See SwingEngine."""

    def __init__(self, models: FittedModels, game: GameSettings, step_s: float, every: int) -> None:
        """Move a ball of ``game``'s mass; ``game.rope`` is as long as the ball is seen to hang."""
        self._network = Network((models.first, models.second, models.third), models.scale)
        margin = BEYOND * (models.bounds[1] - models.bounds[0])
        self._low, self._high = models.bounds[0] - margin, models.bounds[1] + margin
        self._mass, self._weight = game.ball.mass_kg, game.ball.mass_kg * game.gravity_m_s2
        self._step_s, self._every = step_s, every
        self._hanging = TautRope.hanging(game)
        self.start(SwingState(0.0, 0.0, 0.0, 0.0))

    def take_on(self, rope_scale: float, drag_scale: float) -> None:
        """Accept only the rope and the air of the data; raises ConfigError for others."""
        if (rope_scale, drag_scale) != (1.0, 1.0):
            raise ConfigError(
                "learn.randomisation",
                f"'learn.randomisation' asks for a rope of {rope_scale:g} and a drag of {drag_scale:g} times the "
                "data's; allowed with offline.model=network: none (learn/task=hard)",
            )

    def start(self, state: SwingState) -> None:
        """Begin at ``state`` with the ball as far from the tie as it hangs."""
        self.x_m, self.velocity_m_s = state.x_m, state.velocity_m_s
        ball = self._hanging.ball(state.angle_rad, state.rate_rad_s)
        self._begin, self._done, self.tension_n = np.array(ball), 0, self._weight
        self._change = np.zeros(4)
        self._read(self._begin)

    def step(self, acceleration_m_s2: float) -> None:
        """Advance by one time step; the network is asked when a transition begins."""
        if not self._done:
            inputs = [*self._begin.tolist(), acceleration_m_s2, self.velocity_m_s]
            ended = self._begin + self._network.changes(np.array([inputs]))[0]
            self._change = np.clip(ended, self._low, self._high) - self._begin
            self.tension_n = self._tension(acceleration_m_s2)
        self.velocity_m_s += acceleration_m_s2 * self._step_s
        self.x_m += self.velocity_m_s * self._step_s
        self._done += 1
        self._read(self._begin + self._done / self._every * self._change)
        if self._done == self._every:
            self._begin, self._done = self._begin + self._change, 0

    def _tension(self, cup_m_s2: float) -> float:
        """Return the force along the rope that the predicted change needs beside gravity [N]."""
        per_s = self._mass / (self._every * self._step_s)
        force_x = per_s * float(self._change[2]) + self._mass * cup_m_s2
        force_z = per_s * float(self._change[3]) + self._weight
        across, above = self._begin[:2].tolist()
        pull = -(force_x * across + force_z * above) / max(math.hypot(across, above), 1e-9)
        return pull if pull > SLACK * self._weight else 0.0

    def _read(self, ball: Array) -> None:
        self.across_m, self.above_m, self.across_m_s, self.above_m_s = ball.tolist()

    @property
    def reference(self) -> tuple[float, float]:
        """The cup obeys at once: where it is and how fast."""
        return self.x_m, self.velocity_m_s

    @property
    def in_cup(self) -> None:
        """None: nothing touches on the rail."""
        return

    def check_finite(self, t_s: float) -> None:
        """Accept all: the state is kept within bounds."""


def believed(model: str, models: FittedModels, fit: FitSettings, game: GameSettings) -> GameSettings:
    """Return the game as ``model`` believes it to be."""
    if model == "world":
        return world(fit, game)
    if model == "wrong":
        return unlike(fit, game, fit.wrong_rope, fit.wrong_drag)
    rope_m = models.hanging_m if model == "network" else models.rope_m
    return strung(game, rope_m, (max(models.linear_n_s_m, 0.0), max(models.quadratic_n_s2_m2, 0.0)))


def engine_of(
    model: str, models: FittedModels, fit: FitSettings, learn: LearnSettings, game: GameSettings
) -> SwingEngine:
    """Return the engine in which ``model`` moves the ball."""
    known = believed(model, models, fit, game)
    if model == "network":
        return NetworkSwing(models, known, learn.step_s, network_steps(learn))
    return CompiledRail(known, learn.step_s)


def environment_of(
    model: str, models: FittedModels, fit: FitSettings, learn: LearnSettings, game: GameSettings
) -> SwingUpEnvironment:
    """Return the swing-up in ``model``, compiled where it is one of rope and drag."""
    swing = engine_of(model, models, fit, learn, game) if model == "network" else None
    return SwingUpEnvironment(on_rail(learn), believed(model, models, fit, game), swing)
