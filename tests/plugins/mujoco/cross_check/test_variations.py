"""Variations of the game in the cross-check: a rope on the ball's surface, spin, a rigid cup, restitution."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from kendama_cli.physics.rim_crossing import SampledBody
from kendama_cli.plugins.mujoco.cross_check.chain import CHAIN_KG, CONTACT_S, STEP_S, chain_model, hang
from kendama_cli.plugins.mujoco.cross_check.cup_track import RECOIL_S, CupTrack
from kendama_cli.plugins.mujoco.library import mujoco
from kendama_cli.plugins.mujoco.shapes import add_cup, ball_surface
from tests.plugins.mujoco.cross_check.test_referee import GAME

BODY = SampledBody(GAME.rope.length_m, GAME.ball.mass_kg, (0.0, 0.0), GAME.cup.restitution, CHAIN_KG)


def swung(*, surface: bool, spin_hz: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Turns (n,) of the rope and of the ball about y [rad] in half a second after the ball is let go 60 deg aside."""
    mj, model = mujoco(), chain_model(GAME, BODY, STEP_S, surface=surface)
    data, start = mj.MjData(model), math.radians(60)
    data.qpos[3] = 1.0
    hang(model, data, [-BODY.rope_m * math.sin(start), 0.0, -BODY.rope_m * math.cos(start)], BODY.rope_m, spin_hz)
    turns = []
    for _ in range(round(0.5 / STEP_S) + 1):
        data.qvel[:6] = data.qpos[:3] = 0.0
        centre, ball = data.site("ball").xpos, data.body("ball").xmat.reshape(3, 3)
        turns.append((math.atan2(-centre[0], -centre[2]), math.atan2(ball[0, 2], ball[0, 0])))
        mj.mj_step(model, data)
    rope, ball = np.unwrap(np.array(turns) - turns[0], axis=0).T
    return rope, ball


def test_a_rope_on_the_surface_turns_the_ball_with_it_and_one_in_the_centre_does_not() -> None:
    """On the surface the ball is a pendulum at the rope's end, at 4 Hz about its line: within 0.05 rad of it here."""
    rope, ball = swung(surface=True)
    assert rope.min() < -1.0
    assert np.abs(ball - rope).max() < 0.1
    rope, ball = swung(surface=False)
    assert rope.min() < -1.0
    assert np.abs(ball).max() < 1e-3


def test_a_ball_that_spins_at_first_goes_on() -> None:
    assert swung(surface=False, spin_hz=1.0)[1][-1] == pytest.approx(2 * math.pi * 0.5, rel=0.02)


def test_a_ball_on_the_surface_hangs_as_low_as_one_in_the_centre() -> None:
    low_m = []
    for surface in (False, True):
        mj, model = mujoco(), chain_model(GAME, BODY, STEP_S, surface=surface)
        data = mj.MjData(model)
        data.qpos[3] = 1.0
        hang(model, data, [0.0, 0.0, -BODY.rope_m], BODY.rope_m)
        low_m.append(float(data.site("ball").xpos[2]))
    assert low_m == pytest.approx([-BODY.rope_m] * 2, abs=1e-6)


def rebound_m(restitution: float, cup_kg: float | None, speed_m_s: float = 2.41) -> float:
    """Highest point of the ball's centre over the rim, dropped on the floor of a cup of ``cup_kg`` (None: rigid)."""
    mj = mujoco()
    spec = mj.MjSpec()
    spec.option.timestep = STEP_S
    cup = spec.worldbody.add_body(name="cup", gravcomp=1.0, mass=cup_kg or 1.0, inertia=[1.0] * 3, explicitinertial=1)
    if cup_kg is not None:
        cup.add_joint(name="up", type=mj.mjtJoint.mjJNT_SLIDE, axis=[0, 0, 1])
    add_cup(mj, cup, GAME.cup)
    ball = spec.worldbody.add_body(name="ball")
    ball.add_freejoint()
    surface = ball_surface(GAME.cup.friction, restitution, CONTACT_S)
    ball.add_geom(size=[GAME.ball.radius_m, 0, 0], mass=GAME.ball.mass_kg, **surface)
    model: Any = spec.compile()
    data = mj.MjData(model)
    first = model.joint(model.body("ball").jntadr[0]).qposadr[0]
    floor_m = GAME.cup.floor_m + GAME.cup.wall_m + GAME.ball.radius_m
    data.qpos[first + 2] = floor_m + 1e-3
    data.qvel[model.body("ball").dofadr[0] + 2] = -speed_m_s
    top_m = -np.inf
    for step in range(round(0.3 / STEP_S)):
        mj.mj_step(model, data)
        if step * STEP_S > 0.01:
            top_m = max(top_m, float(data.qpos[first + 2]))
    return top_m - GAME.cup.rim_m


def momentum_m(restitution: float, cup_kg: float | None, speed_m_s: float = 2.41) -> float:
    """The same from momentum: the ball leaves at v (e M - m) / (M + m), then v^2 / 2 g."""
    ball = GAME.ball.mass_kg
    away = restitution if cup_kg is None else (restitution * cup_kg - ball) / (cup_kg + ball)
    floor_m = GAME.cup.floor_m + GAME.cup.wall_m + GAME.ball.radius_m
    return floor_m + (speed_m_s * away) ** 2 / (2 * GAME.gravity_m_s2) - GAME.cup.rim_m


@pytest.mark.parametrize("restitution", [0.3, 0.6])
@pytest.mark.parametrize("cup_kg", [None, 0.55])
def test_a_rigid_cup_throws_the_ball_higher_than_one_on_an_arm_by_the_law_of_momentum(
    restitution: float, cup_kg: float | None
) -> None:
    """0.55 kg is what the PA10's cup has at the contact (docs/explanation/physics.md)."""
    assert rebound_m(restitution, cup_kg) == pytest.approx(momentum_m(restitution, cup_kg), abs=0.004)


def test_a_rigid_cup_keeps_its_way_and_leaves_out_what_the_blow_does() -> None:
    t_s = np.arange(0.0, 1.0, 0.01)
    way = np.column_stack([0.1 * t_s**2, 0 * t_s, 0 * t_s])
    blow = np.where((t_s > 0.5) & (t_s < 0.5 + RECOIL_S), -0.01, 0.0)[:, None] * [0, 0, 1]
    upright = np.tile([0.0, 0.0, 1.0], (len(t_s), 1))
    carried = CupTrack(t_s, way + blow, upright).rigid(0.5).carried(0.001)
    np.testing.assert_allclose(carried.place_m[:, 0], 0.1 * carried.t_s**2, atol=1e-5)
    assert np.abs(carried.place_m[:, 2]).max() < 1e-6
    assert np.abs(CupTrack(t_s, way + blow, upright).carried(0.001).place_m[:, 2]).max() > 0.009
