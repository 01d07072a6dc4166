"""The learners that come with kendama, as declarations for the entry point group ``kendama.learners``.

``makes`` names a LearnerMaker (``kendama_cli/learning/interface.py``).
"""

from kendama_cli.schema.registry import Variant

SARSA = Variant(
    "sarsa",
    settings="kendama_cli.learning.learner_settings:SarsaSettings",
    makes="kendama_cli.learning.sarsa:SARSA",
)
LUCKY = Variant(
    "random_replay",
    settings="kendama_cli.learning.learner_settings:LuckySettings",
    makes="kendama_cli.learning.lucky:LUCKY",
)
RANDOM = Variant(
    "random",
    settings="kendama_cli.learning.learner_settings:RandomSettings",
    makes="kendama_cli.learning.lucky:RANDOM",
)
PUMP = Variant(
    "energy_pumping",
    settings="kendama_cli.learning.learner_settings:PumpSettings",
    makes="kendama_cli.learning.pump:PUMP",
)
