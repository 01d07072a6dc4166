"""Settings of the core's learners beside those that all learners share (``LearnSettings``)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class SarsaSettings:
    """SARSA(lambda) and its kin on a table of values; ``learn.alpha``, ``learn.gamma`` and so on are its constants."""

    kind: Literal["sarsa"]


@dataclass(frozen=True)
class RandomReplaySettings:
    """The baseline: harmonics are sampled until one succeeds, and that one is replayed without a table."""

    kind: Literal["random_replay"]
    after_failure: float = setting(
        "probability that the rollout after a replay that failed samples anew", at_least=0, at_most=1
    )


@dataclass(frozen=True)
class RandomSettings:
    """Chance itself: every rollout samples a harmonic, and none is kept."""

    kind: Literal["random"]


@dataclass(frozen=True)
class EnergyPumpingSettings:
    """A hand-written controller that pumps energy into the ball and keeps the cup near the centre; it learns nothing.

    With the energy E of the ball over hanging still (per mass, [J/kg]) and its desired value E* = g l (1 + height),

        a = -gain (E* - E) cos(angle - lead) sign(rate) - stiffness x - damping v,

    clipped to the maximum action.
    """

    kind: Literal["energy_pumping"]
    height: float = setting("desired height of the ball's turning point over the tie, in rope lengths")
    gain: float = setting("acceleration per missing energy [1/m]", above=0)
    lead_rad: float = setting("lead of the pumping over the ball's angle [rad]")
    braking: float = setting("fraction of the gain with which too much energy is taken out", at_least=0)
    stiffness_per_s2: float = setting("spring of the cup toward the centre [1/s^2]", at_least=0)
    damping_per_s: float = setting("damping of the cup [1/s]", at_least=0)
