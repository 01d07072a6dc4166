"""The rope as a chain of links with mass in DART's world: its state between two steps, on which compiled code works."""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.errors import ConfigError
from kendama_cli.physics.rope import RopeLaw
from kendama_cli.physics.rope_chain import cup_sections_m, laid, link_lengths_m, node_masses_kg
from kendama_cli.robot_model.arm_motion import SAMPLE_S as STEP_S
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.dart import rope_chain_kernel

LINKS = 24
SUB_STEPS, THEIR_KG = 50, 5e-5
"""Sub-steps of a step of the world for a chain of this mass or more; a lighter one swings faster across itself."""
SLACK_WEIGHTS = 3.0
"""A chain whose end pulls with less than so many times its weight counts as slack."""
NUMBERS = 15


class NoChain:
    """A rope without mass."""

    rope_kg = end_kg = 0.0
    arrays = np.empty((0, 8)), np.empty((0, 4)), np.zeros(NUMBERS)

    def lay(self, tie: tuple[Array, Array], ball: tuple[Array, Array], axis: Array) -> None:
        """Do nothing: there is nothing to lay."""


NO_CHAIN = NoChain()


class RopeChain(NoChain):
    """A chain of LINKS links of ``rope_kg`` in all, as long as the rope of ``law``, to a ball of ``ball_kg``.

    The cup is ``carried`` where its speeds are those of the coming step. ``end_kg`` is what of the chain moves with the
    ball; ``arrays`` are nodes, cup and numbers as rope_chain_kernel.pull_chain takes them.
    """

    def __init__(self, game: GameSettings, law: RopeLaw, rope_kg: float, ball_kg: float, *, carried: bool) -> None:
        if law.cup.side_m > 0.0:
            raise ConfigError(
                "game.cup.tie.kind",
                "'game.cup.tie.kind' is side: a rope with mass is tied on the cup's axis; choose "
                "hardware.imperfection.rope_kg=null, or game/cup=floor or handle",
            )
        self._profile, self.rope_kg = law.cup, rope_kg
        self._lengths_m = link_lengths_m(law.length_m, law.cup.used_m, LINKS)
        nodes, numbers = np.zeros((LINKS + 1, 8)), np.zeros(NUMBERS)
        nodes[:, rope_chain_kernel.NODE_KG] = node_masses_kg(rope_kg, self._lengths_m)
        nodes[1:, rope_chain_kernel.NODE_M] = self._lengths_m
        self.end_kg = float(nodes[-1, rope_chain_kernel.NODE_KG])
        nodes[-1, rope_chain_kernel.NODE_KG] += ball_kg
        numbers[rope_chain_kernel.CHAIN_STEPS] = math.ceil(SUB_STEPS * math.sqrt(max(1.0, THEIR_KG / rope_kg)))
        numbers[rope_chain_kernel.CHAIN_PERIOD] = STEP_S
        numbers[rope_chain_kernel.CHAIN_GRAVITY] = game.gravity_m_s2
        numbers[rope_chain_kernel.CHAIN_CARRIED] = carried
        numbers[rope_chain_kernel.CHAIN_SLACK] = SLACK_WEIGHTS * rope_kg * game.gravity_m_s2
        self.arrays = nodes, cup_sections_m(game.cup), numbers

    def lay(self, tie: tuple[Array, Array], ball: tuple[Array, Array], axis: Array) -> None:
        """Lay it the shortest way from ``tie`` to ``ball``, positions and velocities (3,), round the cup."""
        nodes, _, numbers = self.arrays
        (tie_m, tie_m_s), (ball_m, ball_m_s) = tie, ball
        nodes[:, rope_chain_kernel.NODE : rope_chain_kernel.NODE_SPEED] = tie_m + laid(
            self._profile, self._lengths_m, ball_m - tie_m, axis
        )
        fraction = np.append(0.0, np.cumsum(self._lengths_m) / sum(self._lengths_m))[:, None]
        nodes[:, rope_chain_kernel.NODE_SPEED : rope_chain_kernel.NODE_KG] = (
            1.0 - fraction
        ) * tie_m_s + fraction * ball_m_s
        numbers[rope_chain_kernel.CHAIN_BEGUN] = 0.0
