"""The rope as a chain of colliding links between a cup that is carried and the ball, in MuJoCo."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kendama_cli.errors import ConfigError
from kendama_cli.physics.rim_crossing import SampledBody
from kendama_cli.physics.rope import CupProfile
from kendama_cli.plugins.mujoco.library import mujoco
from kendama_cli.plugins.mujoco.shapes import add_cup, ball_surface
from kendama_cli.settings.game import GameSettings, SideTie

LINKS = 40
LINK_RADIUS_M = 0.0001
CHAIN_KG = 0.00005
"""Mass of the whole chain, where none is given."""
STEP_S = 0.0001
"""At twice this, in one of 150 games the ball pressed slack links through the cup's wall after the catch."""
JOINT_DAMPING, ARMATURE = 1e-6, 1e-7
LEAST_KG_M2 = 1e-12
"""Of a link, beside the joints' armature; MuJoCo refuses what is much less."""
CUP_KG, CUP_KG_M2 = 100.0, 10.0
"""The carried cup is so heavy that chain and ball do not move it within a step; after each it is put on its way."""
CONTACT_S = 0.0005
"""Time constant of a link's contact; of the ball's, the inverse of its undamped rate: a rebound takes 15 steps."""
SAME_M = 1e-6
"""Edges of the cup that are nearer to each other along the rope are one."""


@dataclass(frozen=True)
class Variation:
    """Changes of the referee's kendama from that of the game that it plays again.

    ``rope_kg`` and ``restitution`` replace the game's; None keeps them (a rope without mass weighs CHAIN_KG). The rope
    ends in the ball's centre, or on its ``surface``, and pulls it round then. ``spin_hz`` is the ball's first spin
    about y. A ``rigid`` cup does not recoil from the ball.
    """

    rope_kg: float | None = None
    restitution: float | None = None
    surface: bool = False
    spin_hz: float = 0.0
    rigid: bool = False


def link_lengths_m(rope_m: float, edges_m: Sequence[float], links: int) -> list[float]:
    """Split a rope into ``links``, with an end where it goes over each edge of the cup, ``edges_m`` along the rope.

    A taut rope lies over an edge always with the same place. A link across an edge would cut its corner.
    """
    ends = np.unique([0.0, *(edge for edge in edges_m if edge < rope_m), rope_m])
    gaps = np.diff(ends[np.insert(np.diff(ends) > SAME_M, 0, True)])
    pieces = np.ones(len(gaps), dtype=int)
    while pieces.sum() < links:
        pieces[np.argmax(gaps / pieces)] += 1
    return np.repeat(gaps / pieces, pieces).tolist()


def chain_model(game: GameSettings, body: SampledBody, step_s: float, *, surface: bool = False) -> Any:
    """Build a model of cup, chain and ball: the cup on a free joint, a hinge about y for every link and the ball.

    The chain is as long as the rope that the ball's weight stretches; it collides with the cup without friction, the
    ball with the game's. On the ball's ``surface`` the chain is shorter by its radius. Raises ConfigError for a tie at
    the cup's side.
    """
    cup = game.cup
    if isinstance(cup.tie, SideTie):
        raise ConfigError(
            "game.cup.tie.kind",
            "'game.cup.tie.kind' is side: the referee's chain moves in the plane of the swing, which a rope round the "
            "wall leaves; choose game/cup=floor or handle",
        )
    mj = mujoco()
    spec = mj.MjSpec()
    spec.option.timestep = step_s
    spec.option.integrator = mj.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.gravity = [0.0, 0.0, -game.gravity_m_s2]
    carried = spec.worldbody.add_body(
        name="cup", gravcomp=1.0, mass=CUP_KG, inertia=[CUP_KG_M2] * 3, explicitinertial=1
    )
    carried.add_freejoint()
    add_cup(mj, carried, game.cup)
    holder, below = carried, 0.0
    offset_m = game.ball.radius_m if surface else 0.0
    for number, length in enumerate(link_lengths_m(body.rope_m - offset_m, CupProfile.of(cup).used_m, LINKS)):
        link_kg = body.rope_kg * length / body.rope_m
        holder = holder.add_body(
            name=f"link {number}",
            pos=[0.0, 0.0, below],
            mass=link_kg,
            ipos=[0.0, 0.0, -length / 2],
            inertia=[link_kg * length**2 / 12 + LEAST_KG_M2] * 3,
            explicitinertial=1,
        )
        holder.add_joint(
            name=f"hinge {number}",
            type=mj.mjtJoint.mjJNT_HINGE,
            axis=[0, 1, 0],
            damping=JOINT_DAMPING,
            armature=ARMATURE,
        )
        holder.add_geom(
            type=mj.mjtGeom.mjGEOM_CAPSULE,
            fromto=[0, 0, 0, 0, 0, -length],
            size=[LINK_RADIUS_M, 0, 0],
            mass=0.0,
            contype=0,
            conaffinity=1,
            condim=1,
            priority=1,
            solref=[CONTACT_S, 1.0],
        )
        below = -length
    _add_ball(mj, holder, (below, offset_m), game, body)
    spec.add_sensor(
        name="ball velocity", type=mj.mjtSensor.mjSENS_FRAMELINVEL, objtype=mj.mjtObj.mjOBJ_SITE, objname="ball"
    )
    return spec.compile()


def _add_ball(mj: Any, holder: Any, below_m: tuple[float, float], game: GameSettings, body: SampledBody) -> None:
    """Add the ball at the end of the last link, on a slide that stretches as the rope does.

    ``below_m`` are the height of the link's end, and the distance from there to the ball's centre.
    """
    end_m, offset_m = below_m
    ball = holder.add_body(name="ball", pos=[0.0, 0.0, end_m])
    ball.add_joint(
        name="stretch",
        type=mj.mjtJoint.mjJNT_SLIDE,
        axis=[0, 0, -1],
        stiffness=game.rope.stiffness_n_m,
        damping=game.rope.damping_n_s_m,
    )
    ball.add_joint(name="spin", type=mj.mjtJoint.mjJNT_HINGE, axis=[0, 1, 0])
    ball.add_geom(
        size=[game.ball.radius_m, 0, 0],
        pos=[0.0, 0.0, -offset_m],
        mass=body.ball_kg,
        **ball_surface(game.cup.friction, body.restitution, CONTACT_S),
    )
    ball.add_site(name="ball", pos=[0.0, 0.0, -offset_m])


def hang(model: Any, data: Any, ball_m: Any, rope_m: float, spin_hz: float = 0.0) -> None:
    """Straighten the chain from the tie toward ``ball_m`` (3,), at rest but for the ball's spin."""
    apart = np.asarray(ball_m) - data.qpos[:3]
    data.qpos[7:] = 0.0
    data.qvel[:] = 0.0
    data.qpos[7] = math.atan2(-apart[0], -apart[2])
    data.qvel[model.joint("spin").dofadr[0]] = 2.0 * math.pi * spin_hz
    data.qpos[model.joint("stretch").qposadr[0]] = np.linalg.norm(apart) - rope_m
    mujoco().mj_forward(model, data)
