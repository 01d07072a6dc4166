"""The learner ``agent``, as a declaration for the entry point group ``kendama.learners``."""

from kendama_cli.schema.registry import Variant

AGENT = Variant(
    "agent",
    settings="kendama_cli.plugins.agents.settings:AgentSettings",
    makes="kendama_cli.plugins.agents.learner:AGENT",
    library="gymnasium",
)
