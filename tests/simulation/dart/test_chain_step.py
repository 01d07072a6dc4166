"""One step of a rope with mass is an implicit step of Newton's law: its forces follow from where it comes."""

from __future__ import annotations

import copy
import dataclasses

import numpy as np
import pytest

from kendama_cli.physics.rope import RopeLaw
from kendama_cli.physics.rope_chain import cup_sections_m
from kendama_cli.schema.settings import build
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.dart.rope_chain_kernel import RopeChain, pull_chain
from kendama_cli.simulation.dart.rope_kernel import rope_constants
from tests.shipped_conf import plain

GAME = build(GameSettings, plain("game", "kendama"), "game")
LAW = RopeLaw.of(GAME)
PERIOD_S, AXIS_M, GRAVITY_M_S2 = 1e-3, 0.1, GAME.gravity_m_s2
"""The world's step, the height of the point that tells the axis, and gravity."""
SURFACE_N_M, SURFACE_S, EDGE_M = 1e5, 2e-4, 5e-4
"""The cup under a node: 20 um under 2 N, a time of 0.2 ms, edges of half a millimetre."""
LINK_N_M, LINK_S = 2e6, 1e-4
REACTION, PIVOT = 4, 7


@dataclasses.dataclass
class Pressed:
    """A cup that moves and turns, and a chain round it of which some nodes have come into it."""

    chain: RopeChain
    tie_m: np.ndarray
    tie_m_s: np.ndarray
    axis: np.ndarray
    axis_rate: np.ndarray
    ball_m: np.ndarray
    ball_m_s: np.ndarray

    @classmethod
    def drawn(cls, seed: int, rope_kg: float = 2e-3) -> Pressed:
        """Draw one that goes round floor and rim to a ball above the cup, some of its links taut, by the seed."""
        rng = np.random.default_rng(seed)
        axis = np.array([0.0, 0.0, 1.0]) + 0.1 * rng.standard_normal(3)
        axis /= np.linalg.norm(axis)
        rate = np.cross(0.5 * rng.standard_normal(3), axis)
        tie, tie_speed = rng.standard_normal(3), 0.3 * rng.standard_normal(3)
        side = np.cross(axis, rng.standard_normal(3))
        cup, bend = LAW.cup, rng.uniform(1.44, 1.55)
        left_m = (LAW.length_m - cup.used_m[-1]) * (1.0 + rng.uniform(-1e-5, 1e-4))
        ball = tie + (cup.radius_m - left_m * np.cos(bend)) * side / np.linalg.norm(side)
        ball += (cup.rim_m + left_m * np.sin(bend)) * axis
        ball_speed = tie_speed + 0.3 * rng.standard_normal(3)
        chain = RopeChain(GAME, LAW, rope_kg, GAME.ball.mass_kg, carried=True)
        chain.lay((tie, tie_speed), (ball, ball_speed), axis)
        nodes = chain.arrays[0]
        nodes[1:-1, :3] += 1e-5 * rng.standard_normal((len(nodes) - 2, 3))
        nodes[1:-1, 3:6] += 0.05 * rng.standard_normal((len(nodes) - 2, 3))
        return cls(chain, tie, tie_speed, axis, rate, ball, ball_speed)

    def step(self, steps: int, period_s: float, drag: float) -> tuple[np.ndarray, np.ndarray]:
        """Step the chain on; return the numbers of ``pulled`` (13,) and the force on the ball (3,)."""
        pulled, force = np.zeros(13), np.zeros(3)
        rope = np.array([*rope_constants(LAW), drag, 0.0, AXIS_M])
        up_m, up_m_s = self.tie_m + AXIS_M * self.axis, self.tie_m_s + AXIS_M * self.axis_rate
        nodes, solid, numbers = self.chain.arrays
        numbers[:2] = steps, period_s
        cup = self.tie_m, self.tie_m_s, up_m, up_m_s
        assert pull_chain(self.ball_m, self.ball_m_s, *cup, rope, nodes, solid, numbers, pulled, force)
        return pulled, force

    def depth(self, place_m: np.ndarray) -> tuple[float, np.ndarray]:
        """Return how deep a place (3,) is in the cup, negative outside, and the way out (3,): by differences."""

        def inside(at: np.ndarray) -> float:
            above = float((at - self.tie_m) @ self.axis)
            out = float(np.linalg.norm(at - self.tie_m - above * self.axis))
            depths = []
            for low, high, bottom, top in cup_sections_m(GAME.cup):
                beside = np.array([max(low - out, out - high), max(bottom - above, above - top)])
                beyond = beside + EDGE_M  # from the box that is smaller by the edge's radius on every side
                outside = np.linalg.norm(np.maximum(beyond, 0.0)) + min(beyond.max(), 0.0)
                depths.append(EDGE_M - outside)
            return float(max(depths))

        small = 1e-7
        slope = [(inside(place_m + e) - inside(place_m - e)) / (2 * small) for e in small * np.eye(3)]
        return inside(place_m), -np.array(slope)


