"""The learners that come with kendama, as declarations for the entry point group ``kendama.learners``.

``makes`` names a LearnerMaker (``kendama_cli/learning/interface.py``).
"""

from kendama_cli.schema.registry import Variant

SARSA = Variant(
    "sarsa",
    settings="kendama_cli.learning.settings:SarsaSettings",
    makes="kendama_cli.learning.sarsa:SARSA",
)
RANDOM_REPLAY = Variant(
    "random_replay",
    settings="kendama_cli.learning.settings:RandomReplaySettings",
    makes="kendama_cli.learning.random_replay:RANDOM_REPLAY",
)
RANDOM = Variant(
    "random",
    settings="kendama_cli.learning.settings:RandomSettings",
    makes="kendama_cli.learning.random_replay:RANDOM",
)
ENERGY_PUMPING = Variant(
    "energy_pumping",
    settings="kendama_cli.learning.settings:EnergyPumpingSettings",
    makes="kendama_cli.learning.energy_pumping:ENERGY_PUMPING",
)
