"""Settings of an agent of another library: the agent, and the environment that it is trained in."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from kendama_cli.schema.registry import Registry, Variant, declared
from kendama_cli.schema.settings import setting
from kendama_cli.settings.game import GameSettings


class AgentRegistry(Registry):
    """Agents by name: an entry point names what makes one, so that a package of agents imports nothing of kendama.

    The package counts for a result as that of any part does.
    """

    def variant(self, kind: str) -> Variant:
        """Return the declaration of the agent ``kind``."""
        made_by = declared(self.group)[kind]
        return Variant(kind, settings="kendama_cli.plugins.agents.settings:NamedAgent", makes=made_by)


AGENTS = AgentRegistry("kendama.agents", "agent")


@dataclass(frozen=True)
class NamedAgent:
    """An agent by the name of its entry point."""

    kind: str


@dataclass(frozen=True)
class AgentSettings:
    """An agent of another library, trained by its own method in the rollouts of ``learn``, then frozen."""

    kind: Literal["agent"]
    agent: Annotated[NamedAgent, AGENTS]
    game: GameSettings
    actions: Literal["discrete", "continuous"] = setting(
        "Actions of the agent: one of learn.actions_m_s2 by its index ('discrete'), or a fraction of the maximum."
    )
    normalised: bool = setting("If true, the numbers that the agent observes are scaled to about -1 to 1.")
    hold_s: float = setting("An action of the agent is held for this long [s].", above=0)
    shaping: float = setting(
        "Weight of a reward for the ball's energy, in training only. It does not change the best policy.", at_least=0
    )
    gamma: float = setting("Discount factor of the agent, which the shaping needs.", at_least=0, at_most=1)
    validation_rollouts: int = setting(
        "The last rollouts of learn.count.max_rollouts, this many, validate the frozen agent; those before train it.",
        above=0,
    )
