"""Rollouts in compiled code: from one decision to the next, and the flight after the release."""

from __future__ import annotations

import numpy as np

from kendama_cli.learning.interface import Actor
from kendama_cli.learning.reward import Outcome
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.swingup import rail_kernel as kernel
from kendama_cli.simulation.swingup.engine import state_of
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

    def roll_out(self, actor: Actor, noise: RolloutNoise) -> SimulatedRollout:
        """Play one rollout, as SwingUpEnvironment.roll_out."""
        swing, nominal, (rules, edges) = self.swing, self._rules, self._packed
        swing.take_on(noise.rope_scale, noise.drag_scale)
        if (noise.workspace_scale, noise.rope_scale, noise.drag_scale) != (1.0, 1.0, 1.0):
            scaled = self._settings.with_workspace_scale(noise.workspace_scale)
            nominal = Rules.of(scaled, self._game, noise.rope_scale, noise.drag_scale)
            rules, edges = nominal.packed()
        step_s = nominal.physics.step_s
        errors = np.array([noise.angle_rad, noise.rate_rad_s], dtype=np.float64)
        swing.start(SwingState(noise.start_position_m, 0.0, noise.start_angle_rad, 0.0))
        s, tally, reading = swing.numbers, np.zeros(kernel.TALLY), np.array(self.state())
        reading[2] += errors[0, 0]
        reading[3] += errors[1, 0]
        k, decisions, end, delay = 0, 0, kernel.DUE, noise.delay_steps
        wanted, gain = 0.0, 1.0
        while end == kernel.DUE:
            before, gain_before = wanted, gain
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
                before,
                gain_before,
                delay,
                actor.next_look_s,
                rules,
                edges,
            )
        swing.read()
        duration_s = k * step_s
        swing.check_finite(duration_s)
        final, outcome = self.state(), ENDS[end]
        catch = self._catch(nominal) if outcome == "goal" else None
        if nominal.aim.caught and catch is not None and not catch.caught:
            outcome = "missed"
        return SimulatedRollout(outcome, duration_s, float(tally[0]), int(tally[1]), final, catch)

    def _catch(self, rules: Rules) -> Catch:
        """Play the flight, as SwingUpEnvironment.fly."""
        s, physics, aim = self.swing.numbers, rules.physics, rules.aim
        steps = kernel.fly(s, kernel.LONGEST_FLIGHT, aim.catch_acceleration_m_s2, physics, rules.catch)
        caught = kernel.is_caught(s, aim.mouth_m, physics, rules.catch)
        self.swing.read()
        return Catch(miss_m=abs(self.swing.across_m), duration_s=steps * physics.step_s, caught=bool(caught))

    def state(self) -> SwingState:
        """Return the true plain state now."""
        self.swing.read()
        return state_of(self.swing)
