"""A game as another physics can play it again."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kendama_cli.control.catch_game import Game
from kendama_cli.control.cup_cart import CartStep
from kendama_cli.control.scene_history import SceneHistory
from kendama_cli.log.messages import ReplayMessage
from kendama_cli.physics.rim_crossing import SampledWays
from kendama_cli.physics.sampled_body import SampledBody
from kendama_cli.physics.taut_rope import stretch_m
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.hardware import HardwareSettings, SimulatedHardware, TwinHardware
from kendama_cli.settings.robot import Imperfection

UPRIGHT = np.array([0.0, 0.0, 1.0])


def imperfection(hardware: HardwareSettings) -> Imperfection | None:
    """How the robot differs from the model, which only the settings of our own simulated ones tell."""
    return hardware.imperfection if isinstance(hardware, SimulatedHardware | TwinHardware) else None


def played_body(settings: GameSettings, made: Imperfection | None, history: SceneHistory) -> SampledBody:
    """The body of the game that ``history`` holds: the simulated robot's own where ``made`` says how it was made.

    Its rope is what is left of the distance from the true tie to the ball, which hangs at rest as a game begins, after
    the weight's stretch m g / Ks. Otherwise the body is that of the settings on the rope that was measured.
    """
    (linear, quadratic), mass_kg, rope_m = settings.drag, settings.ball.mass_kg, history.rope_m
    rope_kg = settings.rope.mass_kg if made is None or made.rope_kg is None else made.rope_kg
    if made is not None:
        linear, quadratic = made.drag_scale * linear, made.drag_scale * quadratic
        mass_kg *= made.mass_scale
    if made is not None and history.reported:
        first = history.rollout()[0]
        stretched_m = float(np.linalg.norm(first[7:] - first[1:4]))
        rope_m = stretched_m - stretch_m(mass_kg * settings.gravity_m_s2, settings.rope.stiffness_n_m)
    return SampledBody(rope_m, mass_kg, (linear, quadratic), settings.cup.restitution, rope_kg)


def replay_message(
    index: int,
    game: Game,
    steps: Sequence[CartStep],
    history: SceneHistory,
    settings: GameSettings,
    *,
    made: Imperfection | None = None,
) -> ReplayMessage:
    """The true ways of cup and ball where the robot reports them, else the tracked ones of an upright cup.

    With ``made``, that of the simulated robot, the body is its own.
    """
    body = played_body(settings, made, history)
    way = history.rollout() if history.reported else _tracked(steps)
    t_s, cup_m, axis, ball_m = way[:, 0], way[:, 1:4], way[:, 4:7], way[:, 7:]
    since_s = game.swing.duration_s
    miss_m = SampledWays(t_s, cup_m, axis, ball_m).miss_m(settings, since_s)
    return ReplayMessage(
        index=index,
        rope_m=body.rope_m,
        rope_kg=body.rope_kg,
        ball_kg=body.ball_kg,
        drag_n_s_m=body.drag[0],
        drag_n_s2_m2=body.drag[1],
        restitution=body.restitution,
        since_s=since_s,
        caught=game.caught,
        miss_m=float("nan") if miss_m is None else miss_m[0],
        t_s=t_s,
        cup_m=cup_m.ravel(),
        cup_axis=axis.ravel(),
        ball_m=ball_m.ravel(),
    )


def _tracked(steps: Sequence[CartStep]) -> Array:
    states = [(one.t_s, one.exchange.state) for one in steps]
    return np.array([[t_s, *state.cup_in_world_m, *UPRIGHT, *state.ball_in_world_m] for t_s, state in states])
