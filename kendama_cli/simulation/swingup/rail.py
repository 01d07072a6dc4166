"""The engine ``rail``: a cup on a rail along x and a ball kept to the swing plane, compiled."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kendama_cli.errors import SimulationError
from kendama_cli.learning.decision import ROUNDING_S
from kendama_cli.learning.discretisation import Bins, StateGrid
from kendama_cli.learning.interface import Actor
from kendama_cli.learning.reward import Outcome, Window
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.motion.braking import BrakingLimiter
from kendama_cli.physics.taut_rope import TautRope
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.swingup import rail_kernel as kernel
from kendama_cli.simulation.swingup.engine import catch_limiter, limiter, mouth_m, state_of
from kendama_cli.simulation.swingup.rollout import Catch, RolloutNoise, SimulatedRollout


def physics(game: GameSettings, step_s: float, rope_scale: float = 1.0, drag_scale: float = 1.0) -> kernel.Physics:
    """Return the constants of the dynamics; the mass is inverted as DART inverts a matrix with it on the diagonal."""
    mass = game.ball.mass_kg
    rope, (linear, quadratic) = TautRope.of(game, rope_scale), (drag_scale * one for one in game.drag)
    cup, (_, floor_rad, rim_rad) = rope.cup, rope.corners_rad
    return kernel.Physics(
        step_s=step_s,
        weight_n=game.gravity_m_s2 * mass,
        per_mass=mass * mass * (1.0 / (mass * (mass * mass))),
        length_m=rope.length_m,
        stiffness_n_m=game.rope.stiffness_n_m,
        damping_n_s_m=game.rope.damping_n_s_m,
        drag_n_s_m=linear,
        drag_n_s2_m2=quadratic,
        gravity_m_s2=game.gravity_m_s2,
        rim_m=cup.rim_m,
        radius_m=cup.radius_m,
        floor_m=cup.floor_m,
        handle_m=cup.handle_m,
        at_edge_m=cup.used_m[0],
        at_floor_m=cup.used_m[1],
        at_rim_m=cup.used_m[2],
        floor_rad=floor_rad,
        rim_rad=rim_rad,
    )


@dataclass(frozen=True)
class Rules:
    """All constants of a rollout."""

    physics: kernel.Physics
    limits: kernel.Limits
    catch: kernel.Limits
    aim: kernel.Aim
    bins: Bins
    longest_s: float

    @classmethod
    def of(cls, settings: LearnSettings, game: GameSettings, rope_scale: float = 1.0, drag_scale: float = 1.0) -> Rules:
        """Pack the constants of ``settings`` for compiled code, on such a rope in such an air."""
        goal, grid, window = settings.goal, StateGrid(settings.grid).bins, Window.of(settings.goal)
        return cls(
            physics(game, settings.step_s, rope_scale, drag_scale),
            _limits(limiter(settings), settings),
            _limits(catch_limiter(settings), settings),
            kernel.Aim(
                *window,
                catchable=goal.success == "catchable",
                caught=goal.success == "caught",
                slack_steps=float(max(1, round(goal.slack_s / settings.step_s))),
                landing_limit_m=float(goal.landing_limit_m),
                catch_acceleration_m_s2=float(goal.catch_acceleration_m_s2),
                mouth_m=mouth_m(game),
                lowest_m=0.0 if window.nearest_rad >= 0.5 * math.pi else -math.inf,
            ),
            grid._replace(position=_array(grid.position), velocity=_array(grid.velocity), rate=_array(grid.rate)),
            settings.decision.max_s - ROUNDING_S,
        )

    def packed(self) -> tuple[kernel.Record, NDArray[np.float64]]:
        """Return all constants packed for the compiled loop."""
        return kernel.packed(self.physics, self.limits, self.aim, self.bins, self.longest_s)

    def packed_for_the_catch(self) -> kernel.Record:
        """Return all constants with the limits of the flight after the release."""
        return kernel.packed(self.physics, self.catch, self.aim, self.bins, self.longest_s)[0]


def _array(edges: Sequence[float]) -> NDArray[np.float64]:
    return np.array(edges, dtype=np.float64)


def _limits(limits: BrakingLimiter, settings: LearnSettings) -> kernel.Limits:
    return kernel.Limits(
        half_width_m=float(limits.half_width_m),
        max_speed_m_s=float(limits.max_speed_m_s),
        braking_m_s2=float(limits.braking_m_s2),
        max_m_s2=float(limits.max_m_s2),
        edge_m=float(settings.workspace.half_width_m) if settings.workspace.kind == "terminate" else math.inf,
    )


class CompiledRail:
    """The cup accelerates as commanded, the rope's force and drag act on the ball (equations.md eq. 1).

    The rope's reaction does not move the cup. ``numbers`` is the state as the compiled code takes it. The same model in
    DART (tests/simulation/swingup/rail_dart.py) gives the same numbers bit for bit.
    """

    def __init__(self, game: GameSettings, step_s: float) -> None:
        self._game, self._step_s = game, step_s
        self.take_on(1.0, 1.0)
        self.numbers: NDArray[np.float64] = np.zeros(8)
        self.start(SwingState(0.0, 0.0, 0.0, 0.0))

    def take_on(self, rope_scale: float, drag_scale: float) -> None:
        """Take on a rope so many times as long and an air drag so many times as large, from the next ``start`` on."""
        self._physics = physics(self._game, self._step_s, rope_scale, drag_scale)
        self._stretched = TautRope.hanging(self._game, rope_scale)

    def start(self, state: SwingState) -> None:
        """Put cup and ball into ``state`` with the rope stretched as by the hanging ball."""
        ball = self._stretched.ball(state.angle_rad, state.rate_rad_s)
        self.numbers[:] = (
            state.x_m,
            state.x_m + ball.across_m,
            ball.above_m,
            state.velocity_m_s,
            state.velocity_m_s + ball.across_m_s,
            ball.above_m_s,
            0.0,
            0.0,
        )
        self.read()

    def step(self, acceleration_m_s2: float) -> None:
        """Advance by one time step with the forces of the present state."""
        kernel.step(self.numbers, float(acceleration_m_s2), self._physics)
        self.read()

    def read(self) -> None:
        """Take the plain numbers from ``numbers``."""
        x_m, ball_x, ball_z, velocity_m_s, ball_vx, ball_vz, _, _ = self.numbers.tolist()
        self.x_m, self.velocity_m_s = x_m, velocity_m_s
        self.across_m, self.above_m = ball_x - x_m, ball_z
        self.across_m_s, self.above_m_s = ball_vx - velocity_m_s, ball_vz

    @property
    def reference(self) -> tuple[float, float]:
        """The cup obeys at once: where it is and how fast."""
        return self.x_m, self.velocity_m_s

    @property
    def tension_n(self) -> float:
        """The rope's tension in the step that led here [N]."""
        return math.hypot(self.numbers[6], self.numbers[7])

    @property
    def in_cup(self) -> None:
        """None: nothing touches on the rail, so that the ball falls through the cup."""
        return

    def check_finite(self, t_s: float) -> None:
        """Raise SimulationError if the state is no longer finite, or far beyond any rope's stretch."""
        extent = abs(self.x_m) + abs(self.across_m) + abs(self.above_m)
        if not extent < 1e3 * self._physics.length_m:
            raise SimulationError(
                "swing",
                t_s,
                f"the simulated swing left its domain at {t_s:.3f} s (extent {extent:g} m); "
                "lower learn.step_s or game.rope.stiffness_n_m",
            )


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
        desired, gain = 0.0, 1.0
        while end == kernel.DUE:
            before, gain_before = desired, gain
            desired = float(actor.act(SwingState(*reading.tolist()), k * step_s))
            gain, decisions = float(noise.gain[decisions]), decisions + 1
            k, end = kernel.hold(
                s,
                tally,
                reading,
                errors,
                k,
                desired,
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