@pytest.mark.parametrize("seed", range(20000, 20012))
def test_every_node_moves_by_the_forces_where_the_step_ends(seed: int) -> None:
    """Springs and dampers of links and cup, weight and air: m (v' - v) = h f(x + h v', v')."""
    made, h, drag = Pressed.drawn(seed), PERIOD_S / 40, 0.02
    before = copy.deepcopy(made.chain.arrays[0])
    pulled, _ = made.step(1, h, drag)
    after, mass = made.chain.arrays[0], before[:, 6]
    place, speed, speed_after = before[:, :3], before[:, 3:6], after[:, 3:6].copy()
    speed_after[0] = made.tie_m_s
    np.testing.assert_allclose(after[1:, :3], (place + h * speed_after)[1:], atol=1e-15)
    push = np.zeros_like(place)
    contacts = np.zeros_like(place)
    push[:, 2] -= mass * GRAVITY_M_S2
    push[-1] -= drag * made.ball_m_s
    pulls = []
    for i in range(1, len(place)):
        along = place[i] - place[i - 1]
        size = np.linalg.norm(along)
        along /= size
        growth = along @ (speed_after[i] - speed_after[i - 1])
        spring, damper = (
            (LAW.stiffness_n_m, LAW.damping_n_s_m) if i == len(place) - 1 else (LINK_N_M, LINK_N_M * LINK_S)
        )
        pulls.append(max(0.0, spring * (size - before[i, 7] + h * growth) + damper * growth))
        push[i] -= pulls[-1] * along
        push[i - 1] += pulls[-1] * along
    turning = np.cross(made.axis, made.axis_rate)
    for i in range(1, len(place) - 1):
        depth, out = made.depth(place[i])
        if depth > 0.0:
            surface = made.tie_m_s + np.cross(turning, place[i] - made.tie_m)
            leaving = out @ (speed_after[i] - surface)
            contacts[i] = SURFACE_N_M * (depth - (h + SURFACE_S) * leaving) * out
    assert contacts.any()
    assert np.count_nonzero(pulls) >= 2
    change = mass[1:, None] * (speed_after - speed)[1:]
    np.testing.assert_allclose(change, h * (push + contacts)[1:], atol=2e-5 * h)
    # the cup has what the chain has not: the first link's pull and the opposite of every contact
    on_cup = push[0] + [0.0, 0.0, mass[0] * GRAVITY_M_S2] - contacts.sum(axis=0)
    np.testing.assert_allclose(pulled[REACTION:PIVOT], on_cup, atol=2e-5)
    moment = -np.cross(place - made.tie_m, contacts).sum(axis=0)
    about = np.cross(on_cup, moment) / (on_cup @ on_cup)
    about *= min(1.0, 2.0 * LAW.cup.rim_m / np.linalg.norm(about))  # a force of nearly nothing acts somewhere at hand
    np.testing.assert_allclose(pulled[PIVOT : PIVOT + 3], made.tie_m + about, atol=2e-6)


@pytest.mark.parametrize("seed", range(20100, 20104))
def test_sub_steps_are_steps_of_their_length(seed: int) -> None:
    """Three in one as one after another, with the cup and the ball where each comes to; forces are means."""
    once, each, h = Pressed.drawn(seed), Pressed.drawn(seed), PERIOD_S / 40
    whole, force = once.step(3, 3 * h, 0.0)
    parts = []
    for _ in range(3):
        parts.append(each.step(1, h, 0.0)[0][REACTION:PIVOT])
        each.tie_m, each.axis = each.tie_m + h * each.tie_m_s, each.axis + h * each.axis_rate
        each.ball_m, each.ball_m_s = each.chain.arrays[0][-1, :3].copy(), each.chain.arrays[2][12:15].copy()
    np.testing.assert_allclose(once.chain.arrays[0][1:, :6], each.chain.arrays[0][1:, :6], atol=1e-9)
    np.testing.assert_allclose(whole[REACTION:PIVOT], np.mean(parts, axis=0), atol=1e-5)
    # one even force brings the ball there in one step: m ((x' - x) / t - v) / t and its weight
    came_m_s = (each.ball_m - once.ball_m) / (3 * h) - once.ball_m_s + [0.0, 0.0, 3 * h * GRAVITY_M_S2]
    mass_kg = GAME.ball.mass_kg + once.chain.end_kg
    np.testing.assert_allclose(force, mass_kg * came_m_s / (3 * h), rtol=1e-6, atol=1e-6)
