"""Rollouts in compiled code: from one decision to the next, and the flight after the goal."""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.learning.interface import Actor
from kendama_cli.learning.reward import Outcome
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.swingup import rail_kernel as kernel
from kendama_cli.simulation.swingup.rail import CompiledRail, Rules
from kendama_cli.simulation.swingup.rollout import Catch, RolloutNoise, SimulatedRollout

ENDS: dict[int, Outcome] = {kernel.GOAL: "goal", kernel.OUTSIDE: "outside", kernel.TIMEOUT: "timeout"}


class CompiledRollouts:
    """SwingUpEnvironment's loops for actors that decide on bins: the same numbers.

    Such an actor changes nothing between two decisions, so it is not asked there; compiled code finds the next one.
    """

    def __init__(self, settings: LearnSettings, game: GameSettings) -> None:
        self._settings, self._game = settings, game
        self.swing = CompiledRail(game, settings.step_s)
        self._rules = Rules.of(settings, game)
        self._packed = self._rules.packed()
        self._catch_m_s2 = float(settings.goal.catch_acceleration_m_s2)
        self._n_steps = max(1, round(settings.rollout_s / settings.step_s))

    def roll_out(self, actor: Actor, noise: RolloutNoise) -> SimulatedRollout:
        """One rollout, as SwingUpEnvironment.roll_out."""
        swing, step_s = self.swing, self._rules.physics.step_s
        rules, edges = self._packed
        if noise.workspace_scale != 1.0:
            rules, edges = Rules.of(self._settings.with_workspace_scale(noise.workspace_scale), self._game).packed()
        errors = np.array([noise.angle_rad, noise.rate_rad_s], dtype=np.float64)
        swing.start(SwingState(noise.start_position_m, 0.0, noise.start_angle_rad, 0.0))
        s, tally, reading = swing.numbers, np.zeros(3), np.array(self.state())
        reading[2] += errors[0, 0]
        reading[3] += errors[1, 0]
        k, decisions, end = 0, 0, kernel.DUE
        while end == kernel.DUE:
            wanted = float(actor.act(SwingState(*reading.tolist()), k * step_s))
            gain, decisions = float(noise.gain[decisions]), decisions + 1
            k, end = kernel.hold(
                s,
                tally,
                reading,
                errors,
                k,
                wanted,
                gain,
                actor.next_look_s,
                rules,
                edges,
            )
        swing.read()
        duration_s = k * step_s
        swing.check_finite(duration_s)
        peak_m, half_swings, _ = tally.tolist()
        return SimulatedRollout(ENDS[end], duration_s, peak_m, int(half_swings), self.state(), swing.tension_n)

    def catch(self) -> Catch:
        """The free flight after the goal, as SwingUpEnvironment.catch."""
        rules = self._rules
        steps = kernel.fly(self.swing.numbers, self._n_steps, self._catch_m_s2, rules.physics, rules.limits)
        self.swing.read()
        return Catch(miss_m=abs(self.swing.across_m), duration_s=steps * rules.physics.step_s)

    def state(self) -> SwingState:
        """The true plain state now."""
        s = self.swing.numbers.tolist()
        return SwingState(s[0], s[3], math.atan2(s[1] - s[0], -s[2]), float(kernel.turning(self.swing.numbers)))
